//! What happens next: schedulers decide when nodes run, a schedule keeps their alarms.
//!
//! | | is |
//! |---|---|
//! | task set | nodes with one scheduler: the nodes of an executor, or one node on its own |
//! | member | a node of a task set, by its number there |
//! | scheduler | decides when its members run; hears of events, answers with jobs |
//! | timetable | what a scheduler can ask for at an instant: alarms, a choice, records |
//! | agenda | the alarms and arrivals to come, in order |
//! | schedule | some task sets with their agenda: all in virtual time, one under the real clock |
//! | assignment | a job of a node, on its way from the schedule to who does it |

mod agenda;
pub(crate) mod executors;
mod node_knobs;
mod own;
mod schedule;
mod task;
mod task_set;
mod timetable;

pub(crate) use schedule::{Assignment, Schedule};
pub(crate) use task::Task;
pub(crate) use task_set::TaskSet;
pub(crate) use timetable::Member;
