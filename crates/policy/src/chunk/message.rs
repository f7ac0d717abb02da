//! The messages of a policy that answers with chunks, and of what plays them.

use std::{sync::Arc, time::Duration};

use ratelab::Time;
use ratelab_metrics::{Fields, fields};
use strum::VariantArray;

use super::settings::PlanKind;

/// Name of the topic from policy to player.
pub const CHUNK: &str = "/chunk";

/// Name of the topic from player to policy.
pub const REQUEST: &str = "/request";

/// Name of the topic with what the player did.
pub const PLAYER_STEP: &str = "/player";

/// The next actions, the first for the reading that they were derived from.
#[derive(Clone, Debug, PartialEq)]
pub struct Chunk {
    /// Start of the tick that made it.
    pub made: Time,
    /// The delay that the policy planned for.
    pub expected: Duration,
    /// How it was planned.
    pub plan: PlanKind,
    /// The actions, one after the other.
    pub actions: Arc<[f32]>,
}

impl Chunk {
    /// Depth of the topic: it loses none, whatever holds the player up.
    pub const DEPTH: usize = 10_000;

    /// The names of the numbers before its actions.
    pub const HEAD: [&str; 3] = [
        "made (ns)",
        "expected delay (ns)",
        "plan (0 hold, 1 rollout, 2 committed)",
    ];
}

impl Fields for Chunk {
    /// Their number differs from run to run.
    const FIELDS: &'static [&'static str] = &[];

    fn append_to(&self, row: &mut Vec<f64>) {
        row.push(self.made.as_nanos() as f64);
        row.push(self.expected.as_nanos() as f64);
        row.push(f64::from(self.plan as u8));
        row.extend(self.actions.iter().map(|action| f64::from(*action)));
    }

    fn from_row(row: &[f64]) -> Option<Self> {
        let (&[made, expected, plan], actions) = row.split_first_chunk::<{ Self::HEAD.len() }>()?;
        Some(Self {
            made: Time::from_nanos(made as u64),
            expected: Duration::from_nanos(expected as u64),
            plan: *PlanKind::VARIANTS.get(plan as usize)?,
            actions: actions.iter().map(|action| *action as f32).collect(),
        })
    }
}

/// The player asks for a chunk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Request {
    /// Number of actions that are left.
    pub left: f64,
}

fields!(Request {
    left: "actions left"
});

/// What the player did: at the start of a tick what it took, and whether it had an action;
/// at its end what it published. Counts and sums are of this step alone.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlayerStep {
    /// Chunks taken.
    pub taken: f64,
    /// Their delays, less the expected ones (ns): the sum.
    pub delay_errors: f64,
    /// The greatest of these.
    pub most_delay_error: f64,
    /// 1 for a tick without an action.
    pub stalls: f64,
    /// 1 for a published action.
    pub played: f64,
    /// Actions of chunks that went into it for the first time.
    pub used: f64,
    /// The age that the plan of the newest chunk knew of (ns).
    pub predicted: f64,
    /// |action − the one before|; NaN for the first.
    pub change: f64,
    /// 1 if a chunk was taken since the action before.
    pub seam: f64,
    /// Number of the newest chunk, counted from zero.
    pub chunk: f64,
    /// The place in it that is now.
    pub index: f64,
}

fields!(PlayerStep {
    taken: "chunks taken",
    delay_errors: "delay errors (ns)",
    most_delay_error: "greatest delay error (ns)",
    stalls: "stalls",
    played: "actions published",
    used: "actions used first",
    predicted: "predicted age (ns)",
    change: "change of the action",
    seam: "seam",
    chunk: "newest chunk",
    index: "index in it",
});
