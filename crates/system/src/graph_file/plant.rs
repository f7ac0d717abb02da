//! The plant in a graph file: a robot of an MJCF file.

use ratelab::Hz;

use super::{
    GraphFile, GraphFileError, InnerSpec,
    document::Block,
    error::{Checked, GraphRefusal, Placed, refuse, unknown},
};

/// Name of the section, and of the system that it stands for.
pub const PLANT: &str = "plant";

/// The policies of a plant.
pub const PLANT_POLICIES: [&str; 3] = ["lqr", "hold", "zero"];

/// The limit of a coordinate (m, rad), unless another one is given.
const LIMIT: f64 = 0.5;

/// The greatest speed of a coordinate at the start (m/s, rad/s), unless another one is given.
const START: f64 = 0.1;

/// The rate of its nodes (Hz), unless another one is given.
const RATE_HZ: f64 = 50.0;

/// A robot of an MJCF file, with its settings.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantSpec {
    /// The path of the model, from the folder of the graph file.
    pub mjcf: String,
    /// Name of the keyframe with the pose; the first one if it is `None`.
    pub keyframe: Option<String>,
    /// Joints with their positions, which replace the ones of the keyframe.
    pub pose: Vec<(String, Vec<f64>)>,
    /// Groups of coordinates with their greatest deviations; `*` is all others.
    pub limits: Vec<(String, f64)>,
    /// The greatest speed of a coordinate at the start (m/s, rad/s).
    pub start: f64,
    /// What joints of the reference move, each as text, such as `hinge sine 0.1 0.5`.
    pub reference: Vec<String>,
    /// Name of the policy, or the path of its file from the folder of the graph file.
    pub policy: String,
    /// The terms of an observation; none for the state itself.
    pub observe: Vec<String>,
    /// The factor from outputs of a network to controls.
    pub action: f64,
    /// The actions in an answer of the policy, if it answers with chunks.
    pub chunk: Option<usize>,
    /// What loses a run beside the limits.
    pub lost: Vec<String>,
    /// The rate of sensor, policy and actuator.
    pub rate: Hz,
    /// The part of the controller that is a loop of its own.
    pub inner: Option<InnerLoop>,
    /// Step of physics (ns), if it is not the model's.
    pub step_ns: Option<u64>,
    /// The keys with the places of their values in the file, then of the items of lists, for errors.
    places: Vec<(&'static str, Vec<usize>)>,
    at: usize,
}

/// The inner loop of a cascade: what it holds, and how often.
#[derive(Clone, Debug, PartialEq)]
pub struct InnerLoop {
    /// The groups of coordinates that it holds.
    pub joints: Vec<String>,
    /// The rate of its sensor and its controller, and of the actuator.
    pub rate: Hz,
}

impl PlantSpec {
    /// Reads the section; the system in the middle is then the plant.
    pub(super) fn read(block: &Block) -> Checked<(Self, InnerSpec)> {
        let text = |key| block.text(key).map(|placed| placed.text.clone());
        let at = block.name.at;
        let policy = block.text("policy");
        // A path has a folder or an ending.
        let is_known = |name: &str| PLANT_POLICIES.contains(&name) || name.contains(['/', '.']);
        if let Some(policy) = policy.filter(|name| !is_known(&name.text)) {
            return unknown("no policy", policy, PLANT_POLICIES.into_iter());
        }
        let start = block.text("start").map(|start| (number(start), start.at));
        if let Some((_, at)) = start.filter(|(start, _)| !(0.0..f64::INFINITY).contains(start)) {
            return refuse(at, "start: expected 0 or more (m/s, rad/s)");
        }
        let spec = Self {
            mjcf: text("mjcf").unwrap_or_default(),
            keyframe: text("keyframe"),
            pose: numbers(block, "pose"),
            limits: limits(block)?,
            start: start.map_or(START, |(start, _)| start),
            reference: texts(block, "reference"),
            policy: policy
                .map_or(PLANT_POLICIES[0], |policy| &policy.text)
                .to_owned(),
            observe: texts(block, "observe"),
            action: action(block)?,
            chunk: block
                .text("chunk")
                .map(|count| number(count) as usize)
                .filter(|count| *count > 0),
            lost: texts(block, "lost"),
            rate: rate(block, "rate")?,
            inner: inner(block)?,
            step_ns: step(block)?,
            places: places(block),
            at,
        };
        let inner = InnerSpec {
            name: Placed::new(PLANT, at),
            remap: super::check::remap(block)?,
        };
        Ok((spec, inner))
    }

    /// Returns the limit of a group of coordinates.
    pub fn limit(&self, group: &str) -> f64 {
        let of = |name| self.limits.iter().find(|(known, _)| known == name);
        of(group)
            .or_else(|| of("*"))
            .map_or(LIMIT, |(_, limit)| *limit)
    }
}

/// Returns the keys of the section, each with the place of its value and of the items of a list.
fn places(block: &Block) -> Vec<(&'static str, Vec<usize>)> {
    let keys = [
        "mjcf",
        "keyframe",
        "pose",
        "limits",
        "start",
        "policy",
        "observe",
        "action",
        "chunk",
        "lost",
        "rate",
        "inner",
        "inner_rate",
        "step_ms",
        "reference",
    ];
    let places = keys.into_iter().filter_map(|key| {
        let items = block.list(key).iter().map(|item| item.at);
        Some((key, [block.at(key)?].into_iter().chain(items).collect()))
    });
    places.collect()
}

impl GraphFile {
    /// Returns its plant, if it has one.
    pub fn plant(&self) -> Option<&PlantSpec> {
        self.plant.as_ref()
    }

    /// Returns an error in the value that `key` of its plant has, or in an `item` of a list.
    pub fn plant_error(
        &self,
        key: &str,
        item: Option<usize>,
        what: impl Into<String>,
    ) -> GraphFileError {
        let plant = self.plant.as_ref();
        let at = plant.map_or(0, |plant| {
            let places = plant.places.iter().find(|(known, _)| *known == key);
            let place = places.and_then(|(_, at)| at.get(item.map_or(0, |item| item + 1)));
            place.map_or(plant.at, |at| *at)
        });
        GraphRefusal::new(at, what).in_text(&self.text)
    }
}

fn number(text: &Placed) -> f64 {
    text.text.parse().unwrap_or(f64::NAN)
}

/// Returns the names in a table, each with its numbers.
fn numbers(block: &Block, key: &str) -> Vec<(String, Vec<f64>)> {
    let pairs = block.list(key).chunks_exact(2).map(|pair| {
        let numbers = pair[1]
            .text
            .split_whitespace()
            .map(|number| number.parse().unwrap_or(f64::NAN));
        (pair[0].text.clone(), numbers.collect())
    });
    pairs.collect()
}

fn limits(block: &Block) -> Checked<Vec<(String, f64)>> {
    let pairs = block.list("limits").chunks_exact(2).map(|pair| {
        let limit = number(&pair[1]);
        if limit > 0.0 {
            Ok((pair[0].text.clone(), limit))
        } else {
            let what = format!(
                "limits: {:?}: expected a number above 0, or inf",
                pair[0].text
            );
            refuse(pair[1].at, what)
        }
    });
    pairs.collect()
}

fn action(block: &Block) -> Checked<f64> {
    let Some(factor) = block.text("action") else {
        return Ok(1.0);
    };
    match number(factor) {
        0.0 => refuse(factor.at, "action: expected a factor other than 0"),
        number => Ok(number),
    }
}

fn rate(block: &Block, key: &str) -> Checked<Hz> {
    let given = block.text(key);
    let hz = Hz::new(given.map_or(RATE_HZ, number));
    hz.or_else(|error| refuse(given.map_or(0, |rate| rate.at), format!("{key}: {error}")))
}

/// Returns the inner loop, if joints are named for it.
fn inner(block: &Block) -> Checked<Option<InnerLoop>> {
    let joints: Vec<String> = texts(block, "inner");
    match block.at("inner_rate") {
        Some(at) if joints.is_empty() => {
            refuse(at, "inner_rate: it has no joints: inner = [\"JOINT\"]")
        }
        _ if joints.is_empty() => Ok(None),
        _ => Ok(Some(InnerLoop {
            joints,
            rate: rate(block, "inner_rate")?,
        })),
    }
}

/// Returns the items of a list.
fn texts(block: &Block, key: &str) -> Vec<String> {
    let items = block.list(key).iter();
    items.map(|item| item.text.clone()).collect()
}

fn step(block: &Block) -> Checked<Option<u64>> {
    let Some(step) = block.text("step_ms") else {
        return Ok(None);
    };
    let micros = number(step) * 1e3;
    let nearest = micros.round();
    if (10.0..=1e5).contains(&nearest) && (micros - nearest).abs() < 1e-6 {
        Ok(Some(nearest as u64 * 1000))
    } else {
        refuse(
            step.at,
            "step_ms: expected whole microseconds from 0.01 to 100 ms",
        )
    }
}
