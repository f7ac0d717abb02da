//! The plant that moves by itself, and its linear model.

use std::{ptr, time::Duration};

use mujoco_rs::mujoco_c::mjd_transitionFD;
use nalgebra::{Matrix4, Vector4};
use ratelab::{Flow, Message, Publisher, Tick, Time};
use ratelab_system::{StepInput, StepMs, World};

use crate::{
    body::{Body, PlantError, SUBSTEPS, at_rest},
    message::{Action, ControlStep, Observation},
    plant::{CartPlant, Disturbance, Newtons, STEP},
};

/// A control step (ns): the interval at which the fall of the pole is checked.
const CONTROL_STEP_NS: u64 = 20_000_000;

/// A cart-pole that moves by itself in steps of physics. Its state at run time t is the
/// state after all steps that have ended by t.
///
/// An action applied at t is the input of every step that begins at t or later, until the
/// next action; a step in progress keeps its input.
pub struct FreePlant {
    body: Body,
    step: Duration,
    steps: u64,
    input: StepInput<Action>,
    disturbance: StepInput<Disturbance>,
    /// Input of the last finished step.
    taken: Action,
    /// Run time of the sensing behind the action in force.
    sensed: Option<Time>,
}

impl FreePlant {
    /// Creates a plant at the start for `seed`.
    ///
    /// # Errors
    /// [`PlantError`] if MuJoCo refuses the model or is out of memory.
    pub fn new(step: StepMs, seed: u64) -> Result<Self, PlantError> {
        Ok(Self {
            body: Body::new(step, seed)?,
            step: Duration::from_millis(step.get()),
            steps: 0,
            input: StepInput::new(Action::ZERO),
            disturbance: StepInput::new(Disturbance::none(seed)),
            taken: Action::ZERO,
            sensed: None,
        })
    }

    /// Returns the start of step number `step`, counted from zero.
    fn begin_of(&self, step: u64) -> Time {
        Time::from_nanos(step.saturating_mul(self.step.as_nanos() as u64))
    }

    /// Publishes the result of a control step that ends with this `tick`, and ends the run if
    /// the pole has fallen.
    pub(super) fn judge(&self, tick: &mut Tick, steps: &Publisher<ControlStep>) -> Flow {
        let now = tick.now();
        let step = now.as_nanos() / CONTROL_STEP_NS;
        if step > 0 {
            let latency = self.sensed.map(|sensed| now.since(sensed));
            let result = self.body.result(step, self.taken, latency);
            tick.publish_stamped(steps, result, self.sensed);
        }
        match self.body.pose.fall() {
            Some(_) => Flow::End,
            None => Flow::Continue,
        }
    }
}

impl CartPlant for FreePlant {
    fn observe(&self) -> Observation {
        self.body.observation
    }

    fn push(&mut self, now: Time, command: Option<Message<Action>>) -> Option<(ControlStep, bool)> {
        let command = command?;
        self.sensed = command.origin;
        self.input.set(command.data, now, self.begin_of(self.steps));
        None
    }

    /// From the next step on that begins at run time `now` or later.
    fn disturb(&mut self, now: Time, newtons: Newtons) -> Newtons {
        let before = *self.disturbance.last_set();
        let disturbance = before.with(newtons);
        self.disturbance
            .set(disturbance, now, self.begin_of(self.steps));
        before.newtons
    }
}

impl World for FreePlant {
    fn advance_to(&mut self, now: Time) {
        let steps = now.as_nanos() / self.step.as_nanos() as u64;
        if steps <= self.steps {
            return;
        }
        if self.input.changes() || self.disturbance.changes() {
            self.integrate(1);
            self.input.go_on();
            self.disturbance.go_on();
        }
        self.integrate(steps - self.steps);
        self.body.look();
    }
}

impl FreePlant {
    fn integrate(&mut self, steps: u64) {
        let end = self.steps + steps;
        let (input, disturbance) = (*self.input.next(), *self.disturbance.next());
        while self.steps < end {
            let control_step = self.begin_of(self.steps).as_nanos() / CONTROL_STEP_NS;
            self.body.disturb(disturbance.force(control_step));
            let alike = if disturbance.is_none() {
                end - self.steps
            } else {
                self.steps_until(control_step + 1).min(end - self.steps)
            };
            self.body.integrate(input, alike);
            self.taken = input;
            self.steps += alike;
        }
    }

    /// Returns the number of steps that begin before this control step does.
    fn steps_until(&self, control_step: u64) -> u64 {
        let steps_before = control_step * (CONTROL_STEP_NS / self.step.as_nanos() as u64);
        steps_before - self.steps
    }
}

/// Perturbation of each coordinate in the finite differences, in its own unit. The error
/// of centred differences grows with its square, the rounding error with its inverse.
const PERTURBATION: f64 = 1e-6;

/// The motion of a small deviation from upright rest in one step of time: `x' = A·x +
/// B·u`.
///
/// The state `x` is cart position (m), pole angle (rad), cart velocity (m/s) and pole
/// velocity (rad/s), in this order; `u` is an action, held for the whole step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearPlant {
    /// A: the effect of the state.
    pub a: Matrix4<f64>,
    /// B: the effect of the action.
    pub b: Vector4<f64>,
}

impl LinearPlant {
    /// Returns one control step at upright rest: the product of its physics steps.
    ///
    /// # Errors
    /// [`PlantError`] if MuJoCo refuses the model or is out of memory.
    pub fn control_step() -> Result<Self, PlantError> {
        Self::for_model(1.0)
    }

    /// Returns `times` such steps with a constant action; zero counts as one.
    pub fn held_for(self, times: u32) -> Self {
        (1..times).fold(self, |so_far, _| Self {
            a: self.a * so_far.a,
            b: self.a * so_far.b + self.b,
        })
    }

    /// Linearises a plan's model over the time of an action, with a pole `length` times as long.
    pub(crate) fn for_model(length: f64) -> Result<Self, PlantError> {
        Ok(Self::physics_step(length)?.held_for(SUBSTEPS))
    }

    /// Returns one physics step at upright rest with such a pole, by MuJoCo's finite differences.
    pub(super) fn physics_step(length: f64) -> Result<Self, PlantError> {
        let mut data = at_rest(STEP, length)?;
        let model = data.model().ffi();
        let mut a = Matrix4::zeros();
        let mut b = Vector4::zeros();
        // SAFETY: the data was made from the model, and both outlive the call.
        // MuJoCo writes 4×4 and 4×1 numbers for two degrees of freedom, no
        // activation and one control, and skips null outputs.
        unsafe {
            mjd_transitionFD(
                model,
                data.ffi_mut(),
                PERTURBATION,
                true,
                a.as_mut_ptr(),
                b.as_mut_ptr(),
                ptr::null_mut(),
                ptr::null_mut(),
            );
        }
        // MuJoCo writes row by row, nalgebra keeps column by column.
        Ok(Self {
            a: a.transpose(),
            b,
        })
    }
}
