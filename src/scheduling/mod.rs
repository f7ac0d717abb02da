//! What happens next: schedulers decide when nodes run, a schedule keeps their alarms.

mod agenda;
mod dispatch;
mod job;
mod kit;
mod member;
mod node_slot;
mod periodic;
mod schedule;
mod scheduler;
mod task_set;

pub use agenda::Phase;
pub use dispatch::{Dispatch, Joined, Threads};
pub use job::{Job, JobKind};
pub use kit::{Kit, TaskSpec};
pub(crate) use member::Member;
pub(crate) use node_slot::{Fixed, NodeSlot, Rebuild};
pub use periodic::Periodic;
pub(crate) use periodic::Plain;
pub(crate) use schedule::{Assignment, Moment, Schedule, WorkTimes};
pub use scheduler::{Scheduler, SchedulerEvent, TaskState, Timetable};
pub(crate) use task_set::TaskSet;
