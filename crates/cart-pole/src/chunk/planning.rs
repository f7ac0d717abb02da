//! What a plan of the cart-pole is, as data.

use std::time::Duration;

use ratelab::{Head, Knob};
use ratelab_metrics::Fields;
use ratelab_policy::chunk::{
    CHUNK, Chunk, ChunkSettings, Horizon, PLAYER, PLAYER_STEP, PlayerStep,
};
use ratelab_system::{ActionPlan, Planning, PlayStep, Spoiler};

use super::{ACTION_PERIOD, MODEL};
use crate::{ACTION, ACTUATOR, DISTURB, POLICY};

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
    expecting,
    spoilers: SPOILERS,
};

/// What makes plans wrong, whatever the delay.
const SPOILERS: &[Spoiler] = &[
    Spoiler {
        node: PLAYER,
        name: "merge",
        usual: "newest",
        sound: "newest",
        told: "merge {} averages old plans",
    },
    Spoiler {
        node: POLICY,
        name: "plan",
        usual: "rollout",
        sound: "committed",
        told: "the policy's {} plans miss what is played meanwhile",
    },
    Spoiler {
        node: PLAYER,
        name: "play",
        usual: "time",
        sound: "time",
        told: "play {} plays late what was meant for now",
    },
    Spoiler {
        node: POLICY,
        name: MODEL,
        usual: "length:1",
        sound: "length:1",
        told: "the policy predicts wrongly: its model of the plant is {}",
    },
    Spoiler {
        node: ACTUATOR,
        name: DISTURB,
        usual: "0",
        sound: "0",
        told: "the plant is disturbed: at random, by {} N",
    },
];

/// Returns the knob for chunks of at least `needed` actions, in tens.
fn longer(needed: usize) -> Knob {
    let actions = needed.next_multiple_of(10).min(Horizon::MAX);
    policy_knob(ChunkSettings::CHUNK, actions.to_string())
}

/// Returns the knob for chunks that are expected after this delay, to the millisecond.
fn expecting(delay: Duration) -> Knob {
    policy_knob("expect-delay", delay.as_millis().to_string())
}

fn policy_knob(name: &str, value: String) -> Knob {
    Knob::Parameter {
        node: POLICY.to_owned(),
        name: name.to_owned(),
        value,
    }
}

fn plan(head: &Head, row: &[f64]) -> Option<ActionPlan> {
    let chunk = Chunk::from_row(row)?;
    let actions = chunk.actions.iter();
    Some(ActionPlan {
        kind: chunk.plan.into(),
        made: chunk.made,
        expected: chunk.expected,
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
        period: ACTION_PERIOD,
        predicted: (step.played > 0.0).then_some(predicted),
    })
}
