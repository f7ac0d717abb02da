//! What the messages and ticks of a run say.
//!
//! A fold over what was published and done, live from taps, from a recording or from the network:
//! [`Lineage`] finds the readings behind every action, and the parts of its age.
//!
//! Stands on the core (`ratelab`) only; a run knows nothing of it. Begin with
//! [`Lineage::message`], [`Lineage::tick`] and [`Lineage::settle`].

mod lineage;

pub use lineage::{
    AgePart, AgeParts, AgeStage, Chain, Lineage, Occupied, PushInForce, Sent, TracedTick, Unmatched,
};
