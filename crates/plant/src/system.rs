//! A robot of an MJCF file as a system: sensor, policy and actuator around it.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, OnceLock},
    time::Duration,
};

use nalgebra::DMatrix;
use ratelab::{ClockExit, Hz, Knob, Tick, Time, Topic, Wiring, sync::lock};
use ratelab_policy::{PolicyContext, PolicyFile, PolicyFiles};
use ratelab_system::{
    About, AgeLimits, Alias, BuildError, Builder, Group, Judge, Picture, PlantRecord, RobotInfo,
    RunTally, Setup, SharedWorld, Signal, System, SystemKnobs, Verdict, VerdictKind, WORLD,
    graph_file::{PLANT, PLANT_POLICIES, PlantSpec},
    names::key,
    overload,
};

use crate::{
    PlantDefect,
    aliases::ALIASES,
    decide::{PolicyMaker, RobotLaw, known},
    disturbance::{DISTURB, JointPushes},
    law::Law,
    model::RobotModel,
    nodes::{
        ACTION, ACTUATOR, NOISE, OBS, POLICY, RobotActuator, RobotPolicy, RobotSensor,
        SENSE_TO_ACT, SENSOR, STATE, SensorNoise,
    },
    picture::RobotPainter,
    robot::{LossCause, Robot, SharedRobot},
    signals::site_signals,
    tally::RobotTally,
    target::{RobotTarget, TARGET, TARGET_NODE, TargetReader},
    theory::BearableDelay,
    world::{FreeRobot, JUDGED_NS, RobotRow},
};

/// The robot was within its limits for the whole run.
const STOOD: VerdictKind = VerdictKind::held("stood", "STOOD (within its limits the whole run)");

/// The robot was within its limits when a command stopped the run.
const STOPPED: VerdictKind =
    VerdictKind::held("stopped", "STOPPED at {at} (within its limits so far)");

/// A robot of an MJCF file, with a controller that is made from its model.
pub struct RobotPlant {
    robot: SharedRobot,
    verdicts: Vec<VerdictKind>,
    settings: Vec<Knob>,
    /// The controller at each rate that a run had.
    laws: Mutex<Vec<(Hz, Law)>>,
    /// The notes on the controller at each rate.
    notes: Mutex<Vec<(Hz, Vec<String>)>>,
    /// What draws the robot, from the first picture on.
    painter: OnceLock<Option<RobotPainter>>,
    /// The policies in files that were loaded.
    files: PolicyFiles,
}

impl RobotPlant {
    /// Loads the robot of `spec`, whose files lie in `folder` or below.
    ///
    /// # Errors
    /// [`PlantDefect`] for unreadable files, a model beyond the bounds, and a pose that nothing holds.
    pub fn load(folder: &Path, spec: &PlantSpec) -> Result<Self, PlantDefect> {
        let model = RobotModel::load(folder, &spec.mjcf, spec.step_ns)?;
        let mut spec = spec.clone();
        if !PLANT_POLICIES.contains(&&*spec.policy) {
            let file = PolicyFile::parse(&spec.policy);
            let path: PathBuf = folder.join(&file.path).components().collect();
            if !fs::metadata(&path).is_ok_and(|file| file.is_file()) {
                let what = format!("no such file: {}", file.path);
                return Err(PlantDefect::new("policy", what));
            }
            let path = path.to_string_lossy().into_owned();
            spec.policy = PolicyFile { path, ..file }.to_string();
        }
        Ok(Self::new(Robot::new(model, &spec)?))
    }

    /// Returns the robot in `xml` with the settings of `spec`: both are parts of the program, and name no
    /// file.
    ///
    /// # Errors
    /// As of [`load`](Self::load).
    pub fn built_in(xml: &str, spec: &PlantSpec) -> Result<Self, PlantDefect> {
        let model = RobotModel::from_xml(xml, spec.step_ns)?;
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
        verdicts.extend(robot.rules.iter().map(|rule| rule_kind(&rule.text)));
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
            painter: OnceLock::new(),
            files: PolicyFiles::default(),
        }
    }

    /// Returns the law called `name` for a policy at `hz`.
    fn law(&self, name: &str, hz: Hz) -> Result<Law, PlantDefect> {
        match PLANT_POLICIES.iter().position(|known| *known == name) {
            Some(0) => {
                let mut laws = lock(&self.laws);
                if let Some((_, law)) = laws.iter().find(|(known, _)| *known == hz) {
                    return Ok(law.clone());
                }
                let what = || format!("lqr has no gains at {hz}: try another rate");
                let gains = self
                    .robot
                    .gains(hz)
                    .ok_or_else(|| PlantDefect::new("policy", what()))?;
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

    /// Returns the lowest whole rate from which deviations grow at none up to `hz` (Hz), each with the
    /// gains for it; `None` where they grow at all rates.
    pub fn lowest_rate(&self, hz: Hz) -> Option<f64> {
        let is_steady = |rate: &f64| {
            let law = Hz::new(*rate)
                .ok()
                .and_then(|hz| self.law(PLANT_POLICIES[0], hz).ok());
            let grows = |gains: &DMatrix<f64>| self.robot.grows(gains, 1.0 / rate);
            matches!(law, Some(Law::Lqr(gains)) if !grows(&gains))
        };
        let rates = (1..=hz.get().ceil() as u64).rev().map(|rate| rate as f64);
        rates.take_while(is_steady).last()
    }

    /// Returns how fast each deviation grows that grows without a controller (1/s), the fastest first.
    pub fn poles(&self) -> Vec<f64> {
        self.robot.poles()
    }

    /// Returns the limit of the coordinates that the file names none for; `None` if it names all.
    pub fn other_limit(&self) -> Option<f64> {
        let (spec, groups) = (&self.robot.spec, self.robot.model.groups());
        let is_named = |group: &&str| spec.limits.iter().any(|(name, _)| name == group);
        let is_complete = groups.iter().all(is_named);
        (!is_complete).then(|| spec.limit("*"))
    }

    /// Returns whether contacts hold the robot: in a run they may open, which theory does not see.
    pub fn is_touching(&self) -> bool {
        self.robot.is_touching()
    }

    /// Returns the notes on what nothing holds under these gains.
    fn notes(&self, gains: &DMatrix<f64>, hz: Hz) -> Vec<String> {
        let mut known = lock(&self.notes);
        if let Some((_, notes)) = known.iter().find(|(of, _)| *of == hz) {
            return notes.clone();
        }
        let robot = &self.robot;
        let free = robot.free_coordinates(gains, hz.period().as_secs_f64());
        let notes: Vec<String> = free
            .into_iter()
            .filter(|index| robot.limits[*index].is_finite())
            .map(|index| {
                let group = &robot.model.coordinates[index];
                let name = robot.coordinate(index);
                format!("nothing holds {name}: limits = {{ {group:?} = inf }}")
            })
            .collect();
        known.push((hz, notes.clone()));
        notes
    }

    /// Adds the robot that moves by itself, with the topic of its states.
    fn plant(&self, builder: &mut Builder<'_>) -> Result<SharedWorld<FreeRobot>, BuildError> {
        let robot = &self.robot;
        let fields = [
            robot.model.control_names(),
            robot.state_names(),
            robot.moving_names(),
        ];
        let rows = builder.internal_topic::<RobotRow>(STATE);
        builder.record_as(rows.clone(), fields.concat());
        let world = FreeRobot::new(robot.clone(), builder.seed()).map_err(setting)?;
        let judged_hz = 1e9 / JUDGED_NS as f64;
        builder.own_world(world, judged_hz, |wiring| {
            let rows = wiring.publisher(&rows);
            move |plant: &FreeRobot, tick: &mut Tick| plant.judge(tick, &rows)
        })
    }

    /// Adds the node that moves the reference, if it moves; returns what the policy reads of it.
    fn targets(&self, builder: &mut Builder<'_>) -> Result<Option<Topic<RobotRow>>, BuildError> {
        if !self.robot.is_moving() {
            return Ok(None);
        }
        let targets = builder.internal_topic::<RobotRow>(TARGET);
        builder.record_as(targets.clone(), self.robot.target_names());
        let (robot, published) = (self.robot.clone(), targets.clone());
        let rate = self.robot.spec.rate;
        builder.node(TARGET_NODE, rate.get(), 0, move |wiring| RobotTarget {
            robot: robot.clone(),
            targets: wiring.publisher(&published),
        })?;
        builder.through(&targets, 0).map(Some)
    }

    /// Returns the policy of a run at first, with its name.
    fn policy(&self, builder: &mut Builder<'_>) -> Result<FirstPolicy, BuildError> {
        let maker = self.maker(builder);
        let own = Some(&*self.robot.spec.policy).filter(|name| PLANT_POLICIES.contains(name));
        let name = match (builder.message(POLICY), own) {
            (Some(text), _) => text.to_owned(),
            (None, own) => own.unwrap_or(Law::Hold.name()).to_owned(),
        };
        if PLANT_POLICIES.contains(&&*name) {
            self.law(&name, maker.context.control_hz).map_err(setting)?;
        }
        let law = maker.make(&name).map_err(setting)?;
        Ok(FirstPolicy { name, law, maker })
    }

    /// Adds the node that decides, between topics of readings and actions.
    fn policy_node(
        &self,
        builder: &mut Builder<'_>,
        first: FirstPolicy,
        targets: Option<Topic<RobotRow>>,
        [readings, actions]: [&Topic<RobotRow>; 2],
    ) -> Result<(), BuildError> {
        let FirstPolicy { name, law, maker } = first;
        let (readings, actions) = (readings.clone(), actions.clone());
        let policy = move |wiring: &mut Wiring<'_>, law| RobotPolicy {
            law,
            first: name.clone(),
            maker: maker.clone(),
            readings: wiring.subscription(&readings),
            actions: wiring.publisher(&actions),
            target: TargetReader(targets.as_ref().map(|targets| wiring.subscription(targets))),
        };
        let rate = self.robot.spec.rate;
        match law {
            RobotLaw::Own(law) => builder.node(POLICY, rate.get(), 1, move |wiring| {
                policy(wiring, RobotLaw::Own(law.clone()))
            }),
            law => builder.single_node(POLICY, rate.into(), 1, |wiring| policy(wiring, law)),
        }
    }

    /// Returns what makes the policies of a run.
    fn maker(&self, builder: &Builder<'_>) -> PolicyMaker {
        let context = self.context(builder.seed(), builder.setup());
        let law = |name: &&str| self.law(name, context.control_hz).ok();
        PolicyMaker {
            robot: self.robot.clone(),
            laws: PLANT_POLICIES.iter().filter_map(law).collect(),
            files: self.files.clone(),
            context,
            answers: builder.answers(POLICY),
        }
    }

    /// Returns the inputs of a policy in a file.
    fn context(&self, seed: u64, setup: &Setup) -> PolicyContext {
        PolicyContext {
            seed,
            control_hz: setup.rate(POLICY).unwrap_or(self.robot.spec.rate),
            chunk: None,
        }
    }

    /// Returns the law of a run with `setup`, and its rate.
    fn law_of(&self, setup: &Setup) -> Result<(Law, Hz), PlantDefect> {
        let spec = &self.robot.spec;
        let hz = setup.rate(POLICY).unwrap_or(spec.rate);
        let name = setup.message(POLICY).unwrap_or(&spec.policy);
        Ok((self.law(name, hz)?, hz))
    }
}

/// The policy of a run at first.
struct FirstPolicy {
    name: String,
    law: RobotLaw,
    maker: PolicyMaker,
}

/// Returns the verdict on a run that a group of coordinates has lost.
fn lost_kind(group: &str, limit: f64) -> VerdictKind {
    VerdictKind {
        name: format!("lost_{}", key(group)).into(),
        lost: true,
        text: format!("LOST at {{at}} ({group} beyond {limit})").into(),
    }
}

/// Returns the verdict on a run that is lost by the rule with this text.
fn rule_kind(text: &str) -> VerdictKind {
    VerdictKind {
        name: format!("lost_{}", key(text)).into(),
        lost: true,
        text: format!("LOST at {{at}} ({text})").into(),
    }
}

/// Returns the file that a message to a node names, if any.
fn file_of(node: &str, text: &str) -> Option<PolicyFile> {
    let name = text.trim();
    (node == POLICY && !PLANT_POLICIES.contains(&name)).then(|| PolicyFile::parse(name))
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
        let policy = self.policy(builder)?;
        let noise = builder
            .parameter(SENSOR, NOISE)
            .map(str::parse::<SensorNoise>)
            .transpose()
            .map_err(setting)?
            .unwrap_or_default();
        let (states, controls) = (self.robot.state_names(), self.robot.model.control_names());
        let readings = builder.internal_topic::<RobotRow>(OBS);
        let observed = self.robot.terms.names();
        builder.record_as(readings.clone(), states.iter().chain(&observed));
        let actions = builder.internal_topic::<RobotRow>(ACTION);
        builder.record_as(actions.clone(), controls.iter());
        let plant = self.plant(builder)?;
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
        let targets = self.targets(builder)?;
        self.policy_node(builder, policy, targets, [&readings, &actions])?;
        let actions = builder.through(&actions, 1)?;
        let robot = self.robot.clone();
        builder.node(ACTUATOR, rate.get(), 2, move |wiring| RobotActuator {
            robot: robot.clone(),
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
                (TARGET_NODE, "moves the reference"),
            ],
            settings: &self.settings,
            plant: Some(&self.robot.record),
            ..About::default()
        }
    }

    fn groups(&self) -> Vec<Group> {
        let target = self.robot.is_moving().then_some(TARGET_NODE);
        let nodes = [WORLD, SENSOR, ACTUATOR].into_iter().chain(target);
        vec![Group::new(PLANT, nodes)]
    }

    fn signals(&self) -> Vec<Signal> {
        let mut signals = site_signals(&self.robot);
        signals.extend(self.robot.signals());
        signals
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
        [SENSOR, POLICY, ACTUATOR]
            .into_iter()
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
        let kind = match state.and_then(|state| self.robot.loss(state, &mut None)) {
            Some(LossCause::NotFinite) => self.verdicts[2].clone(),
            Some(LossCause::Coordinate(index)) => lost_kind(
                &self.robot.model.coordinates[index],
                self.robot.limits[index],
            ),
            Some(LossCause::Rule(index)) => rule_kind(&self.robot.rules[index].text),
            None if *exit == ClockExit::Completed => STOOD,
            None => STOPPED,
        };
        Verdict::new(kind, at)
    }

    fn verdicts(&self) -> Vec<VerdictKind> {
        self.verdicts.clone()
    }

    fn tally(&self, _: &Setup) -> Option<Box<dyn RunTally>> {
        Some(Box::new(RobotTally::new(self.robot.clone())))
    }

    /// Returns the mean age of pushes with the longest delay that theory allows; nothing where
    /// contacts may open, which theory does not see.
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

    fn picture(&self, state: &[f64]) -> Option<Picture> {
        self.picture_from(0, state)
    }

    fn sides(&self) -> usize {
        RobotPainter::SIDES
    }

    fn picture_from(&self, side: usize, state: &[f64]) -> Option<Picture> {
        let painter = || RobotPainter::new(self.robot.clone());
        self.painter
            .get_or_init(painter)
            .as_ref()?
            .draw(side, state)
    }
}

impl SystemKnobs for RobotPlant {
    fn aliases(&self) -> &'static [Alias] {
        ALIASES
    }

    /// Pins a policy's file to its current content.
    fn resolve(&self, seed: u64, setup: &Setup, node: &str, text: &str) -> Result<String, String> {
        let name = text.trim();
        let Some(file) = file_of(node, name) else {
            return Ok(name.to_owned());
        };
        // As in a log, which names a program and has none started.
        if file.is_program {
            return Ok(file.to_string());
        }
        let context = self.context(seed, setup);
        let shape = self.robot.shape(context);
        let pinned = self.files.pin(&file).and_then(|pinned| {
            // The node would refuse a policy that does not fit.
            pinned.policy(context, shape)?;
            pinned.check_chunk(None, shape).map(|()| pinned)
        });
        match pinned {
            Ok(pinned) => Ok(pinned.file().to_string()),
            Err(error) => Err(known(name, error).to_string()),
        }
    }

    fn file(&self, node: &str, text: &str) -> Option<PathBuf> {
        Some(file_of(node, text)?.path.into())
    }

    fn is_program(&self, node: &str, text: &str, looks: bool) -> bool {
        file_of(node, text).is_some_and(|file| {
            let found = || file.load().is_ok_and(|loaded| loaded.file().is_program);
            file.is_program || looks && found()
        })
    }

    fn parameter(&self, [node, name]: [&str; 2], value: &str) -> Result<String, String> {
        if [node, name] == [ACTUATOR, DISTURB] {
            let pushes = JointPushes::parse(&self.robot, value);
            return pushes.map_or_else(
                |why| Err(why.to_string()),
                |pushes| Ok(pushes.text().to_owned()),
            );
        }
        if [node, name] != [SENSOR, NOISE] {
            return Err(format!("{node} has no parameter {name:?}"));
        }
        let noise = value.parse::<SensorNoise>();
        noise.map_or_else(|why| Err(why.to_string()), |noise| Ok(noise.0.to_string()))
    }
}
