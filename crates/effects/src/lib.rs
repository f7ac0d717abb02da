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
mod chance;
mod channel;
mod choice;
mod cost;
mod crew;
mod digest;
mod dispatch;
mod draw;
mod each;
mod events;
mod exact;
mod executor;
mod groups;
mod kit;
mod link;
mod local_clock;
mod matcher;
mod matching;
mod own;
mod preemptive;
mod spec;
mod task;
mod trigger;
mod windows;

pub use callback::Callback;
pub use chance::Chance;
pub use choice::Choice;
pub use cost::Cost;
pub use digest::Digest;
pub use dispatch::Executors;
pub use draw::{Draw, Recorded};
pub use executor::Executor;
pub use kit::Effects;
pub use link::Link;
pub use local_clock::ClockError;
pub use matcher::Matcher;
pub use matching::Match;
pub use spec::{checked, draw, knob, takes_time, with_draw};
