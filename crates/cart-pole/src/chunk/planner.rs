//! What a policy plans for a reading.

use std::{collections::VecDeque, sync::Arc, time::Duration};

use ratelab::Time;

use super::{
    ACTION_PERIOD,
    message::Chunk,
    settings::{ChunkSettings, ExpectedDelay, PlanKind},
};
use crate::{
    Action, Observation, PlantError,
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
