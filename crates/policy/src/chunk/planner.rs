//! Plans chunks of actions: the node, how it decides, and what it plans by.

use std::{collections::VecDeque, sync::Arc, time::Duration};

use ratelab::{
    Flow, LastTick, Node, NodeCrash, NodeError, Payload, Publisher, Subscription, Tick, TickResult,
    Time,
};

use super::{
    message::{Chunk, Request},
    settings::{ActionShape, ChunkSettings, ExpectedDelay, PlanKind, replace},
};
use crate::Moment;

/// How far before a reading its chunks are kept, for readings that are older than the one
/// before.
const MARGIN: Duration = Duration::from_secs(1);

/// A robot of the policy's own, by which it plans.
pub trait PlanModel: Send {
    /// What a policy decides on.
    type Reading: Payload;

    /// Places the robot as in a `reading`.
    fn place(&mut self, reading: &Self::Reading);

    /// Returns the reading of a perfect sensor.
    fn reading(&mut self) -> Self::Reading;

    /// Goes on for the time that an action is meant for.
    fn act(&mut self, action: &[f32]);
}

/// A policy that is asked for actions of a plan.
pub trait PlannedPolicy<R>: Send {
    /// Hears of the tick in which it will be asked.
    fn begin(&mut self, moment: Moment);

    /// Returns the action for a reading.
    fn action(&mut self, reading: &R) -> Vec<f32>;

    /// Returns the actions for a reading and the times after it, one after the other, of a policy that
    /// answers with chunks.
    fn chunk_from(&mut self, reading: &R) -> Option<Vec<f32>>;

    /// Returns a whole chunk for a reading, of a policy that has a model of its own.
    fn whole_chunk(&mut self, reading: &R) -> Option<Arc<[f32]>>;

    /// Returns why it has died in this tick, if it has.
    fn crash(&mut self) -> Option<String>;

    /// Returns the error of an answer to a reading that is not finite.
    fn not_finite(&self, answer: f32, reading: &R) -> NodeError;

    /// Replaces it by the policy called `name`; returns the name before.
    ///
    /// # Errors
    /// The reason.
    fn swap(&mut self, name: &str) -> Result<String, NodeError>;

    /// Returns to the initial state.
    ///
    /// # Errors
    /// The reason.
    fn restart(&mut self) -> Result<(), NodeError>;
}

/// Plans chunks by a model, and remembers the chunks that are not played yet.
pub struct ChunkPlanner<M> {
    settings: ChunkSettings,
    /// The settings at its setup.
    first: ChunkSettings,
    model: M,
    /// What is played before the first chunk.
    none: Vec<f32>,
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
    fn action(&self, shape: ActionShape, at: Time) -> Option<&[f32]> {
        if at < self.origin {
            return None;
        }
        let index = (at.since(self.origin).as_nanos() / shape.period.as_nanos()) as usize;
        let mut actions = self.actions.chunks_exact(shape.width);
        let last = actions.len().checked_sub(1)?;
        actions.nth(index.min(last))
    }
}

impl<M: PlanModel> ChunkPlanner<M> {
    /// Creates a planner without a chunk so far, of a robot with the action `none` until then.
    pub fn new(settings: &ChunkSettings, model: M, none: Vec<f32>) -> Self {
        Self {
            none,
            settings: *settings,
            first: *settings,
            model,
            own: VecDeque::new(),
            last: Duration::ZERO,
            longest: Duration::ZERO,
        }
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
        policy: &mut impl PlannedPolicy<M::Reading>,
        reading: &M::Reading,
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
                let action = policy.action(reading);
                action.repeat(self.settings.horizon.get()).into()
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
        policy: &mut impl PlannedPolicy<M::Reading>,
        reading: &M::Reading,
        origin: Time,
        from: Time,
    ) -> Arc<[f32]> {
        self.model.place(reading);
        let shape = self.settings.shape;
        let size = self.settings.horizon.get() * shape.width;
        let (mut at, mut actions) = (origin, Vec::with_capacity(size));
        while actions.len() < size {
            let action = if at < from {
                self.committed(at)
            } else {
                let state = self.model.reading();
                if let Some(chunk) = policy.chunk_from(&state).filter(|chunk| !chunk.is_empty()) {
                    actions.extend(chunk);
                    break;
                }
                policy.action(&state)
            };
            self.model.act(&action);
            at = at + shape.period;
            actions.extend(action);
        }
        // A short chunk ends with its last action, again and again.
        let mut place = actions.len();
        while let Some(before) = place.checked_sub(shape.width).filter(|_| place < size) {
            actions.push(actions[before]);
            place += 1;
        }
        actions.truncate(size);
        actions.into()
    }

    /// Returns the action to be played at run time `at`, as far as the policy knows: that of its
    /// newest chunk which is played by then, or none.
    fn committed(&self, at: Time) -> Vec<f32> {
        let shape = self.settings.shape;
        let newest = self.own.iter().rev().find(|chunk| chunk.from <= at);
        let action = newest.and_then(|chunk| chunk.action(shape, at));
        action.map_or_else(|| self.none.clone(), <[f32]>::to_vec)
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
pub struct ChunkPolicy<M: PlanModel, P> {
    /// The policy.
    pub policy: P,
    /// What it plans.
    pub planner: ChunkPlanner<M>,
    /// How long its ticks take.
    pub last_tick: LastTick,
    /// Subscription to `/obs`.
    pub observations: Subscription<M::Reading>,
    /// Publisher of `/chunk`.
    pub chunks: Publisher<Chunk>,
    /// The requests that it ticks on, if it does not tick at a rate.
    pub requests: Option<Subscription<Request>>,
}

impl<M: PlanModel, P: PlannedPolicy<M::Reading>> Node for ChunkPolicy<M, P> {
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
        let (policy, origin) = (&mut self.policy, sensed.sensed());
        let chunk = self.planner.chunk(policy, &sensed.data, origin, tick.now());
        if let Some(why) = self.policy.crash() {
            return Err(NodeCrash(why).into());
        }
        let finite = chunk.actions.iter().find(|action| !action.is_finite());
        if let Some(action) = finite {
            return Err(self.policy.not_finite(*action, &sensed.data));
        }
        tick.publish_from(&self.chunks, chunk, &sensed);
        Ok(Flow::Continue)
    }

    /// Replaces the policy by the named one, if it supports that.
    fn on_order(&mut self, text: &str) -> Result<String, NodeError> {
        self.policy.swap(text)
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
        self.policy.restart()
    }
}
