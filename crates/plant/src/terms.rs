//! What a policy sees of a robot: the terms of an observation.

use std::ops::Range;

use mujoco_rs::prelude::MjtObjBase;

use crate::{
    BodyData, PlantDefect,
    defect::parse_items,
    model::{RobotJoint, RobotModel},
    motion::coordinate,
    reference::Reference,
};

/// The key with the terms.
const OBSERVE: &str = "observe";

/// The forms of terms, for errors.
const FORMS: &str = "qpos, qvel, joints, joint-speeds, sensor NAME, gravity SITE, target JOINT, last-action \
                     or numbers such as \"1 0 0\", also with a factor, such as \"qvel * 0.1\"";

/// The most numbers of an observation.
const MOST_NUMBERS: usize = 4096;

/// The terms of an observation, in the order of the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ObservedTerms(Vec<ObservedTerm>);

/// A part of an observation.
#[derive(Clone, Debug, PartialEq)]
struct ObservedTerm {
    text: String,
    kind: TermKind,
    factor: f64,
    /// The numbers that it has.
    size: usize,
}

#[derive(Clone, Debug, PartialEq)]
enum TermKind {
    Positions,
    Speeds,
    /// These positions of hinges and slides, less the ones of the pose as given.
    Joints(Vec<usize>),
    /// These speeds of hinges and slides.
    JointSpeeds(Vec<usize>),
    Sensor(Range<usize>),
    /// The world's down in the frame of this site.
    Gravity(usize),
    /// How far this coordinate is to be from the pose, as the policy knows it.
    Target(usize),
    /// The policy's own last output.
    LastAction,
    Numbers(Vec<f64>),
}

impl ObservedTerms {
    /// Reads the terms of a file for `model`.
    ///
    /// # Errors
    /// [`PlantDefect`] for a term of another form, and a name that does not exist.
    pub(crate) fn parse(texts: &[String], model: &RobotModel) -> Result<Self, PlantDefect> {
        let terms = Self(parse_items(texts, |text| ObservedTerm::parse(text, model))?);
        match terms.0.iter().map(|term| term.size).sum() {
            0..=MOST_NUMBERS => Ok(terms),
            numbers => Err(PlantDefect::new(
                OBSERVE,
                format!("an observation of {numbers} numbers: expected up to {MOST_NUMBERS}"),
            )),
        }
    }

    /// Returns whether the state itself is the observation.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    fn sensor_terms(&self) -> impl Iterator<Item = &ObservedTerm> {
        self.0.iter().filter(|term| !term.kind.is_of_policy())
    }

    /// Returns the name of each number that the sensor reads.
    pub(crate) fn names(&self) -> Vec<String> {
        let names = self.sensor_terms().flat_map(|term| {
            let name = |number| match term.size {
                1 => term.text.clone(),
                _ => format!("{} {number}", term.text),
            };
            (1..=term.size).map(name)
        });
        names.collect()
    }

    /// Adds to `row` what the sensor reads in `data`, where all that follows from the state has been
    /// computed; `given` is the pose as given.
    pub(crate) fn read(&self, data: &BodyData, given: &Reference, row: &mut Vec<f64>) {
        for term in self.sensor_terms() {
            let numbers = term.kind.numbers(data, given);
            row.extend(numbers.into_iter().map(|number| number * term.factor));
        }
    }

    /// Returns the whole observation, of what the sensor has `read`, of the target behind that, and of
    /// what the policy answered `last`; `None` for another amount of numbers.
    pub(crate) fn whole(&self, read: &[f64], last: &[f64]) -> Option<Vec<f64>> {
        let count: usize = self.sensor_terms().map(|term| term.size).sum();
        let (mut rest, target) = read.split_at_checked(count)?;
        let mut whole = Vec::new();
        for term in &self.0 {
            match term.kind {
                TermKind::LastAction => {
                    whole.extend(last.iter().map(|number| number * term.factor))
                }
                // Of a reference that stands still there is none.
                TermKind::Target(index) => {
                    let amount = target.get(index).copied().unwrap_or_default();
                    whole.push(amount * term.factor);
                }
                _ => {
                    let (numbers, after) = rest.split_at_checked(term.size)?;
                    whole.extend(numbers);
                    rest = after;
                }
            }
        }
        Some(whole)
    }

    /// Returns the numbers of a whole observation.
    pub(crate) fn size(&self) -> usize {
        self.0.iter().map(|term| term.size).sum()
    }
}

impl ObservedTerm {
    fn parse(text: &str, model: &RobotModel) -> Result<Self, PlantDefect> {
        let what = || format!("{text:?} is not a term: expected {FORMS}");
        let no_term = || PlantDefect::new(OBSERVE, what());
        let (of, factor) = match text.rsplit_once('*') {
            None => (text, 1.0),
            Some((of, factor)) => (of, number(factor).ok_or_else(no_term)?),
        };
        let words = of.trim();
        let [positions, coordinates, _, controls] = model.sizes();
        let (kind, size) = match words.split_once(char::is_whitespace) {
            None if words == "qpos" => (TermKind::Positions, positions),
            None if words == "qvel" => (TermKind::Speeds, coordinates),
            None if words == "last-action" => (TermKind::LastAction, controls),
            None if words == "joints" => {
                let places = joints(model, |joint| joint.position);
                (TermKind::Joints(places.clone()), places.len())
            }
            None if words == "joint-speeds" => {
                let places = joints(model, |joint| joint.speed);
                (TermKind::JointSpeeds(places.clone()), places.len())
            }
            Some(("sensor", name)) => {
                let sensor = named(model, MjtObjBase::mjOBJ_SENSOR, "sensor", name.trim())?;
                let [begin, size] = [model.mujoco.sensor_adr(), model.mujoco.sensor_dim()]
                    .map(|all| all[sensor] as usize);
                (TermKind::Sensor(begin..begin + size), size)
            }
            Some(("target", name)) => {
                let joint = coordinate(model, name.trim());
                let index = joint.ok_or_else(|| {
                    let known = joint_names(model);
                    PlantDefect::unknown(OBSERVE, "hinge or slide", name.trim(), &known)
                })?;
                (TermKind::Target(index), 1)
            }
            Some(("gravity", name)) => {
                let site = named(model, MjtObjBase::mjOBJ_SITE, "site", name.trim())?;
                (TermKind::Gravity(site), 3)
            }
            _ => {
                let numbers: Option<Vec<f64>> = words.split_whitespace().map(number).collect();
                let numbers = numbers.filter(|numbers| !numbers.is_empty());
                let numbers = numbers.ok_or_else(no_term)?;
                let size = numbers.len();
                (TermKind::Numbers(numbers), size)
            }
        };
        Ok(Self {
            text: text.trim().to_owned(),
            kind,
            factor,
            size,
        })
    }
}

impl TermKind {
    /// Returns whether the policy knows it, and not the sensor.
    fn is_of_policy(&self) -> bool {
        matches!(self, Self::LastAction | Self::Target(_))
    }

    fn numbers(&self, data: &BodyData, given: &Reference) -> Vec<f64> {
        match self {
            Self::Positions => data.qpos().to_vec(),
            Self::Speeds => data.qvel().to_vec(),
            Self::Joints(places) => {
                let moved = |place: &usize| data.qpos()[*place] - given.positions[*place];
                places.iter().map(moved).collect()
            }
            Self::JointSpeeds(places) => places.iter().map(|place| data.qvel()[*place]).collect(),
            Self::Sensor(range) => data.sensordata()[range.clone()].to_vec(),
            Self::Gravity(site) => {
                let [.., x, y, z] = data.site_xmat()[*site];
                [x, y, z].map(|up| 0.0 - up).to_vec()
            }
            Self::LastAction | Self::Target(_) => Vec::new(),
            Self::Numbers(numbers) => numbers.clone(),
        }
    }
}

fn number(text: &str) -> Option<f64> {
    let number: Option<f64> = text.trim().parse().ok();
    number.filter(|number| number.is_finite())
}

/// Returns the names of hinges and slides.
fn joint_names(model: &RobotModel) -> Vec<&str> {
    let joints = model.joints.iter().filter(|joint| joint.is_single());
    joints.map(|joint| &*joint.name).collect()
}

/// Returns the places of hinges and slides.
fn joints(model: &RobotModel, place: impl Fn(&RobotJoint) -> usize) -> Vec<usize> {
    model
        .joints
        .iter()
        .filter(|joint| joint.is_single())
        .map(place)
        .collect()
}

/// Returns the index of the object of this kind called `name`.
fn named(
    model: &RobotModel,
    object: MjtObjBase,
    kind: &str,
    name: &str,
) -> Result<usize, PlantDefect> {
    model
        .named(object, name)
        .map_err(|names| PlantDefect::unknown(OBSERVE, kind, name, &names))
}
