//! Recordings of other systems: what their times say of nodes, topics and ages.
//!
//! A [`Bag`] is read from MCAP or a table of events, without its payloads but for header stamps; an
//! [`Analysis`] of it finds clocks, losses, which topic a node reads, what triggers it, and how old
//! its data are. Stands on no other crate. Begin with `bag.rs`, then `analysis.rs`.

mod ages;
mod analysis;
mod bag;
mod clocks;
mod edges;
mod figures;
mod guesses;
mod losses;
mod node;
mod numbers;
mod parallel;
mod pauses;
mod period;
mod read;
mod stamps;
mod threads;
mod timed;
mod triggered;

pub use ages::Ages;
pub use analysis::{Analysis, BagChain};
pub use bag::{Bag, BagMessage, BagTopic, Damage, NO_STAMP, PublishTime};
pub use clocks::{ClockGroup, Clocks, Mapping, TopicClock};
pub use edges::NamedEdge;
pub use figures::{Gap, GapVerdict, TimeQuantiles, TopicFigures};
pub use guesses::Guess;
pub use node::{BagNode, InputOfNode, Kind, NodeSearch};
pub use numbers::quantile;
pub use pauses::Pause;
pub use period::EventPeriod;
pub use read::{BagError, Watch, read};
pub use stamps::{Relations, TopicEvents};
pub use timed::{Timed, TimerRun};
pub use triggered::{Triggered, TriggeredStep};
