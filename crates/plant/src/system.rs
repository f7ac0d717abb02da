//! A robot of an MJCF file as a system: sensor, policy and actuator around it.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, OnceLock},
    time::Duration,
};

use nalgebra::DMatrix;
use ratelab::{ClockExit, Hz, Knob, Time, sync::lock};
use ratelab_policy::{
    PolicyContext, PolicyFile, PolicyFiles,
    chunk::{
        ChunkLoop, ChunkSettings, PLAYER,
        planning::{MERGED, PLANNED, PLAYED},
    },
};
use ratelab_system::{
    About, AgeLimits, Alias, BuildError, Builder, Group, Judge, Picture, Planning, PlantRecord,
    RobotInfo, RunTally, Setup, Signal, Spoiler, System, SystemKnobs, Verdict, VerdictKind, WORLD,
    graph_file::{PLANT, PLANT_POLICIES, PlantSpec},
    names::key,
    overload,
};

use crate::{
    PlantDefect,
    aliases::ALIASES,
    cascade::{INNER, INNER_SENSOR},
    decide::known,
    disturbance::{DISTURB, JointPushes},
    late_loop::LoopRates,
    law::Law,
    model::RobotModel,
    nodes::{ACTION, ACTUATOR, NOISE, POLICY, SENSE_TO_ACT, SENSOR, STATE, SensorNoise},
    picture::RobotPainter,
    robot::{LossCause, Robot, SharedRobot},
    signals::site_signals,
    tally::RobotTally,
    target::TARGET_NODE,
    theory::BearableDelay,
};

/// The robot was within its limits for the whole run.
const STOOD: VerdictKind = VerdictKind::held("stood", "STOOD (within its limits the whole run)");

/// The robot was within its limits when a command stopped the run.
const STOPPED: VerdictKind =
    VerdictKind::held("stopped", "STOPPED at {at} (within its limits so far)");

/// A robot of an MJCF file, with a controller that is made from its model.
pub struct RobotPlant {
    pub(crate) robot: SharedRobot,
    verdicts: Vec<VerdictKind>,
    settings: Vec<Knob>,
    /// The gains at each rate that a run had.
    gains: Mutex<Vec<(Hz, DMatrix<f64>)>>,
    /// The notes on the controller at each rate.
    pub(crate) notes: Mutex<Vec<(Hz, Vec<String>)>>,
    /// What draws the robot, from the first picture on.
    painter: OnceLock<Option<RobotPainter>>,
    /// The policies in files that were loaded.
    pub(crate) files: PolicyFiles,
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
        let rates = robot.rates().into_iter().map(|(node, hz)| Knob::Rate {
            node: node.to_owned(),
            hz,
        });
        let chunk = spec.chunk.map(|count| Knob::Parameter {
            node: POLICY.to_owned(),
            name: ChunkSettings::CHUNK.to_owned(),
            value: count.to_string(),
        });
        Self {
            settings: rates.chain([policy]).chain(chunk).collect(),
            robot: Arc::new(robot),
            verdicts,
            gains: Mutex::default(),
            notes: Mutex::default(),
            painter: OnceLock::new(),
            files: PolicyFiles::default(),
        }
    }

    /// Returns the gains of `lqr` for a policy at `hz`.
    pub(crate) fn gains(&self, hz: Hz) -> Result<DMatrix<f64>, PlantDefect> {
        let mut known = lock(&self.gains);
        if let Some((_, gains)) = known.iter().find(|(of, _)| *of == hz) {
            return Ok(gains.clone());
        }
        let what = || format!("lqr has no gains at {hz}: try another rate");
        let made = self.robot.gains(hz);
        let gains = made.ok_or_else(|| PlantDefect::new("policy", what()))?;
        known.push((hz, gains.clone()));
        Ok(gains)
    }

    /// Returns the law called `name` for a policy at `hz`.
    pub(crate) fn law(&self, name: &str, hz: Hz) -> Result<Law, PlantDefect> {
        match PLANT_POLICIES.iter().position(|known| *known == name) {
            Some(0) => {
                let [outer, _] = self.robot.split(&self.gains(hz)?);
                Ok(Law::Lqr(outer))
            }
            Some(1) => Ok(Law::Hold),
            Some(_) => Ok(Law::Zero),
            None => Err(PlantDefect::policy(name)),
        }
    }

    /// Returns the inputs of a policy in a file.
    pub(crate) fn context(&self, seed: u64, setup: &Setup) -> PolicyContext {
        PolicyContext {
            seed,
            control_hz: self.rates(setup).policy,
            chunk: self.chunks(setup).map(|chunks| chunks.horizon.get()),
        }
    }

    /// Returns the rates of the loops of a run with `setup`.
    pub(crate) fn rates(&self, setup: &Setup) -> LoopRates {
        let spec = &self.robot.spec;
        let inner = spec.inner.as_ref();
        LoopRates {
            // A plan has an action for each tick of the player, however rarely it is made.
            policy: setup
                .rate(POLICY)
                .filter(|_| self.chunks(setup).is_none())
                .unwrap_or(spec.rate),
            inner: inner.map(|inner| setup.rate(INNER).unwrap_or(inner.rate)),
        }
    }

    /// Returns the mean age of pushes with the longest delay that theory allows; nothing where contacts
    /// may open, which theory does not see.
    fn age_limit(&self, setup: &Setup) -> Option<Duration> {
        if !self.has_gains(setup) || self.robot.is_touching() {
            return None;
        }
        let rates = self.rates(setup);
        let half = rates.inner.unwrap_or(rates.policy).period() / 2;
        match self.bearable(ACTION, rates)? {
            BearableDelay::None => Some(half),
            BearableDelay::Ms(ms) => Some(Duration::from_millis(ms) + half),
            BearableDelay::Any => None,
        }
    }

    /// Returns the settings of chunks in `setup`, if the policy answers with any.
    pub(crate) fn chunks(&self, setup: &Setup) -> Option<ChunkSettings> {
        let chunks = ChunkSettings::from_setup(setup, self.robot.actions());
        chunks.ok().flatten()
    }

    /// Returns whether `lqr` decides in a run with `setup`.
    fn has_gains(&self, setup: &Setup) -> bool {
        setup.message(POLICY).unwrap_or(&self.robot.spec.policy) == PLANT_POLICIES[0]
    }
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
pub(crate) fn setting(error: impl std::fmt::Display) -> BuildError {
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
        self.graph(builder)
    }

    fn about(&self) -> About<'_> {
        About {
            state: Some(STATE),
            latency: Some((ACTUATOR, SENSE_TO_ACT)),
            captions: &[
                (SENSOR, "reads the plant"),
                (POLICY, "decides"),
                (PLAYER, "plays"),
                (INNER_SENSOR, "reads the plant"),
                (INNER, "adds its part"),
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
        let inner = self.robot.spec.inner.is_some().then_some(INNER_SENSOR);
        let others = target.into_iter().chain(inner);
        let nodes = [WORLD, SENSOR, ACTUATOR].into_iter().chain(others);
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
        if self.has_gains(setup) {
            warnings.extend(self.notes(self.rates(setup).policy));
        }
        if let Some(chunks) = self.chunks(setup) {
            let policy = setup.message(POLICY).unwrap_or(&robot.spec.policy);
            let known = ChunkLoop {
                is_program: file_of(POLICY, policy).is_some_and(|file| file.is_program),
                bears: self.age_limit(setup),
            };
            warnings.extend(known.warnings(setup, &chunks));
        }
        warnings
    }

    fn overloads(&self, setup: &Setup) -> Vec<String> {
        let asked = self
            .chunks(setup)
            .is_some_and(|chunks| chunks.refill.is_some());
        let rates = self.robot.rates().into_iter();
        rates
            .filter(|(node, _)| !(asked && *node == POLICY))
            .filter_map(|(node, hz)| overload(node, setup.rate(node).unwrap_or(hz), setup))
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

    fn tally(&self, setup: &Setup) -> Option<Box<dyn RunTally>> {
        let chunks = self.chunks(setup).is_some();
        Some(Box::new(RobotTally::new(self.robot.clone(), chunks)))
    }

    /// Returns the mean age of pushes with the longest delay that theory allows.
    fn age_limits(&self, setup: &Setup) -> AgeLimits {
        AgeLimits {
            // Theory knows nothing of plans.
            grows: self
                .age_limit(setup)
                .filter(|_| self.chunks(setup).is_none()),
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

    fn planning(&self) -> Option<Planning> {
        const SPOILERS: &[Spoiler] = &[MERGED, PLANNED, PLAYED];
        let robot = &self.robot;
        let (at, half) = (robot.at.controls.first()?, robot.half.first()?);
        let most = at.abs() + half;
        Some(robot.actions().planning((ACTION, most), SPOILERS))
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
            // Without chunks here a sweep, or the file, may still have them.
            if context.chunk.is_some() {
                pinned.check_chunk(context.chunk, shape)?;
            }
            Ok(pinned)
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

    fn is_fixed(&self, knob: &Knob) -> bool {
        matches!(knob, Knob::Parameter { node, name, .. } if ChunkSettings::FIXED.contains(&[&**node, &**name]))
    }

    fn parameter(&self, [node, name]: [&str; 2], value: &str) -> Result<String, String> {
        let chunks = ChunkSettings::PARAMETERS.into_iter();
        let mut known = chunks.filter(|(of, known, _)| [*of, *known] == [node, name]);
        if let Some((.., shortest)) = known.next() {
            return shortest(value).map_err(|why| why.to_string());
        }
        if [node, name] == [ACTUATOR, DISTURB] {
            let pushes = JointPushes::parse(&self.robot, value);
            return pushes.map_or_else(
                |why| Err(why.to_string()),
                |pushes| Ok(pushes.text().to_owned()),
            );
        }
        if ![SENSOR, INNER_SENSOR].contains(&node) || name != NOISE {
            return Err(format!("{node} has no parameter {name:?}"));
        }
        let noise = value.parse::<SensorNoise>();
        noise.map_or_else(|why| Err(why.to_string()), |noise| Ok(noise.0.to_string()))
    }
}
