//! Topics, commands and counters of a running graph between processes and machines.
//!
//! A [`Bridge`] connects the part of a graph that runs in this process with the others. It
//! copies the messages of a topic with a remote reader, and publishes those that arrive into
//! the local topic, where the newest wins as ever. The core, on which this stands, knows nothing
//! of it. The transport is zenoh's; everything about times, losses and refusals is here, and most
//! of it works without a network.
//!
//! Begin with [`Bridge`]; an [`Inlet`] and the outlets beside it carry single topics.

mod bridge;
pub mod clock;
mod command;
mod connect;
mod error;
mod follower;
mod inlet;
mod join;
pub mod key;
mod machine;
pub mod offset;
mod origins;
mod outlet;
pub mod packet;
mod peers;
mod refusal;
mod reporter;
mod ros;
pub mod sender;
mod session;
pub mod telemetry;
mod times;
mod watch;

pub use bridge::{Bridge, SILENT_PERIODS};
pub use command::{Answer, Order};
pub use error::WireError;
pub use follower::Follower;
pub use inlet::Inlet;
pub use machine::host;
pub use peers::Peers;
pub use refusal::{Refusal, Refused};
pub use session::{SessionEnd, Settings, USUAL};
pub use times::Times;

/// A random number, for names that are used once.
pub fn random() -> u64 {
    use std::{
        collections::hash_map::RandomState,
        hash::{BuildHasher, Hasher},
        process,
    };
    // The standard library seeds each of these from the system's random numbers.
    let mut hasher = RandomState::new().build_hasher();
    hasher.write_i64(clock::now());
    hasher.write_u32(process::id());
    hasher.finish()
}
