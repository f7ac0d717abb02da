//! What happens next: schedulers decide when nodes run, a schedule keeps their alarms.

mod agenda;
mod dispatch;
mod kit;
mod node_knobs;
mod periodic;
mod release;
mod schedule;
mod scheduler;
mod task_set;

pub use agenda::Phase;
pub use dispatch::{Dispatch, Joined, Threads};
pub use kit::{Kit, TaskSpec};
pub use periodic::Periodic;
pub(crate) use periodic::Plain;
pub(crate) use release::EACH;
pub use release::{Matching, Release};
pub(crate) use schedule::{Assignment, Schedule};
pub(crate) use scheduler::Member;
pub use scheduler::{Scheduler, SchedulerEvent, TaskState, Timetable};
pub(crate) use task_set::TaskSet;
