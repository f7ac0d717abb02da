//! Executors: which nodes share threads, and by which rules; and what a tick needs of several
//! topics that trigger its node.
//!
//! An [`Executor`] with its [`Callback`]s is a [`Dispatch`](ratelab::Dispatch) of the core, and
//! makes a [`Scheduler`](ratelab::Scheduler): by windows, in the order of events, or preemptive.
//! Each of these owns no node and waits for nothing, so the same one serves both clocks.
//!
//! Stands on the core (`ratelab`) only. Begin with `executor.rs`; `windows.rs` shows what a
//! scheduler is. Another executor is another file like that. A [`Match`] is a
//! [`Matching`](ratelab::Matching) of the core: `exact.rs` shows one.

mod approximate;
mod callback;
mod choice;
mod crew;
mod dispatch;
mod each;
mod events;
mod exact;
mod executor;
mod groups;
mod kit;
mod matcher;
mod matching;
mod own;
mod preemptive;
mod task;
mod trigger;
mod windows;

pub use callback::Callback;
pub use choice::Choice;
pub use dispatch::Executors;
pub use executor::Executor;
pub use kit::Effects;
pub use matcher::Matcher;
pub use matching::Match;
