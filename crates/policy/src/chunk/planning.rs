//! What the plans of a policy are, as data.

use std::time::Duration;

use ratelab::{Head, Knob};
use ratelab_metrics::Fields;
use ratelab_system::{ActionPlan, Planning, PlayStep, Spoiler};

use super::{
    ActionShape, CHUNK, Chunk, ChunkSettings, Horizon, PLAYER, PLAYER_STEP, POLICY, PlayerStep,
};

/// Averaged plans are old ones.
pub const MERGED: Spoiler = Spoiler {
    node: PLAYER,
    name: "merge",
    usual: "newest",
    sound: "newest",
    told: "merge {} averages old plans",
};

/// A plan is for the robot as it will be.
pub const PLANNED: Spoiler = Spoiler {
    node: POLICY,
    name: "plan",
    usual: "rollout",
    sound: "committed",
    told: "the policy's {} plans miss what is played meanwhile",
};

/// An action is for its time.
pub const PLAYED: Spoiler = Spoiler {
    node: PLAYER,
    name: "play",
    usual: "time",
    sound: "time",
    told: "play {} plays late what was meant for now",
};

impl ActionShape {
    /// Returns how the plans of a policy are read, and of the first numbers of actions on the topic
    /// `played` the greatest one.
    pub const fn planning(
        self,
        (played, most): (&'static str, f64),
        spoilers: &'static [Spoiler],
    ) -> Planning {
        Planning {
            plans: CHUNK,
            plan,
            steps: PLAYER_STEP,
            step,
            played,
            action: |row| match row {
                [first, ..] => *first,
                [] => f64::NAN,
            },
            most,
            width: self.width,
            period: self.period,
            longer,
            expecting,
            spoilers,
        }
    }
}

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

fn plan(planning: &Planning, head: &Head, row: &[f64]) -> Option<ActionPlan> {
    let chunk = Chunk::from_row(row)?;
    let actions = chunk.actions.iter().step_by(planning.width.max(1));
    Some(ActionPlan {
        kind: chunk.plan.into(),
        made: chunk.made,
        expected: chunk.expected,
        begins: head.origin?,
        period: planning.period,
        actions: actions.map(|action| f64::from(*action)).collect(),
    })
}

fn step(planning: &Planning, row: &[f64]) -> Option<PlayStep> {
    let step = PlayerStep::from_row(row)?;
    let predicted = Duration::from_nanos(step.predicted as u64);
    Some(PlayStep {
        newest: step.chunk as u64,
        took: step.taken > 0.0,
        stalls: step.stalls > 0.0,
        period: planning.period,
        predicted: (step.played > 0.0).then_some(predicted),
    })
}
