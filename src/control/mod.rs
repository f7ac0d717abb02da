//! How a run is changed while it goes on, and what is known of it: commands go in, events are
//! logged.

pub mod command;
pub mod inbox;
pub mod knob;
mod knob_part;
pub mod state;
