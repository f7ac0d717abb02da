//! Sensor, policy and actuator of a robot.

use std::{mem, str::FromStr};

use nalgebra::DMatrix;
use ratelab::{
    Chance, Flow, Message, MeterRecorder, Node, NodeError, Publisher, Subscription, Tick,
    TickResult, Time,
};
use ratelab_system::{SharedWorld, graph_file::PLANT_POLICIES};

use crate::{
    PlantDefect,
    robot::SharedRobot,
    world::{FreeRobot, RobotRow},
};

/// Name of the topic from sensor to policy.
pub(crate) const OBS: &str = "/obs";

/// Name of the topic from policy to actuator.
pub(crate) const ACTION: &str = "/action";

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
        let valid = sigma.filter(|sigma| (0.0..=1e3).contains(sigma));
        valid.map(Self).ok_or_else(|| {
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
            name: OBS,
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
        self.plant.at(tick.now()).observe(&mut state)?;
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

/// How controls follow from a reading.
#[derive(Clone, Debug)]
pub(crate) enum Law {
    /// Linear feedback with these gains.
    Lqr(DMatrix<f64>),
    /// The controls of the reference, for ever.
    Hold,
    /// None.
    Zero,
}

impl Law {
    /// Its name.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::Lqr(_) => PLANT_POLICIES[0],
            Self::Hold => PLANT_POLICIES[1],
            Self::Zero => PLANT_POLICIES[2],
        }
    }

    /// Returns the controls for a reading of `robot`.
    fn controls(&self, robot: &SharedRobot, reading: &[f64]) -> Vec<f64> {
        let at = &robot.at.controls;
        match self {
            Self::Zero => vec![0.0; at.len()],
            Self::Hold => at.clone(),
            Self::Lqr(gains) => {
                let deviation = robot.deviation(reading).unwrap_or_default();
                let controls = at.iter().zip(gains.row_iter()).map(|(at, gains)| {
                    let products = gains.iter().zip(&deviation).map(|(gain, x)| gain * x);
                    at - products.fold(0.0, |sum, product| sum + product)
                });
                controls.collect()
            }
        }
    }
}

/// Decides on the newest reading.
pub(crate) struct RobotPolicy {
    pub(crate) robot: SharedRobot,
    pub(crate) law: Law,
    /// The law of each name, for messages.
    pub(crate) laws: Vec<Law>,
    pub(crate) readings: Subscription<RobotRow>,
    pub(crate) actions: Publisher<RobotRow>,
}

impl Node for RobotPolicy {
    fn tick(&mut self, tick: &mut Tick) -> TickResult {
        if let Some(reading) = tick.read(&mut self.readings) {
            let controls = self.law.controls(&self.robot, &reading.data.0);
            tick.publish(&self.actions, RobotRow(controls.into()));
        }
        Ok(Flow::Continue)
    }

    /// Replaces the policy by the named one.
    fn on_message(&mut self, text: &str) -> Result<String, NodeError> {
        let named = self.laws.iter().find(|law| law.name() == text.trim());
        let law = named.ok_or_else(|| PlantDefect::policy(text))?.clone();
        Ok(mem::replace(&mut self.law, law).name().to_owned())
    }
}

/// Applies the newest controls.
pub(crate) struct RobotActuator {
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
}
