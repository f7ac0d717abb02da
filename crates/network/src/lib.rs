//! Topics, commands and reports of a running graph between processes and machines.
//!
//! ```text
//! node ──► topic ──► outlet ──► network ──► inlet ──► topic ──► node      messages
//! taps, events, counters ──► reporter ──► network ──► follower            reports
//! graph ◄── command ◄── network ◄── follower                              commands
//! ```
//!
//! Stands on `ratelab`, `ratelab-metrics`, `ratelab-experiment` and `ratelab-system`; the transport is
//! zenoh's. All about times, losses and refusals is here, and most of it works without a network.
//! Begin with [`Bridge`], the end of a process, and [`Follower`], that of a dashboard; then [`key`] for the names on the wire and [`packet`] for the bytes of a message.

#![warn(clippy::print_stderr, clippy::print_stdout)]

mod bridge;
mod command;
mod connect;
mod error;
mod follower;
mod inlet;
mod join;
pub mod key;
pub mod machine;
mod net;
pub mod offset;
mod outlet;
pub mod packet;
mod part;
mod part_end;
mod peers;
mod recent;
mod refusal;
mod reporter;
mod ros;
pub mod sender;
mod session;
pub mod telemetry;
mod threads;
mod times;
mod watch;

pub use bridge::Bridge;
pub use error::NetworkError;
pub use follower::Follower;
pub use inlet::Inlet;
pub use refusal::{Refusal, Refused};
pub use session::{SessionEnd, Settings, USUAL};
pub use times::Times;
