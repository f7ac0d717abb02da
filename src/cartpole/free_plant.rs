//! A cart-pole that does not wait: a world of its own.

use std::time::Duration;

use super::{
    body::{Body, PlantError},
    message::{Action, ControlStep, Observation},
    pose::Pose,
};
use crate::{
    runtime::{END, GO_ON, Publisher, Tick, Time},
    system::{StepMs, World},
};

/// A control step (ns): how often somebody looks whether the pole still stands.
const CONTROL_STEP_NS: u64 = 20_000_000;

/// A cart-pole that moves by itself in steps of physics. Its state at run time t is
/// that after all steps that have ended by t.
///
/// An action that is applied at t is the input of every step that begins at t or
/// later, until the next one; a step in progress keeps its input.
pub struct FreePlant {
    body: Body,
    step: Duration,
    steps: u64,
    /// The input of the next step to be taken.
    input: Action,
    /// That of those after it, where it has begun and an action came later.
    later: Option<Action>,
    /// That of the last step that was taken.
    taken: Action,
    /// Run time of the sensing behind the action in force.
    sensed: Option<Time>,
}

impl FreePlant {
    /// A plant at the start that belongs to `seed`.
    ///
    /// # Errors
    /// [`PlantError`] if MuJoCo refuses the model or has no memory.
    pub fn new(step: StepMs, seed: u64) -> Result<Self, PlantError> {
        Ok(Self {
            body: Body::new(step, seed)?,
            step: Duration::from_millis(step.get()),
            steps: 0,
            input: Action::ZERO,
            later: None,
            taken: Action::ZERO,
            sensed: None,
        })
    }

    /// What a perfect sensor reads.
    pub fn observe(&self) -> Observation {
        self.body.observation()
    }

    /// Where cart and pole are.
    pub fn pose(&self) -> Pose {
        self.body.pose()
    }

    /// Applies `action` at run time `now`, derived from a sensing at `sensed`.
    pub fn push(&mut self, now: Time, action: Action, sensed: Option<Time>) {
        self.sensed = sensed;
        if self.begin_of(self.steps) >= now {
            (self.input, self.later) = (action, None);
        } else {
            self.later = Some(action);
        }
    }

    /// When step number `step` begins, counted from zero.
    fn begin_of(&self, step: u64) -> Time {
        Time::from_nanos(step.saturating_mul(self.step.as_nanos() as u64))
    }

    /// What the control step came to that ends at run time `now`.
    pub fn control_step(&self, now: Time) -> ControlStep {
        ControlStep {
            step: now.as_nanos() / CONTROL_STEP_NS,
            action: self.taken.clipped(),
            latency: self.sensed.map(|sensed| now.since(sensed)),
            observation: self.observe(),
            qpos: self.body.qpos(),
            qvel: self.body.qvel(),
        }
    }

    /// Publishes what the control step came to that ends at `now`, if one does, and
    /// ends the run if the pole has fallen.
    pub(super) fn judge(&self, now: Time, steps: &Publisher<ControlStep>) -> Tick {
        let step = self.control_step(now);
        if step.step > 0 {
            steps.publish(step, now, self.sensed);
        }
        match self.pose().fall() {
            Some(_) => END,
            None => GO_ON,
        }
    }
}

impl World for FreePlant {
    fn advance_to(&mut self, now: Time) {
        let steps = now.as_nanos() / self.step.as_nanos() as u64;
        if steps <= self.steps {
            return;
        }
        if let Some(later) = self.later.take() {
            self.integrate(1);
            self.input = later;
        }
        self.integrate(steps - self.steps);
        self.body.look();
    }
}

impl FreePlant {
    fn integrate(&mut self, steps: u64) {
        if steps > 0 {
            self.body.integrate(self.input, steps);
            self.taken = self.input;
            self.steps += steps;
        }
    }
}
