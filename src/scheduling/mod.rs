//! What happens next: schedulers decide when nodes run, a stage keeps their alarms.

mod agenda;
mod crew;
mod dispatch;
mod job;
mod kit;
mod member;
mod periodic;
mod scheduler;
mod seat;
mod stage;

pub use agenda::Phase;
pub(crate) use crew::Crew;
pub use dispatch::{Dispatch, Joined, Threads};
pub use job::{Job, JobKind};
pub use kit::{Kit, TaskSpec};
pub(crate) use member::Member;
pub use periodic::Periodic;
pub(crate) use periodic::Plain;
pub use scheduler::{Scheduler, SchedulerEvent, TaskState, Timetable};
pub(crate) use seat::{Again, Fixed, Seat};
pub(crate) use stage::{Assignment, Moment, Stage, WorkTimes};
