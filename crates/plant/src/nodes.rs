//! Sensor, policy and actuator of a robot.

use std::{mem, str::FromStr};

use ratelab::{
    Chance, Flow, Message, MeterRecorder, Node, NodeError, Publisher, Subscription, Tick,
    TickResult, Time,
};
use ratelab_policy::Moment;
use ratelab_system::SharedWorld;

use crate::{
    PlantDefect,
    decide::{PolicyMaker, RobotLaw},
    disturbance::{DISTURB, JointPushes},
    robot::SharedRobot,
    target::TargetReader,
    world::{FreeRobot, RobotRow},
};

/// Name of the topic from sensor to policy.
pub(crate) const OBS: &str = "/obs";

/// Name of the topic from policy to actuator.
pub const ACTION: &str = "/action";

/// Name of the topic with the states of the plant.
pub(crate) const STATE: &str = "/state";

/// Name of the node that reads the plant.
pub(crate) const SENSOR: &str = "sensor";

/// Name of the node that decides.
pub const POLICY: &str = "policy";

/// Name of the node that moves the plant.
pub const ACTUATOR: &str = "actuator";

/// Name of the actuator's meter of the age of the sensing behind its controls.
pub(crate) const SENSE_TO_ACT: &str = "sense→act";

/// Name of the sensor's parameter for its noise.
pub(crate) const NOISE: &str = "noise";

/// The standard deviation of what is added to each coordinate and each speed of a reading.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SensorNoise(pub(crate) f64);

impl FromStr for SensorNoise {
    type Err = PlantDefect;

    fn from_str(text: &str) -> Result<Self, PlantDefect> {
        let sigma: Option<f64> = text.trim().parse().ok();
        sigma
            .filter(|sigma| (0.0..=1e3).contains(sigma))
            .map(Self)
            .ok_or_else(|| {
                PlantDefect::new(
                    NOISE,
                    format!("{text:?} is not a standard deviation: expected 0 to 1000"),
                )
            })
    }
}

/// Reads the plant and publishes the readings.
pub(crate) struct RobotSensor {
    pub(crate) robot: SharedRobot,
    pub(crate) plant: SharedWorld<FreeRobot>,
    /// Name of the topic of its readings.
    pub(crate) topic: String,
    pub(crate) readings: Publisher<RobotRow>,
    pub(crate) noise: SensorNoise,
    pub(crate) seed: u64,
}

impl RobotSensor {
    /// Adds the noise of tick number `tick` to a state.
    fn disturb(&self, tick: u64, state: &mut [f64]) {
        let SensorNoise(sigma) = self.noise;
        if sigma == 0.0 {
            return;
        }
        let chance = Chance {
            seed: self.seed,
            what: NOISE,
            name: &self.topic,
        };
        let draw = |index| sigma * chance.normal(format!("{tick}.{index}"));
        let [positions, coordinates, ..] = self.robot.model.sizes();
        let (places, rest) = state.split_at_mut(positions);
        let moved: Vec<f64> = (0..coordinates).map(draw).collect();
        self.robot.model.mujoco.integrate_pos(places, &moved, 1.0);
        for (index, speed) in rest.iter_mut().take(coordinates).enumerate() {
            *speed += draw(coordinates + index);
        }
    }
}

impl Node for RobotSensor {
    fn tick(&mut self, tick: &mut Tick) -> TickResult {
        let mut state = self.plant.at(tick.now()).state();
        self.disturb(tick.number(), &mut state);
        if self.topic == OBS {
            self.plant.at(tick.now()).observe(&mut state)?;
        }
        tick.publish(&self.readings, RobotRow(state.into()));
        Ok(Flow::Continue)
    }

    fn set_parameter(&mut self, name: &str, value: &str, _: Time) -> Result<String, NodeError> {
        if name != NOISE {
            return Err(format!("the sensor has no parameter {name:?}").into());
        }
        let before = mem::replace(&mut self.noise, value.parse()?);
        Ok(before.0.to_string())
    }
}

/// Decides on the newest reading.
pub(crate) struct RobotPolicy {
    pub(crate) law: RobotLaw,
    /// The name of the law at first.
    pub(crate) first: String,
    pub(crate) maker: PolicyMaker,
    pub(crate) readings: Subscription<RobotRow>,
    pub(crate) actions: Publisher<RobotRow>,
    pub(crate) target: TargetReader,
}

impl Node for RobotPolicy {
    fn tick(&mut self, tick: &mut Tick) -> TickResult {
        if let Some(reading) = tick.read(&mut self.readings) {
            let moment = Moment {
                origin: reading.sensed(),
                now: tick.now(),
                ..Moment::default()
            };
            let robot = &self.maker.robot;
            let seen = self.target.seen(tick, robot, &reading.data);
            let controls = RobotRow(self.law.controls(robot, &seen.0, moment)?.into());
            // The age of a push is that of the reading, whatever the age of the target.
            if self.target.0.is_some() {
                tick.publish_from(&self.actions, controls, &reading);
            } else {
                tick.publish(&self.actions, controls);
            }
        }
        Ok(Flow::Continue)
    }

    /// Replaces the policy by the named one.
    fn on_order(&mut self, text: &str) -> Result<String, NodeError> {
        let law = self.maker.make(text)?;
        Ok(mem::replace(&mut self.law, law).name())
    }

    fn restart(&mut self) -> Result<(), NodeError> {
        self.law = self.maker.make(&self.first)?;
        Ok(())
    }
}

/// Applies the newest controls.
pub(crate) struct RobotActuator {
    pub(crate) robot: SharedRobot,
    pub(crate) plant: SharedWorld<FreeRobot>,
    pub(crate) actions: Subscription<RobotRow>,
    pub(crate) sense_to_act: MeterRecorder,
    pub(crate) command: Option<Message<RobotRow>>,
}

impl Node for RobotActuator {
    fn tick(&mut self, tick: &mut Tick) -> TickResult {
        self.command = tick.read(&mut self.actions);
        Ok(Flow::Continue)
    }

    fn apply(&mut self, tick: &mut Tick) -> TickResult {
        let Some(command) = &self.command else {
            return Ok(Flow::Continue);
        };
        let now = tick.now();
        if let Some(sensed) = command.origin {
            self.sense_to_act.record(now.since(sensed));
            tick.act_on(sensed);
        }
        self.plant.at(now).push(now, command);
        Ok(Flow::Continue)
    }

    /// Sets the pushes on joints.
    fn set_parameter(&mut self, name: &str, value: &str, now: Time) -> Result<String, NodeError> {
        if name != DISTURB {
            return Err(format!("the actuator has no parameter {name:?}").into());
        }
        let pushes = JointPushes::parse(&self.robot, value)?;
        let before = self.plant.at(now).disturb(now, pushes);
        Ok(before.text().to_owned())
    }
}
