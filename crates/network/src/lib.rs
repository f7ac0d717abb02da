//! Topics, commands and reports of a running graph between processes and machines.
//!
//! ```text
//! node ──► topic ──► outlet ──► network ──► inlet ──► topic ──► node      messages
//! taps, events, counters ──► reporter ──► network ──► follower            reports
//! graph ◄── command ◄── network ◄── follower                              commands
//! ```
//!
//! Stands on `ratelab`, `ratelab-metrics`, `ratelab-experiment`, `ratelab-system`,
//! `ratelab-recording` and `ratelab-screen`; the transport is zenoh's. Times, losses and refusals are
//! here, and most of it works without a network. Begin with [`Bridge`], the end of a process, and
//! [`Follower`], the end of a dashboard, which shows a [`RemoteRun`]; then [`key`] for the names on
//! the wire and [`packet`] for the bytes of a message.

#![warn(clippy::print_stderr, clippy::print_stdout)]

mod bridge;
mod command;
mod error;
mod follower;
mod inlet;
mod join;
pub mod key;
pub mod machine;
mod net;
mod outlet;
pub mod packet;
mod part;
pub mod parts;
mod peers;
mod remote;
mod reporter;
mod ros;
pub mod sender;
mod session;
pub mod telemetry;
mod times;
mod watch;

pub use bridge::Bridge;
pub use error::NetworkError;
pub use follower::Follower;
pub use inlet::Inlet;
pub use remote::{Recordings, RemoteRun, StartCommands};
pub use sender::{Refusal, Refused};
pub use session::{SessionEnd, Settings, USUAL};
pub use times::Times;
