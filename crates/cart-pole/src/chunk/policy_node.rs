//! The node of a policy that answers with chunks.

use ratelab::{
    Flow, LastTick, Node, NodeCrash, NodeError, Publisher, Subscription, Tick, TickResult, Time,
};

use super::{
    message::{Chunk, Request},
    planner::ChunkPlanner,
    settings::replace,
};
use crate::{Action, NotFinite, Observation, policy::Policy};

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
    fn on_message(&mut self, text: &str) -> Result<String, NodeError> {
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
