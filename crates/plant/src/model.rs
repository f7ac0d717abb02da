//! A robot of an MJCF file, loaded and bounded.

use std::{
    io::{self, Write as _},
    path::Path,
    sync::{Arc, Once},
};

use base64::{Engine as _, prelude::BASE64_STANDARD};
use mujoco_rs::error::MjEditError;
use mujoco_rs::logging::set_log_handler;
use mujoco_rs::mujoco_c::mjtDisableBit;
use mujoco_rs::prelude::{MjData, MjModel, MjSpec, MjtJoint, MjtObjBase};
use mujoco_rs::wrappers::mj_logging::MjtLogLevel;

use ratelab_system::GeomRecord;

use crate::{BodyData, files, geoms, model_error::RobotModelError};

/// The most degrees of freedom of a robot.
pub(crate) const MOST_COORDINATES: usize = 100;

/// The most controls of a robot.
const MOST_CONTROLS: usize = 64;

/// Bounds of the memory for contacts and the like (bytes): with less MuJoCo would end the process.
const ARENA: [i64; 2] = [64 << 20, 1 << 30];

/// Bounds of a step of physics (ns).
const STEP_NS: [u64; 2] = [10_000, 100_000_000];

/// The names of the world's axes.
pub(crate) const AXES: [&str; 3] = ["x", "y", "z"];

/// What kind of motion a joint allows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum JointKind {
    /// Six degrees of freedom.
    Free,
    /// A rotation about any axis.
    Ball,
    /// A straight line.
    Slide,
    /// A rotation about one axis.
    Hinge,
}

/// A joint of a robot.
#[derive(Clone, Debug)]
pub(crate) struct RobotJoint {
    pub(crate) name: String,
    pub(crate) kind: JointKind,
    /// Index of its first number in `qpos`.
    pub(crate) position: usize,
    /// Index of its first number in `qvel`.
    pub(crate) speed: usize,
}

impl RobotJoint {
    /// Returns whether it has one coordinate: a slide or a hinge.
    pub(crate) fn is_single(&self) -> bool {
        matches!(self.kind, JointKind::Slide | JointKind::Hinge)
    }

    /// Returns the numbers that it has in `qpos`, and in `qvel`.
    pub(crate) fn numbers(&self) -> [usize; 2] {
        match self.kind {
            JointKind::Free => [7, 6],
            JointKind::Ball => [4, 3],
            JointKind::Slide | JointKind::Hinge => [1, 1],
        }
    }

    /// Returns the names of its groups of coordinates, each as a limit has it.
    fn groups(&self) -> Vec<(String, usize)> {
        let name = &self.name;
        match self.kind {
            JointKind::Free => vec![(format!("{name}.pos"), 3), (format!("{name}.rot"), 3)],
            JointKind::Ball => vec![(name.clone(), 3)],
            JointKind::Slide | JointKind::Hinge => vec![(name.clone(), 1)],
        }
    }
}

/// A robot of an MJCF file.
#[derive(Clone)]
pub struct RobotModel {
    pub(crate) mujoco: Arc<MjModel>,
    pub(crate) joints: Arc<[RobotJoint]>,
    /// The name of the group of each coordinate, as limits have it.
    pub(crate) coordinates: Arc<[String]>,
    /// Step of physics (ns).
    pub(crate) step_ns: u64,
    text: Arc<str>,
    /// What is drawn of it.
    pub(crate) geoms: Arc<[GeomRecord]>,
}

impl RobotModel {
    /// Loads the robot at `mjcf` in `folder`, with another step of physics (ns) if one is given.
    ///
    /// # Errors
    /// [`RobotModelError`] for an unreadable file, and for a model that is outside of the bounds.
    pub fn load(folder: &Path, mjcf: &str, step_ns: Option<u64>) -> Result<Self, RobotModelError> {
        keep_quiet();
        let path = files::checked(folder, mjcf)?;
        Self::compiled(|| MjSpec::from_xml(&path), step_ns)
    }

    /// Reads the robot in `xml`, which names no other file: a part of the program.
    ///
    /// # Errors
    /// As of [`load`](Self::load).
    pub(crate) fn from_xml(xml: &str, step_ns: Option<u64>) -> Result<Self, RobotModelError> {
        keep_quiet();
        Self::compiled(|| MjSpec::from_xml_string(xml), step_ns)
    }

    fn compiled(
        read: impl Fn() -> Result<MjSpec, MjEditError>,
        step_ns: Option<u64>,
    ) -> Result<Self, RobotModelError> {
        let compile = |physics_only| {
            let mut spec = read().map_err(mujoco)?;
            spec.compiler_mut().set_discardvisual(physics_only);
            spec.compile().map_err(mujoco)
        };
        let (physics, whole) = (compile(true), compile(false));
        let geoms = whole.as_ref().ok().map(geoms::drawn);
        // Where geoms that only show give the robot its inertia, they stay.
        let mut model = physics.or(whole)?;
        let step_ns = match step_ns {
            Some(step_ns) => step_ns,
            None => step_of(&model)?,
        };
        model.opt_mut().timestep = step_ns as f64 / 1e9;
        model.opt_mut().disableflags |= mjtDisableBit::mjDSBL_AUTORESET as i32;
        if model.narena() < ARENA[0] {
            // SAFETY: data is made of the model afterwards, with the memory that this asks for.
            unsafe { model.ffi_mut() }.narena = ARENA[0];
        }
        let robot = Self::bounded(model)?;
        Ok(match geoms {
            Some(geoms) => robot.with_geoms(geoms),
            None => robot,
        })
    }

    /// Draws these geoms, if they are on its bodies.
    pub(crate) fn with_geoms(self, geoms: Vec<GeomRecord>) -> Self {
        if geoms.is_empty() || !geoms::are_sound(&geoms, self.mujoco.ffi().nbody as usize) {
            return self;
        }
        Self {
            geoms: geoms.into(),
            ..self
        }
    }

    /// Reads the robot that [`text`](Self::text) wrote.
    ///
    /// # Errors
    /// [`RobotModelError`] for another text, and for a model that is outside of the bounds.
    pub fn from_text(text: &str) -> Result<Self, RobotModelError> {
        keep_quiet();
        let bytes = BASE64_STANDARD
            .decode(text)
            .map_err(|_| RobotModelError::Damaged)?;
        let model = MjModel::from_buffer(&bytes).map_err(|_| RobotModelError::Damaged)?;
        let is_fixed = model.opt().disableflags & mjtDisableBit::mjDSBL_AUTORESET as i32 != 0;
        if !is_fixed || model.narena() < ARENA[0] {
            return Err(RobotModelError::Damaged);
        }
        Self::bounded(model)
    }

    /// Returns the compiled physics, as text for recordings.
    pub fn text(&self) -> &str {
        &self.text
    }

    fn bounded(model: MjModel) -> Result<Self, RobotModelError> {
        let (joints, controls) = (model.ffi().njnt, model.ffi().nu);
        let sizes = [
            ("coordinates", model.ffi().nv, MOST_COORDINATES as i64),
            ("controls", controls, MOST_CONTROLS as i64),
            ("actuators", model.ffi().nactuator, MOST_CONTROLS as i64),
            ("bytes of memory", model.narena(), ARENA[1]),
        ];
        for (what, found, most) in sizes {
            if found > most {
                return Err(RobotModelError::Size { what, found, most });
            }
        }
        match [joints, controls] {
            [0, _] => return Err(RobotModelError::Without("joint")),
            [_, 0] => return Err(RobotModelError::Without("actuator")),
            _ if model.ffi().nplugin > 0 => return Err(RobotModelError::Plugin),
            _ => {}
        }
        let step_ns = step_of(&model)?;
        let joints = joints_of(&model);
        let coordinates: Arc<[String]> = joints
            .iter()
            .flat_map(RobotJoint::groups)
            .flat_map(|(name, count)| std::iter::repeat_n(name, count))
            .collect();
        let fits = joints
            .iter()
            .map(|joint| joint.position + joint.numbers()[0])
            .all(|end| end <= model.ffi().nq as usize);
        if !fits || coordinates.len() != model.ffi().nv as usize {
            return Err(RobotModelError::Damaged);
        }
        let mut bytes = vec![0; model.size()];
        model.save_to_buffer(&mut bytes).map_err(mujoco)?;
        Ok(Self {
            text: BASE64_STANDARD.encode(bytes).into(),
            joints: joints.into(),
            coordinates,
            step_ns,
            geoms: geoms::drawn(&model).into(),
            mujoco: Arc::new(model),
        })
    }

    /// Creates a robot of this model at rest in the model's own pose.
    pub(crate) fn body(&self) -> Result<BodyData, RobotModelError> {
        MjData::try_new(self.mujoco.clone()).map_err(mujoco)
    }

    /// Returns the numbers of positions, coordinates, activations and controls.
    pub(crate) fn sizes(&self) -> [usize; 4] {
        let model = self.mujoco.ffi();
        [model.nq, model.nv, model.na, model.nu].map(|size| size as usize)
    }

    /// Returns the range of control number `index`, if it has one.
    pub(crate) fn range(&self, index: usize) -> Option<[f64; 2]> {
        let limited = self.mujoco.actuator_ctrllimited()[index];
        limited.then(|| self.mujoco.actuator_ctrlrange()[index])
    }

    /// Half of each control's range; 1 for a control without.
    pub(crate) fn half_ranges(&self) -> Vec<f64> {
        let controls = 0..self.sizes()[3];
        let half = |index| {
            self.range(index)
                .map_or(1.0, |[low, high]| (high - low) / 2.0)
        };
        controls.map(half).collect()
    }

    /// Clips controls to their ranges.
    pub(crate) fn clip(&self, controls: &mut [f64]) {
        for (index, control) in controls.iter_mut().enumerate() {
            if let Some([low, high]) = self.range(index) {
                *control = control.max(low).min(high);
            }
        }
    }

    /// Returns how many numbers a state has: positions, speeds and activations.
    pub(crate) fn state_size(&self) -> usize {
        let [positions, coordinates, activations, _] = self.sizes();
        positions + coordinates + activations
    }

    /// Returns the names of the objects of this kind, empty for one without a name.
    pub(crate) fn names(&self, kind: MjtObjBase) -> Vec<&str> {
        let model = self.mujoco.ffi();
        let count = match kind {
            MjtObjBase::mjOBJ_SENSOR => model.nsensor,
            MjtObjBase::mjOBJ_SITE => model.nsite,
            MjtObjBase::mjOBJ_BODY => model.nbody,
            _ => 0,
        };
        (0..count as usize)
            .map(|index| self.mujoco.id_to_name(kind, index).unwrap_or_default())
            .collect()
    }

    /// Returns the index of the object of this kind called `name`; all names if it does not exist.
    pub(crate) fn named(&self, kind: MjtObjBase, name: &str) -> Result<usize, Vec<&str>> {
        let names = self.names(kind);
        let mut known = names.iter();
        let found = known.position(|known| *known == name && !name.is_empty());
        found.ok_or(names)
    }

    /// Returns the names of the controls.
    pub(crate) fn control_names(&self) -> Vec<String> {
        let model = &self.mujoco;
        let (first, count) = (model.actuator_ctrladr(), model.actuator_ctrlnum());
        let names = first
            .iter()
            .zip(count)
            .enumerate()
            .flat_map(|(index, (first, count))| {
                let own = model
                    .id_to_name(MjtObjBase::mjOBJ_ACTUATOR, index)
                    .map_or_else(|| format!("control {}", first + 1), str::to_owned);
                (0..*count).map(move |number| match count {
                    1 => (*first, own.clone()),
                    _ => (first + number, format!("{own} {}", number + 1)),
                })
            });
        let mut all: Vec<String> = vec![String::new(); self.sizes()[3]];
        for (place, name) in names {
            if let Some(own) = usize::try_from(place)
                .ok()
                .and_then(|place| all.get_mut(place))
            {
                *own = name;
            }
        }
        all
    }

    /// Returns the names of coordinate groups, each once.
    pub(crate) fn groups(&self) -> Vec<&str> {
        let mut names: Vec<&str> = self.coordinates.iter().map(String::as_str).collect();
        names.dedup();
        names
    }
}

/// Keeps warnings of MuJoCo out of terminals, and its log out of the working folder: what they tell
/// is in the verdict.
fn keep_quiet() {
    static ONCE: Once = Once::new();
    // SAFETY: MuJoCo reads the handler when it has something to tell, which it does for robots of
    // MJCF files only, and the first of them is loaded below.
    ONCE.call_once(|| unsafe {
        set_log_handler(|message| {
            if message.level() == MjtLogLevel::mjLOG_ERROR {
                let _ = writeln!(io::stderr(), "error: MuJoCo: {}", message.subject());
            }
        });
    });
}

/// Returns the error of MuJoCo in one line.
fn mujoco(error: impl std::fmt::Display) -> RobotModelError {
    let text = error.to_string();
    let words: Vec<&str> = text.split_whitespace().collect();
    RobotModelError::Mujoco(words.join(" "))
}

/// Returns the step of `model` (ns).
fn step_of(model: &MjModel) -> Result<u64, RobotModelError> {
    let seconds = model.opt().timestep;
    let step_ns = (seconds * 1e9).round_ties_even();
    let [least, most] = STEP_NS.map(|bound| bound as f64);
    if (least..=most).contains(&step_ns) && step_ns % 1e3 == 0.0 {
        Ok(step_ns as u64)
    } else {
        Err(RobotModelError::Step(seconds.to_string()))
    }
}

fn joints_of(model: &MjModel) -> Vec<RobotJoint> {
    let bodies = model.jnt_bodyid();
    let joint = |index: usize| {
        let body = bodies[index];
        let is_alone = bodies.iter().filter(|other| **other == body).count() == 1;
        let own = model.id_to_name(MjtObjBase::mjOBJ_JOINT, index);
        let of_body = || model.id_to_name(MjtObjBase::mjOBJ_BODY, body as usize);
        let name = own.or_else(|| of_body().filter(|_| is_alone));
        RobotJoint {
            name: name.map_or_else(|| format!("#{index}"), str::to_owned),
            kind: match model.jnt_type()[index] {
                MjtJoint::mjJNT_FREE => JointKind::Free,
                MjtJoint::mjJNT_BALL => JointKind::Ball,
                MjtJoint::mjJNT_SLIDE => JointKind::Slide,
                MjtJoint::mjJNT_HINGE => JointKind::Hinge,
            },
            position: model.jnt_qposadr()[index] as usize,
            speed: model.jnt_dofadr()[index] as usize,
        }
    };
    (0..bodies.len()).map(joint).collect()
}
