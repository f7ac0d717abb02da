//! How chunks and their playing are read from messages.

use std::time::Duration;

use ratelab::{Head, Knob};
use ratelab_account::Fields;
use ratelab_study::system::{ActionPlan, Planning, PlayStep};

use super::{
    ACTION_PERIOD,
    message::{CHUNK, Chunk, PLAYER_STEP, PlayerStep},
    settings::{ChunkSettings, Horizon, PlanKind},
};
use crate::{ACTION, POLICY};

/// The plans of a policy that answers with chunks.
pub(crate) const PLANNING: Planning = Planning {
    plans: CHUNK,
    plan,
    steps: PLAYER_STEP,
    step,
    played: ACTION,
    action: |row| row.first().copied().unwrap_or(f64::NAN),
    most: 1.0,
    longer,
    knowing: "set policy plan committed",
};

/// The knob for chunks of at least `needed` actions, in tens.
fn longer(needed: usize) -> Knob {
    Knob::Parameter {
        node: POLICY.to_owned(),
        name: ChunkSettings::CHUNK.to_owned(),
        value: needed.next_multiple_of(10).min(Horizon::MOST).to_string(),
    }
}

fn plan(head: &Head, row: &[f64]) -> Option<ActionPlan> {
    let chunk = Chunk::from_row(row)?;
    let actions = chunk.actions.iter();
    Some(ActionPlan {
        kind: chunk.plan.name(),
        knows: chunk.plan == PlanKind::Committed,
        begins: head.origin?,
        period: ACTION_PERIOD,
        actions: actions.map(|action| f64::from(*action)).collect(),
    })
}

fn step(row: &[f64]) -> Option<PlayStep> {
    let step = PlayerStep::from_row(row)?;
    let predicted = Duration::from_nanos(step.predicted as u64);
    Some(PlayStep {
        newest: step.chunk as u64,
        took: step.taken > 0.0,
        stalls: step.stalls > 0.0,
        predicted: (step.played > 0.0).then_some(predicted),
    })
}
