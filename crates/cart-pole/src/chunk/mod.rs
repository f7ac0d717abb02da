//! Policies that answer with a chunk: the next actions of the robot.
//!
//! ```text
//! sensor ──/obs──► policy ──/chunk──► player ──/action──► actuator
//! ```
//!
//! Action i of a chunk with origin o, the time of the reading behind it, is meant for run
//! times in \[o + iΔ, o + (i + 1)Δ), Δ = 20 ms. The `ChunkPolicy` plans by a model of the
//! plant, which knows of the actions that are still to be played or does not ([`PlanKind`]);
//! the `Player` decides which action belongs to now (`PlayKind`), and what happens where
//! two chunks overlap (`Merge`). What that came to is in its `PlayerStep`s. A policy
//! that ticks on request (`ChunkSettings::refill`) is triggered by the player's messages on `/request`.

mod message;
mod planner;
mod player;
mod queue;
mod settings;
mod warnings;

use std::time::Duration;

pub use self::{
    message::{CHUNK, Chunk},
    settings::PlanKind,
};
pub(crate) use self::{
    message::{PLAYER_STEP, REQUEST},
    planner::ChunkPlanner,
    player::Player,
    settings::{ChunkSettings, ExpectedDelay, Merge, PlayKind},
    warnings::warnings,
};
pub(crate) use planner::{ChunkPolicy, FIXED, PLANNING};
pub(crate) use player::ChunkTally;

/// Name of the node that plays chunks.
pub(crate) const PLAYER: &str = "player";

/// Δ: the time that an action is meant for.
pub(crate) const ACTION_PERIOD: Duration = Duration::from_millis(20);
