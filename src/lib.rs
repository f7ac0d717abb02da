//! The three primitives of robot software, and two clocks to run them.
//!
//! Real robot software is not one loop. It is a graph of concurrent nodes, each at its
//! own fixed rate, that never call each other: a camera cannot stop producing frames
//! because a later node is busy. Three ideas suffice for this structure, and all are
//! independent of the robot.
//!
//! * A [`Topic`] is a named bus. Publishers put messages in, subscriptions read the
//!   *latest* one out, neither knows the other. It is bounded and counts every message
//!   that is lost unread: this count shows that one node falls behind another.
//! * A [`Rate`] is a promise: tick *k* is due at `anchor + k / f`, exactly.
//! * A [`Node`] is work tied to a rate, and a [`Graph`] is nodes wired to
//!   topics.
//!
//! A graph runs under either [`Clock`]:
//!
//! | | the real clock, of `crates/real-clock` | [`VirtualClock`] |
//! |---|---|---|
//! | threads | one per node or executor | one for all |
//! | time | wall time | the schedule's own |
//! | order of nodes due together | up to the operating system | by priority, or as their executor has it |
//! | late ticks | measured; missed periods skipped and counted | only where configured |
//! | duration of ticks | measured, or as configured | as configured |
//! | the same run again | from its [`Journal`](journal::Journal), to the bit | to the bit |
//!
//! A running graph is changed by [`Command`]s alone, and seen by its records: whatever is measured
//! or copied of a run, a [`Sink`] makes of them.
//!
//! This crate knows no robot, terminal, file or network: other crates add them.
//!
//! # To read it
//!
//! From the ground up, where each imports only earlier ones: `time`, `qos`, `millis`, `sync`;
//! `rate`, `record`, `arrival`; `journal`, `shared`; `settings`; `control`; `topic`; `trigger`;
//! `node`; `scheduling`; `graph`; `clock`.
//!
//! | | files | so that you know |
//! |---|---|---|
//! | first | `time.rs`, `rate.rs`, `node/mod.rs`; `topic/` but for `link_channel.rs` and `intake.rs`; `graph/mod.rs` to the end of `Graph::add`, and `graph/wiring.rs` | the three primitives, how they are wired, the way of a message |
//! | then | `node/job.rs`; `scheduling/timetable.rs`, `own.rs`, `task.rs`, `task_set.rs`, `agenda.rs` and `schedule.rs` there; `node/slot.rs`, `node/tick.rs`, `clock/virtual_time.rs`, `record.rs` | a run, and what it leaves |
//! | for costs and clocks | `settings/draw.rs`, `chance.rs`, `release.rs`, `local_clock.rs` there | what ticks take, and when they are due |
//! | for links | `settings/link.rs`, `topic/link_channel.rs` | what is between a publisher and its readers |
//! | for triggers | `arrival.rs`, `settings/release.rs`, `topic/intake.rs`, `trigger/`, `graph/new_node.rs` | how messages have a node tick |
//! | for commands | `control/`, then `clock/obey.rs`, `graph/control.rs`, `scheduling/node_knobs.rs` | how a run is changed, who carries a command out, and what is logged of it |
//! | for executors | `scheduling/executors/`, `graph/executors.rs` | how several nodes share threads, and in which order |
//! | for threads | `clock/task_sets.rs`, `clock/worker.rs`, then `crates/real-clock` | the same schedule under another clock |
//! | for re-execution | `shared.rs`, `journal/`, then `crates/re-execution` | what must be known to run threads again |
//!
//! # What to change
//!
//! Three parts are given to a graph from outside, each through a trait: a [`Node`], a [`Sink`] of
//! records, and a [`Clock`] with its [`Journal`](journal::Journal). All else is a file here:
//!
//! | for another | change | as in |
//! |---|---|---|
//! | view of a run: figures, copies of messages | a [`Sink`] | `crates/metrics` |
//! | clock | a [`Clock`]: it takes the [`TaskSets`](clock::TaskSets) of a graph, and [`Wake`](clock::Wake) hears of arrivals | `crates/real-clock`, `crates/re-execution` |
//! | loss or delay of a link (no duplicates) | a row of `PARTS` in `settings/link.rs` with a field of `Link`, and `LinkChannel` in `topic/link_channel.rs`: what is lost in `time_lost`, when the rest arrives in `deliver_at` | `burst` there |
//! | distribution of durations | `settings/draw.rs`: costs and lateness have it at once, links too unless it needs a file | `Uniform` there |
//! | order of callbacks in an executor | a file in `scheduling/executors/`, named in `mod.rs` there, and a row of `KINDS` in `executor.rs` there | `events.rs` |
//! | rule for messages of several topics | `settings/release.rs` for its text, `trigger/mod.rs` for the rule | `Stamped` there |
//! | setting or fault of a node or topic | a row of the table in `control/knob.rs`, and whoever obeys it: `scheduling/task.rs`, or `topic/mod.rs`. A value of a new type needs a place in `settings/` and `control/knob_part.rs`; a fault that keeps a node from ticking also `scheduling/own.rs` and `executors/ordered.rs` | `hang`, `wakes`, `crash` |
//!
//! # How a run goes
//!
//! Each node belongs to a *task set*: alone, or with the other nodes of its executor. The scheduler
//! of a task set hears of events, asks a timetable for alarms, and names the next job of a node. A
//! *schedule* keeps the alarms of its task sets in order. In virtual time one schedule has all task
//! sets, and time jumps from alarm to alarm; under the real clock each task set has a schedule of
//! its own, and its threads wait for the wall. Nodes work outside of the schedule, and what they
//! publish comes back to it as arrivals.
//!
//! A message: [`Tick::publish`] gives it to its topic, or keeps it until a tick is over that takes
//! time. With a link it is in transit until it arrives: the next use of the topic first moves what
//! has arrived into the queue, each message with its own time of arrival. The queue evicts what is
//! beyond its depth; [`Tick::read`] reads it. The topic sends a record of each step to the
//! [`Sink`].
//!
//! # A graph in twenty lines
//!
//! ```
//! use ratelab::{Flow, Graph, Tick};
//!
//! let mut graph = Graph::new();
//! let range = graph.topic("/range");
//! graph.node("sonar", 10.0, 0, |wiring| {
//!     let range = wiring.publisher(&range);
//!     move |tick: &mut Tick| tick.publish(&range, 2.0 - tick.now().as_secs_f64())
//! })?;
//! graph.node("brake", 2.0, 1, |wiring| {
//!     let mut range = wiring.subscription(&range);
//!     move |tick: &mut Tick| match tick.read(&mut range) {
//!         Some(message) if message.data < 1.0 => {
//!             println!("{} messages too many", range.dropped()); // 12
//!             Flow::End
//!         }
//!         _ => Flow::Continue,
//!     }
//! })?;
//!
//! let exit = graph.run_virtual(10.0)?;
//! println!("{exit:?}"); // Ended { node: "brake", at: 1.5 s }
//! assert_eq!(range.published(), 16);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![warn(clippy::print_stderr, clippy::print_stdout)]

mod arrival;
pub mod clock;
mod control;
mod graph;
pub mod journal;
pub mod millis;
mod node;
mod qos;
mod rate;
mod record;
mod scheduling;
mod settings;
mod shared;
pub mod sync;
mod time;
mod topic;
mod trigger;

pub use clock::{Clock, ClockExit, RunError, VirtualClock, run};
pub use control::{
    command::{ClockKind, Command, KnobRefusal, Pace, Speed, SpeedError, TimedCommand},
    inbox::{Inbox, Interrupt},
    knob::{Knob, KnobError, KnobKind, TickTiming, TimedKnob},
    state::{Event, EventKind, RunState, Status},
};
pub use graph::{
    Graph, GraphError, NodeTopology, RealClockRefusal, TopicTopology, Topology, Wiring,
};
pub use node::{
    Fault, Flow, IntoTickResult, LastTick, Node, NodeCrash, NodeError, Panicked, Tick, TickResult,
};
pub use qos::{Depth, DepthError, ReadOrder, ReadOrderError};
pub use rate::{Rate, hyper_period};
pub use record::{
    Derived, Head, MessageId, MeterRecorder, NodeRecord, Push, Sink, TickId, TickTimes, TopicRecord,
};
pub use scheduling::executors::{
    executor::{Executor, ExecutorError, ExecutorKind},
    ordered::Callback,
};
pub use settings::{
    chance::Chance,
    digest::{Digest, DigestError},
    draw::{Cost, Draw, Measurements},
    error::{SettingError, alternatives},
    link::{Burst, Link, LinkError},
    local_clock::ClockError,
    release::{Match, Overrun, Release},
};
pub use shared::{Shared, SharedGuard};
pub use time::{Hz, HzError, Time, TimeError, TimeSpan};
pub use topic::{Cause, ForwardedTimes, Message, Payload, Publisher, Subscription, Topic};
