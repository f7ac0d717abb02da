//! A robot of an MJCF file as a system: sensor, policy and actuator around it.

use std::{
    path::Path,
    sync::{Arc, Mutex},
    time::Duration,
};

use nalgebra::DMatrix;
use ratelab::{
    ClockExit, Hz, Knob,
    KnobKind::{Depth, Parameter, Rate, Send, Takes},
    Tick, Time,
    sync::lock,
};
use ratelab_system::{
    About, AgeLimits, Alias, BuildError, Builder, FigureValue, Group, Judge, PlantRecord,
    RobotInfo, RunTally, Setup, Signal, SignalValue, System, SystemFigure, SystemKnobs, Verdict,
    VerdictKind, WORLD,
    graph_file::{PLANT, PLANT_POLICIES, PlantSpec},
    names::key,
    overload,
};

use crate::{
    PlantDefect,
    model::{JointKind, RobotModel},
    nodes::{
        ACTION, ACTUATOR, Law, NOISE, OBS, POLICY, RobotActuator, RobotPolicy, RobotSensor,
        SENSE_TO_ACT, SENSOR, STATE, SensorNoise,
    },
    robot::{LossCause, Robot, SharedRobot},
    theory::BearableDelay,
    world::{FreeRobot, JUDGED_NS, RobotRow},
};

/// The robot was within its limits for the whole run.
const STOOD: VerdictKind = VerdictKind::held("stood", "STOOD (within its limits the whole run)");

/// The robot was within its limits when a command stopped the run.
const STOPPED: VerdictKind =
    VerdictKind::held("stopped", "STOPPED at {at} (within its limits so far)");

/// The names of its knobs, in the order of the help.
const ALIASES: &[Alias] = &[
    Alias {
        name: "control-hz",
        knobs: &[(Rate, POLICY)],
        default: "50",
        choices: &[],
        help: "How often the policy decides",
    },
    Alias {
        name: "sensor-hz",
        knobs: &[(Rate, SENSOR)],
        default: "50",
        choices: &[],
        help: "How often the sensor publishes",
    },
    Alias {
        name: "actuator-hz",
        knobs: &[(Rate, ACTUATOR)],
        default: "50",
        choices: &[],
        help: "How often the actuator applies the newest controls",
    },
    Alias {
        name: "queue-depth",
        knobs: &[(Depth, OBS), (Depth, ACTION)],
        default: "1",
        choices: &[],
        help: "How many messages /obs and /action keep",
    },
    Alias {
        name: "policy",
        knobs: &[(Send, POLICY)],
        default: PLANT_POLICIES[0],
        choices: &PLANT_POLICIES,
        help: "The policy: lqr, made from the model; hold, the controls of the pose; or zero",
    },
    Alias {
        name: "think-ms",
        knobs: &[(Takes, POLICY)],
        default: "none",
        choices: &[],
        help: "The time that the policy takes to decide (ms): 30, 60..110, lognormal:30,90, recorded:FILE, file:CSV or drawn:CSV",
    },
    Alias {
        name: NOISE,
        knobs: &[(Parameter, "sensor noise")],
        default: "0",
        choices: &[],
        help: "Standard deviation of what is added to each coordinate and speed of a reading (m, rad, m/s, rad/s)",
    },
];

/// A robot of an MJCF file, with a controller that is made from its model.
pub struct RobotPlant {
    robot: SharedRobot,
    verdicts: Vec<VerdictKind>,
    settings: Vec<Knob>,
    /// The controller at each rate that a run had.
    laws: Mutex<Vec<(Hz, Law)>>,
    /// The notes on the controller at each rate.
    notes: Mutex<Vec<(Hz, Vec<String>)>>,
}

impl RobotPlant {
    /// Loads the robot of `spec`, whose files lie in `folder` or below.
    ///
    /// # Errors
    /// [`PlantDefect`] for unreadable files, a model beyond the bounds, and a pose that nothing holds.
    pub fn load(folder: &Path, spec: &PlantSpec) -> Result<Self, PlantDefect> {
        let model = RobotModel::load(folder, &spec.mjcf, spec.step_ns)?;
        Ok(Self::new(Robot::new(model, spec)?))
    }

    /// Returns the robot of a recording, which needs no file.
    ///
    /// # Errors
    /// [`PlantDefect`] for a damaged record.
    pub fn recorded(record: &PlantRecord, spec: &PlantSpec) -> Result<Self, PlantDefect> {
        Ok(Self::new(Robot::recorded(record, spec)?))
    }

    fn new(robot: Robot) -> Self {
        let mut verdicts: Vec<VerdictKind> = vec![STOOD, STOPPED];
        verdicts.push(VerdictKind::lost("not_finite", "LOST at {at} (not finite)"));
        let mut groups: Vec<&str> = Vec::new();
        for (group, limit) in robot.model.coordinates.iter().zip(&robot.limits) {
            if limit.is_finite() && !groups.contains(&&**group) {
                groups.push(group);
                verdicts.push(lost_kind(group, *limit));
            }
        }
        let spec = &robot.spec;
        let policy = Knob::Send {
            node: POLICY.to_owned(),
            text: spec.policy.clone(),
        };
        let rates = [SENSOR, POLICY, ACTUATOR].map(|node| Knob::Rate {
            node: node.to_owned(),
            hz: spec.rate,
        });
        Self {
            settings: rates.into_iter().chain([policy]).collect(),
            robot: Arc::new(robot),
            verdicts,
            laws: Mutex::default(),
            notes: Mutex::default(),
        }
    }

    /// The law called `name` for a policy at `hz`.
    fn law(&self, name: &str, hz: Hz) -> Result<Law, PlantDefect> {
        match PLANT_POLICIES.iter().position(|known| *known == name) {
            Some(0) => {
                let mut laws = lock(&self.laws);
                if let Some((_, law)) = laws.iter().find(|(known, _)| *known == hz) {
                    return Ok(law.clone());
                }
                let gains = self.robot.gains(hz);
                let what = || format!("lqr has no gains at {hz}: try another rate");
                let gains = gains.ok_or_else(|| PlantDefect::new("policy", what()))?;
                let law = Law::Lqr(gains);
                laws.push((hz, law.clone()));
                Ok(law)
            }
            Some(1) => Ok(Law::Hold),
            Some(_) => Ok(Law::Zero),
            None => Err(PlantDefect::policy(name)),
        }
    }

    /// Returns the greatest constant delay of `/action` that linear theory allows a policy at `hz`;
    /// `None` where the controller has no gains.
    pub fn bearable_delay(&self, hz: Hz) -> Option<BearableDelay> {
        match self.law(PLANT_POLICIES[0], hz).ok()? {
            Law::Lqr(gains) => Some(self.robot.bearable(&gains, hz.period().as_secs_f64())),
            Law::Hold | Law::Zero => None,
        }
    }

    /// The notes on what nothing holds under these gains.
    fn notes(&self, gains: &DMatrix<f64>, hz: Hz) -> Vec<String> {
        let mut known = lock(&self.notes);
        if let Some((_, notes)) = known.iter().find(|(of, _)| *of == hz) {
            return notes.clone();
        }
        let robot = &self.robot;
        let free = robot.free_coordinates(gains, hz.period().as_secs_f64());
        let limited = free
            .into_iter()
            .filter(|index| robot.limits[*index].is_finite());
        let notes = limited.map(|index| {
            let group = &robot.model.coordinates[index];
            let name = robot.coordinate(index);
            format!("nothing holds {name}: limits = {{ {group:?} = inf }}")
        });
        let notes: Vec<String> = notes.collect();
        known.push((hz, notes.clone()));
        notes
    }

    /// The law of a run with `setup`, and its rate.
    fn law_of(&self, setup: &Setup) -> Result<(Law, Hz), PlantDefect> {
        let spec = &self.robot.spec;
        let hz = setup.rate(POLICY).unwrap_or(spec.rate);
        let name = setup.message(POLICY).unwrap_or(&spec.policy);
        Ok((self.law(name, hz)?, hz))
    }

    /// The plots: joints with one coordinate and a limit, then the controls.
    fn coordinate_signals(&self) -> Vec<Signal> {
        let (robot, controls) = (&self.robot, self.robot.half.len());
        let [_, count, ..] = robot.model.sizes();
        let entry =
            |index: usize| SignalValue::new(move |row| row.get(index).copied().unwrap_or(f64::NAN));
        let joints = robot
            .model
            .joints
            .iter()
            .filter(|joint| joint.numbers() == [1, 1]);
        let joints = joints.filter_map(|joint| {
            let index = (0..count).find(|index| robot.model.coordinates[*index] == joint.name)?;
            let (limit, here) = (robot.limits[index], robot.at.positions[joint.position]);
            let is_angle = joint.kind == JointKind::Hinge;
            let widest = if limit.is_finite() { 1.2 * limit } else { 1.0 };
            Some(Signal {
                name: joint.name.clone().into(),
                unit: if is_angle { "rad" } else { "m" }.into(),
                topic: STATE.into(),
                value: entry(controls + joint.position),
                limits: limit.is_finite().then_some([here - limit, here + limit]),
                range: [here - widest, here + widest],
            })
        });
        let pushes = self.control_names().into_iter().enumerate();
        let pushes = pushes.map(|(index, name)| {
            let (at, half) = (robot.at.controls[index], robot.half[index]);
            let range = robot.model.range(index);
            Signal {
                name: name.into(),
                unit: "".into(),
                topic: STATE.into(),
                value: entry(index),
                limits: None,
                range: range.unwrap_or([at - half, at + half]),
            }
        });
        joints.chain(pushes).collect()
    }

    /// The names of the numbers of a state.
    fn state_names(&self) -> Vec<String> {
        let robot = &self.robot;
        let [positions, coordinates, activations, _] = robot.model.sizes();
        let joints = || robot.model.joints.iter();
        let mut names = Vec::new();
        for (joint, speeds) in joints()
            .map(|joint| (joint, false))
            .chain(joints().map(|joint| (joint, true)))
        {
            let [of_positions, of_speeds] = joint.numbers();
            let count = if speeds { of_speeds } else { of_positions };
            let unit = match (joint.kind, speeds) {
                (JointKind::Slide, false) => " (m)",
                (JointKind::Slide, true) => " (m/s)",
                (JointKind::Hinge, false) => " (rad)",
                (JointKind::Hinge | JointKind::Ball, true) => " (rad/s)",
                _ => "",
            };
            let what = if speeds { "speed" } else { "position" };
            for number in 1..=count {
                let number = if count == 1 {
                    String::new()
                } else {
                    format!(" {number}")
                };
                names.push(format!("{} {what}{number}{unit}", joint.name));
            }
        }
        debug_assert_eq!(names.len(), positions + coordinates);
        names.extend((1..=activations).map(|number| format!("activation {number}")));
        names
    }

    /// The names of the controls.
    fn control_names(&self) -> Vec<String> {
        self.robot.model.control_names()
    }
}

/// The verdict on a run that a group of coordinates has lost.
fn lost_kind(group: &str, limit: f64) -> VerdictKind {
    VerdictKind {
        name: format!("lost_{}", key(group)).into(),
        lost: true,
        text: format!("LOST at {{at}} ({group} beyond {limit})").into(),
    }
}

/// Any error of a part of the graph as the error of a setting.
fn setting(error: impl std::fmt::Display) -> BuildError {
    BuildError::Setting(error.to_string())
}

impl System for RobotPlant {
    fn name(&self) -> &str {
        PLANT
    }

    fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
        if !builder.world().is_course() {
            return Err(setting(
                "the plant moves by itself, in steps of its model: leave the world out",
            ));
        }
        let rate = self.robot.spec.rate;
        builder.message(POLICY); // The policy is built with it.
        let (law, hz) = self.law_of(builder.setup()).map_err(setting)?;
        let laws = PLANT_POLICIES
            .iter()
            .filter_map(|name| self.law(name, hz).ok());
        let noise = builder
            .parameter(SENSOR, NOISE)
            .map(str::parse::<SensorNoise>);
        let noise = noise.transpose().map_err(setting)?.unwrap_or_default();
        let (states, controls) = (self.state_names(), self.control_names());
        let readings = builder.internal_topic::<RobotRow>(OBS);
        builder.record_as(readings.clone(), states.iter());
        let actions = builder.internal_topic::<RobotRow>(ACTION);
        builder.record_as(actions.clone(), controls.iter());
        let rows = builder.internal_topic::<RobotRow>(STATE);
        builder.record_as(rows.clone(), controls.iter().chain(&states));
        let world = FreeRobot::new(self.robot.clone(), builder.seed()).map_err(setting)?;
        let judged_hz = 1e9 / JUDGED_NS as f64;
        let plant = builder.own_world(world, judged_hz, |wiring| {
            let rows = wiring.publisher(&rows);
            move |plant: &FreeRobot, tick: &mut Tick| plant.judge(tick, &rows)
        })?;
        let (robot, seen, seed) = (self.robot.clone(), plant.clone(), builder.seed());
        let published = readings.clone();
        builder.node(SENSOR, rate.get(), 0, move |wiring| RobotSensor {
            robot: robot.clone(),
            plant: seen.clone(),
            readings: wiring.publisher(&published),
            noise,
            seed,
        })?;
        let readings = builder.through(&readings, 0)?;
        let (robot, laws, published) = (
            self.robot.clone(),
            laws.collect::<Vec<_>>(),
            actions.clone(),
        );
        builder.node(POLICY, rate.get(), 1, move |wiring| RobotPolicy {
            robot: robot.clone(),
            law: law.clone(),
            laws: laws.clone(),
            readings: wiring.subscription(&readings),
            actions: wiring.publisher(&published),
        })?;
        let actions = builder.through(&actions, 1)?;
        builder.node(ACTUATOR, rate.get(), 2, move |wiring| RobotActuator {
            plant: plant.clone(),
            actions: wiring.subscription(&actions),
            sense_to_act: wiring.meter(SENSE_TO_ACT),
            command: None,
        })
    }

    fn about(&self) -> About<'_> {
        About {
            state: Some(STATE),
            latency: Some((ACTUATOR, SENSE_TO_ACT)),
            captions: &[
                (SENSOR, "reads the plant"),
                (POLICY, "decides"),
                (ACTUATOR, "pushes"),
                (WORLD, "moves by itself"),
            ],
            settings: &self.settings,
            plant: Some(&self.robot.record),
            ..About::default()
        }
    }

    fn groups(&self) -> Vec<Group> {
        vec![Group::new(PLANT, [WORLD, SENSOR, ACTUATOR])]
    }

    fn signals(&self) -> Vec<Signal> {
        self.coordinate_signals()
    }

    fn warnings(&self, setup: &Setup) -> Vec<String> {
        let robot = &self.robot;
        let ends = robot.at_the_end().into_iter().map(|joint| {
            format!("{joint} is at the end of its range in this pose: theory is blind to that; try another pose")
        });
        let mut warnings: Vec<String> = ends.collect();
        if let Ok((Law::Lqr(gains), hz)) = self.law_of(setup) {
            warnings.extend(self.notes(&gains, hz));
        }
        warnings
    }

    fn overloads(&self, setup: &Setup) -> Vec<String> {
        let rate = |node| setup.rate(node).unwrap_or(self.robot.spec.rate);
        let nodes = [SENSOR, POLICY, ACTUATOR].into_iter();
        nodes
            .filter_map(|node| overload(node, rate(node), setup))
            .collect()
    }

    fn judge(&self) -> &dyn Judge {
        self
    }

    fn robot(&self) -> &dyn RobotInfo {
        self
    }

    fn knobs(&self) -> &dyn SystemKnobs {
        self
    }
}

impl Judge for RobotPlant {
    fn verdict(&self, exit: &ClockExit, at: Time, state: Option<&[f64]>) -> Verdict {
        let controls = self.robot.half.len();
        let state = state.and_then(|row| row.get(controls..));
        let kind = match state.and_then(|state| self.robot.loss(state)) {
            Some(LossCause::NotFinite) => self.verdicts[2].clone(),
            Some(LossCause::Coordinate(index)) => lost_kind(
                &self.robot.model.coordinates[index],
                self.robot.limits[index],
            ),
            None if *exit == ClockExit::Completed => STOOD,
            None => STOPPED,
        };
        Verdict::new(kind, at)
    }

    fn verdicts(&self) -> Vec<VerdictKind> {
        self.verdicts.clone()
    }

    fn tally(&self, _: &Setup) -> Option<Box<dyn RunTally>> {
        Some(Box::new(RobotTally {
            robot: self.robot.clone(),
            sum: 0.0,
            rows: 0,
        }))
    }

    /// The mean age of pushes with the longest delay that theory allows; nothing where contacts may
    /// open, which theory does not see.
    fn age_limits(&self, setup: &Setup) -> AgeLimits {
        let limit = || match self.law_of(setup).ok()? {
            (Law::Lqr(_), hz) if !self.robot.is_touching() => {
                let half = hz.period() / 2;
                match self.bearable_delay(hz)? {
                    BearableDelay::None => Some(half),
                    BearableDelay::Ms(ms) => Some(Duration::from_millis(ms) + half),
                    BearableDelay::Any => None,
                }
            }
            _ => None,
        };
        AgeLimits {
            grows: limit(),
            ..AgeLimits::default()
        }
    }
}

impl RobotInfo for RobotPlant {
    fn engine(&self) -> Option<(&str, &str)> {
        Some(("MuJoCo", mujoco_rs::mujoco_version()))
    }
}

impl SystemKnobs for RobotPlant {
    fn aliases(&self) -> &'static [Alias] {
        ALIASES
    }

    fn resolve(&self, _: u64, _: &Setup, node: &str, text: &str) -> Result<String, String> {
        let name = text.trim();
        if node != POLICY || PLANT_POLICIES.contains(&name) {
            return Ok(name.to_owned());
        }
        Err(PlantDefect::policy(name).to_string())
    }

    fn parameter(&self, [node, name]: [&str; 2], value: &str) -> Result<String, String> {
        if [node, name] != [SENSOR, NOISE] {
            return Err(format!("{node} has no parameter {name:?}"));
        }
        let noise = value.parse::<SensorNoise>();
        noise.map_or_else(|why| Err(why.to_string()), |noise| Ok(noise.0.to_string()))
    }
}

/// Adds up what the states of a run cost.
struct RobotTally {
    robot: SharedRobot,
    sum: f64,
    rows: u64,
}

impl RunTally for RobotTally {
    fn topics(&self) -> &'static [&'static str] {
        &[STATE]
    }

    fn message(&mut self, _: &str, row: &[f64]) {
        if let Some(cost) = self.robot.cost(row) {
            self.sum += cost;
            self.rows += 1;
        }
    }

    fn figures(&self) -> Vec<SystemFigure> {
        let mean = (self.rows > 0).then(|| self.sum / self.rows as f64);
        vec![SystemFigure {
            block: None,
            name: "plant_cost",
            text: "mean of (x/limit)^2 + (u/half range)^2: {}",
            value: FigureValue::Number(mean),
        }]
    }
}
