//! Plans chunks of actions: the node, how it decides, and what it plans by.

use std::{collections::VecDeque, sync::Arc, time::Duration};

use ratelab::{
    Flow, Head, Knob, LastTick, Node, NodeCrash, NodeError, Publisher, Subscription, Tick,
    TickResult, Time,
};
use ratelab_metrics::Fields;
use ratelab_system::{ActionPlan, Planning, PlayStep, Spoiler};

use super::{
    ACTION_PERIOD, PLAYER,
    message::{CHUNK, Chunk, PLAYER_STEP, PlayerStep, Request},
    settings::{ChunkSettings, ExpectedDelay, Horizon, PlanKind, replace},
};
use crate::{
    ACTION, ACTUATOR, Action, DISTURB, NotFinite, Observation, POLICY, PlantError,
    body::Body,
    policy::{Moment, Policy},
};

/// How far before a reading its chunks are kept, for readings that are older than the one
/// before.
const MARGIN: Duration = Duration::from_secs(1);

/// Plans chunks by a model, and remembers the chunks that are not played yet.
pub struct ChunkPlanner {
    pub(super) settings: ChunkSettings,
    /// The settings at its setup.
    first: ChunkSettings,
    /// A cart-pole of the policy's own.
    model: Body,
    /// Its chunks, the newest last.
    own: VecDeque<OwnChunk>,
    last: Duration,
    longest: Duration,
}

struct OwnChunk {
    origin: Time,
    /// From when on it is expected to be played.
    from: Time,
    actions: Arc<[f32]>,
}

impl OwnChunk {
    /// Returns its action for run time `at`: after its end the last one, before its start none.
    fn action(&self, at: Time) -> f32 {
        if at < self.origin {
            return 0.0;
        }
        let index = (at.since(self.origin).as_nanos() / ACTION_PERIOD.as_nanos()) as usize;
        let action = self.actions.get(index).or(self.actions.last());
        action.copied().unwrap_or_default()
    }
}

impl ChunkPlanner {
    /// Creates a planner without a chunk so far.
    ///
    /// # Errors
    /// [`PlantError`] if MuJoCo refuses its model.
    pub fn new(settings: &ChunkSettings) -> Result<Self, PlantError> {
        Ok(Self {
            settings: *settings,
            first: *settings,
            model: Body::model(settings.model.length)?,
            own: VecDeque::new(),
            last: Duration::ZERO,
            longest: Duration::ZERO,
        })
    }

    /// Hears how long the policy's last tick took.
    pub fn took(&mut self, duration: Duration) {
        self.last = duration;
        self.longest = self.longest.max(duration);
    }

    /// Begins anew: without a chunk or a duration, and as it was set up.
    pub fn restart(&mut self) {
        self.own.clear();
        (self.last, self.longest) = (Duration::ZERO, Duration::ZERO);
        self.settings = self.first;
    }

    /// Plans for a `reading` of run time `origin`, in a tick that starts at `now`.
    pub fn chunk(
        &mut self,
        policy: &mut dyn Policy,
        reading: &Observation,
        origin: Time,
        now: Time,
    ) -> Chunk {
        let expected = match self.settings.expected {
            ExpectedDelay::Constant(delay) => delay,
            ExpectedDelay::Last(margin) => self.last + margin,
            ExpectedDelay::Max(margin) => self.longest + margin,
        };
        let from = now + expected;
        policy.begin(Moment {
            origin,
            now,
            expected,
        });
        let actions: Arc<[f32]> = match (policy.whole_chunk(reading), self.settings.plan) {
            (Some(actions), _) => actions,
            (None, PlanKind::Hold) => {
                std::iter::repeat_n(policy.act(reading).0, self.settings.horizon.get()).collect()
            }
            (None, PlanKind::Rollout) => self.rollout(policy, reading, origin, origin),
            (None, PlanKind::Committed) => self.rollout(policy, reading, origin, from),
        };
        let chunk = Chunk {
            made: now,
            expected,
            plan: self.settings.plan,
            actions: actions.clone(),
        };
        self.remember(OwnChunk {
            origin,
            from,
            actions,
        });
        chunk
    }

    /// Returns the actions for the states that the model comes to; before run time `from` the
    /// committed actions. A policy that answers with chunks is asked for one, for the state at
    /// `from`.
    fn rollout(
        &mut self,
        policy: &mut dyn Policy,
        reading: &Observation,
        origin: Time,
        from: Time,
    ) -> Arc<[f32]> {
        self.model.place(reading);
        let horizon = self.settings.horizon.get();
        let (mut at, mut actions) = (origin, Vec::with_capacity(horizon));
        while actions.len() < horizon {
            let action = if at < from {
                Action(self.committed(at))
            } else {
                let state = self.model.observation;
                if let Some(chunk) = policy.chunk_from(&state).filter(|chunk| !chunk.is_empty()) {
                    actions.extend(chunk);
                    break;
                }
                policy.act(&state)
            };
            self.model.control_step(action);
            at = at + ACTION_PERIOD;
            actions.push(action.0);
        }
        let last = actions.last().copied().unwrap_or_default();
        actions.resize(horizon, last);
        actions.into()
    }

    /// Returns the action to be played at run time `at`, as far as the policy knows: that of its
    /// newest chunk which is played by then, or none.
    fn committed(&self, at: Time) -> f32 {
        let newest = self.own.iter().rev().find(|chunk| chunk.from <= at);
        newest.map_or(0.0, |chunk| chunk.action(at))
    }

    /// Keeps a chunk, and forgets the chunks that are too old for any plan.
    fn remember(&mut self, chunk: OwnChunk) {
        let since = chunk.origin - MARGIN;
        self.own.push_back(chunk);
        let newest = self.own.iter().rposition(|chunk| chunk.from <= since);
        self.own.drain(..newest.unwrap_or(0));
    }
}

/// Plans a chunk for the newest observation, with a policy that knows nothing of chunks.
pub struct ChunkPolicy {
    /// The policy.
    pub policy: Box<dyn Policy>,
    /// What it plans.
    pub planner: ChunkPlanner,
    /// How long its ticks take.
    pub last_tick: LastTick,
    /// Subscription to `/obs`.
    pub observations: Subscription<Observation>,
    /// Publisher of `/chunk`.
    pub chunks: Publisher<Chunk>,
    /// The requests that it ticks on, if it does not tick at a rate.
    pub requests: Option<Subscription<Request>>,
}

impl Node for ChunkPolicy {
    fn tick(&mut self, tick: &mut Tick) -> TickResult {
        if let Some(took) = self.last_tick.take() {
            self.planner.took(took);
        }
        if let Some(requests) = &mut self.requests {
            tick.read(requests);
        }
        let Some(sensed) = tick.read(&mut self.observations) else {
            return Ok(Flow::Continue); // No reading yet.
        };
        let (policy, origin) = (&mut *self.policy, sensed.sensed());
        let chunk = self.planner.chunk(policy, &sensed.data, origin, tick.now());
        if let Some(why) = self.policy.crash() {
            return Err(NodeCrash(why).into());
        }
        let finite = chunk.actions.iter().find(|action| !action.is_finite());
        if let Some(action) = finite {
            return Err(NotFinite::new(self.policy.name(), Action(*action), sensed.data).into());
        }
        tick.publish_from(&self.chunks, chunk, &sensed);
        Ok(Flow::Continue)
    }

    /// Replaces the policy by the named one, if it supports that.
    fn on_order(&mut self, text: &str) -> Result<String, NodeError> {
        Ok(self.policy.swap(text)?)
    }

    fn set_parameter(&mut self, name: &str, value: &str, _: Time) -> Result<String, NodeError> {
        match name {
            "plan" => Ok(replace(&mut self.planner.settings.plan, value)?),
            "expect-delay" => Ok(replace(&mut self.planner.settings.expected, value)?),
            _ => Err(format!("{name} is a setting of the whole run").into()),
        }
    }

    fn restart(&mut self) -> Result<(), NodeError> {
        self.planner.restart();
        self.last_tick.take();
        Ok(self.policy.restart()?)
    }
}

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

/// The settings of chunks that count for a whole run.
pub(crate) const FIXED: &[[&str; 2]] = &[
    [POLICY, ChunkSettings::CHUNK],
    [POLICY, "model"],
    [PLAYER, "refill"],
];

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
        name: "model",
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
