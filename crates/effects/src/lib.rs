//! What makes a run like a real machine: ticks that take time or begin late, faults and wrong
//! clocks, links between topics, ticks on messages, executors.
//!
//! | what | its file | hook of the core |
//! |---|---|---|
//! | [`Effects`]: all of this for the nodes and topics of a graph | `kit.rs` | [`Kit`](ratelab::Kit) |
//! | a node on its own | `nodes/own.rs`, on a `task.rs` | [`Scheduler`](ratelab::Scheduler) |
//! | the nodes of an [`Executor`] | `executors/ordered.rs`, in the order of `windows.rs`, `events.rs` or `preemptive.rs` | [`Scheduler`](ratelab::Scheduler), [`Dispatch`](ratelab::Dispatch) |
//! | which messages make a set: a [`Match`] | `triggers/trigger.rs`, by `matcher.rs` and `approximate.rs` | [`Matching`](ratelab::Matching) |
//! | a [`Link`] | `links/channel.rs` | [`Channel`](ratelab::Channel) |
//! | the values of knobs as text | `spec.rs`: [`Cost`], [`Draw`], [`Overrun`], [`Link`], [`ClockError`] | |
//!
//! Stands on `ratelab`, the core, only. Begin with `nodes/own.rs`. No schedule owns a node or waits
//! for anything, so the same one serves both clocks.
//!
//! # Another executor
//!
//! 1. A file in `executors/` like `events.rs`, the shortest: a type with the trait `CallbackOrder`
//!    of `ordered.rs`. It hears which timers are due and which messages arrived, and names the callback that is
//!    called next. Nothing else: threads, triggers, costs, faults and both clocks are common to all.
//! 2. A row in the table `KINDS` of `executor.rs`: the name that graph files have it by, its
//!    threads under the real clock, and the function that makes its order.
//!
//! # Another kind of loss or delay on a link
//!
//! 1. A field of [`Link`], and a row in the table `PARTS` of `links/link.rs`: its name, and its
//!    value from and to text.
//! 2. What it does to a message: `deliver_at` in `channel.rs`. A random duration of another
//!    distribution is a [`Draw`] instead: links and costs have it at once.

#![warn(clippy::print_stderr, clippy::print_stdout)]

mod chance;
mod cost;
mod digest;
mod draw;
mod executors;
mod kit;
mod links;
mod local_clock;
mod nodes;
mod overrun;
mod spec;
mod triggers;

pub use chance::{Chance, normal_quantile};
pub use cost::Cost;
pub use digest::Digest;
pub use draw::{Draw, Measurements};
pub use executors::{
    callback::Callback,
    dispatch::Executors,
    executor::{Executor, ExecutorKind},
};
pub use kit::Effects;
pub use links::link::{Burst, Link};
pub use local_clock::ClockError;
pub use overrun::Overrun;
pub use spec::{checked, draw, knob, takes_time};
pub use triggers::{
    matcher::Matcher,
    matching::{Choice, Match},
};
