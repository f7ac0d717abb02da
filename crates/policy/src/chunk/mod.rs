//! Policies that answer with a chunk: the next actions of the robot.
//!
//! ```text
//! sensor ──/obs──► policy ──/chunk──► player ──/action──► actuator
//! ```
//!
//! Action i of a chunk with origin o, the time of the reading behind it, is meant for run
//! times in \[o + iΔ, o + (i + 1)Δ), Δ the period of the robot's actions ([`ActionShape`]). The
//! [`ChunkPolicy`] plans by a model of the plant, which knows of the actions that are still to be played
//! or does not ([`PlanKind`]); the [`Player`] decides which action belongs to now ([`PlayKind`]), and
//! what happens where two chunks overlap ([`Merge`]). What that came to is in its [`PlayerStep`]s. A
//! policy that ticks on request (`ChunkSettings::refill`) is triggered by the player's messages on
//! `/request`.

pub mod aliases;
mod error;
mod message;
mod planner;
pub mod planning;
mod player;
mod queue;
mod settings;
mod warnings;
mod wiring;

pub use self::{
    error::ChunkError,
    message::{CHUNK, Chunk, PLAYER_STEP, PlayerStep, REQUEST, Request},
    planner::{ChunkPlanner, ChunkPolicy, PlanModel, PlannedPolicy},
    player::{ChunkTally, PlayedAction, Player},
    settings::{
        ActionShape, ChunkSettings, ExpectedDelay, Horizon, Merge, PlanKind, PlayKind, Shortest,
    },
    warnings::ChunkLoop,
    wiring::ChunkNodes,
};

/// Name of the node that plays chunks.
pub const PLAYER: &str = "player";

/// Name of the node that plans them.
const POLICY: &str = "policy";

/// Name of the topic of its readings.
const OBS: &str = "/obs";
