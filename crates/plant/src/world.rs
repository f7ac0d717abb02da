//! A robot that moves by itself.

use std::{cell::RefCell, sync::Arc};

use mujoco_rs::mujoco_c::mjtState;
use ratelab::{Flow, Message, Publisher, Tick, Time};
use ratelab_metrics::Fields;
use ratelab_system::{StepInput, World};

use crate::{BodyData, disturbance::JointPushes, model_error::RobotModelError, robot::SharedRobot};

/// The interval at which it is judged whether a run is lost (ns).
pub(crate) const JUDGED_NS: u64 = 20_000_000;

/// The numbers of a message: a reading, controls, or a state.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RobotRow(pub(crate) Arc<[f64]>);

impl Fields for RobotRow {
    /// They differ from robot to robot.
    const FIELDS: &'static [&'static str] = &[];

    fn append_to(&self, row: &mut Vec<f64>) {
        row.extend(&*self.0);
    }

    fn from_row(row: &[f64]) -> Option<Self> {
        Some(Self(row.into()))
    }
}

/// A robot that moves by itself in steps of physics. Its state at run time t is the state after
/// all steps that have ended by t.
pub(crate) struct FreeRobot {
    robot: SharedRobot,
    data: BodyData,
    /// A robot in which is computed what follows from a state.
    copy: RefCell<Option<BodyData>>,
    steps: u64,
    input: StepInput<Arc<[f64]>>,
    /// Input of the last step that has ended.
    taken: Arc<[f64]>,
    /// Run time of the sensing behind the controls in force.
    sensed: Option<Time>,
    pushes: StepInput<JointPushes>,
    /// Whether the last step was pushed.
    is_pushed: bool,
    seed: u64,
}

impl FreeRobot {
    /// Places `robot` at the start for `seed`.
    pub(crate) fn new(robot: SharedRobot, seed: u64) -> Result<Self, RobotModelError> {
        let controls: Arc<[f64]> = robot.at.controls.as_slice().into();
        Ok(Self {
            data: robot.begin(seed)?,
            copy: RefCell::default(),
            robot,
            steps: 0,
            input: StepInput::new(controls.clone()),
            taken: controls,
            sensed: None,
            pushes: StepInput::new(JointPushes::none()),
            is_pushed: false,
            seed,
        })
    }

    /// Positions, speeds and activations.
    pub(crate) fn state(&self) -> Vec<f64> {
        let data = &self.data;
        [data.qpos(), data.qvel(), data.act()].concat()
    }

    /// Places the robot as in a `reading`, with nothing left of what was before.
    pub(crate) fn place(&mut self, reading: &[f64]) {
        self.robot.at.put_into(&mut self.data);
        let data = &mut self.data;
        let (positions, rest) = reading.split_at(data.qpos().len());
        let (speeds, rest) = rest.split_at(data.qvel().len());
        data.qpos_mut().copy_from_slice(positions);
        data.qvel_mut().copy_from_slice(speeds);
        let activations = data.act().len();
        data.act_mut().copy_from_slice(&rest[..activations]);
    }

    /// Goes on by so many steps with these controls, whatever the time.
    pub(crate) fn hold(&mut self, controls: &[f64], steps: u64) {
        let mut controls = controls.to_vec();
        self.robot.model.clip(&mut controls);
        self.data.ctrl_mut().copy_from_slice(&controls);
        for _ in 0..steps {
            self.data.step();
        }
    }

    /// Adds the terms of an observation to a reading of the state, which may have noise.
    pub(crate) fn observe(&mut self, reading: &mut Vec<f64>) -> Result<(), RobotModelError> {
        const STATE: u32 = mjtState::mjSTATE_INTEGRATION as u32;
        if self.robot.terms.is_empty() {
            return Ok(());
        }
        let data = match self.copy.get_mut() {
            Some(data) => data,
            empty => empty.insert(self.robot.model.body()?),
        };
        // Its length is that of the same model.
        let _ = data.set_state(&self.data.state(STATE), STATE);
        let (positions, rest) = reading.split_at(data.qpos().len());
        data.qpos_mut().copy_from_slice(positions);
        let speeds = &rest[..data.qvel().len()];
        data.qvel_mut().copy_from_slice(speeds);
        data.forward();
        self.robot.terms.read(data, &self.robot.given, reading);
        Ok(())
    }

    /// Applies controls at run time `now`: steps that begin then or later have them.
    pub(crate) fn push(&mut self, now: Time, command: &Message<RobotRow>) {
        let mut controls = command.data.0.to_vec();
        self.robot.model.clip(&mut controls);
        self.sensed = command.origin;
        self.input.set(controls.into(), now, self.next_begin());
    }

    /// Pushes joints in steps that begin at run time `now` or later; returns the pushes before.
    pub(crate) fn disturb(&mut self, now: Time, pushes: JointPushes) -> JointPushes {
        let before = self.pushes.last_set().clone();
        self.pushes.set(pushes, now, self.next_begin());
        before
    }

    /// Returns the run time at which the next step begins.
    fn next_begin(&self) -> Time {
        Time::from_nanos(self.steps.saturating_mul(self.robot.model.step_ns))
    }

    /// Publishes the state, and ends the run if it is lost.
    pub(crate) fn judge(&self, tick: &mut Tick, states: &Publisher<RobotRow>) -> Flow {
        let mut state = self.state();
        state.extend(self.robot.moved(tick.now()));
        if tick.now() > Time::ZERO {
            let row = [&*self.taken, &state].concat();
            tick.publish_stamped(states, RobotRow(row.into()), self.sensed);
        }
        match self.robot.loss(&state, &mut self.copy.borrow_mut()) {
            Some(_) => Flow::End,
            None => Flow::Continue,
        }
    }

    fn integrate(&mut self, steps: u64) {
        self.data.ctrl_mut().copy_from_slice(self.input.next());
        let pushes = self.pushes.next();
        for step in self.steps..self.steps + steps {
            if self.is_pushed || !pushes.is_none() {
                let begin_ns = step.saturating_mul(self.robot.model.step_ns);
                pushes.push(&mut self.data, self.seed, begin_ns / JUDGED_NS);
            }
            self.data.step();
        }
        self.is_pushed = !pushes.is_none();
        self.taken = self.input.next().clone();
        self.steps += steps;
    }
}

impl World for FreeRobot {
    fn advance_to(&mut self, now: Time) {
        let steps = now.as_nanos() / self.robot.model.step_ns;
        if steps <= self.steps {
            return;
        }
        if self.input.changes() || self.pushes.changes() {
            self.integrate(1);
            self.input.go_on();
            self.pushes.go_on();
        }
        if steps > self.steps {
            self.integrate(steps - self.steps);
        }
    }
}
