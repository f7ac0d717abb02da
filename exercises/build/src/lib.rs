//! Exercise 11: build it.
//!
//! Three types are empty: [`Topic`] in `src/topic.rs`, [`Rate`] in `src/rate.rs` and
//! [`Node`] in `src/node.rs`. Write them; each has its promises in its comments and its
//! tests in `tests/`. [`Message`], the clock and the cart-pole on top are there. In this
//! order:
//!
//! ```sh
//! cargo test -p build-it --test topic
//! cargo test -p build-it --test rate
//! cargo test -p build-it --test node
//! cargo test -p build-it --test cartpole
//! ```
//!
//! The last one runs the cart-pole of the lab on your types and compares every message, tick
//! and byte with a run of the lab. `cargo run -p build-it -- 5` prints such a run, at 5 Hz;
//! `cargo run -p build-it --features lab -- 5` plays it in the lab, and compares it as well.

pub mod cartpole;
pub mod clock;
mod message;
#[cfg_attr(feature = "solved", path = "../../answers/build/node.rs")]
mod node;
#[cfg_attr(feature = "solved", path = "../../answers/build/rate.rs")]
mod rate;
#[cfg_attr(feature = "solved", path = "../../answers/build/topic.rs")]
mod topic;

pub use message::Message;
pub use node::Node;
pub use rate::Rate;
pub use topic::Topic;
