//! What is wrong with a plant.

use ratelab::alternatives;
use ratelab_system::graph_file::PLANT_POLICIES;
use thiserror::Error;

use crate::model_error::RobotModelError;

/// What is wrong with a plant, and in which key.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{what}")]
pub struct PlantDefect {
    /// The key.
    pub key: &'static str,
    /// The number of the item, from 0, of a list.
    pub item: Option<usize>,
    /// The reason, with what to try.
    pub what: String,
}

impl PlantDefect {
    pub(crate) fn new(key: &'static str, what: impl Into<String>) -> Self {
        Self {
            key,
            item: None,
            what: what.into(),
        }
    }

    /// Returns a name of a `kind` of things, which is none of the known ones.
    pub(crate) fn unknown(key: &'static str, kind: &str, name: &str, known: &[&str]) -> Self {
        let there = match known {
            [] => "there are none".to_owned(),
            known => format!("there are {}", known.join(", ")),
        };
        Self::new(key, format!("no {kind} {name:?}: {there}"))
    }

    /// Returns a policy that does not exist.
    pub(crate) fn policy(name: &str) -> Self {
        let known = alternatives(&PLANT_POLICIES);
        Self::new(
            "policy",
            format!(
                "{name:?} is not a policy of a plant: expected {known}, or a file of weights, an \
                 ONNX graph or a program"
            ),
        )
    }
}

/// Parses the items of a list; an error names its item.
pub(crate) fn parse_items<T>(
    texts: &[String],
    parse: impl Fn(&str) -> Result<T, PlantDefect>,
) -> Result<Vec<T>, PlantDefect> {
    texts
        .iter()
        .enumerate()
        .map(|(item, text)| {
            parse(text).map_err(|defect| PlantDefect {
                item: Some(item),
                ..defect
            })
        })
        .collect()
}

impl From<RobotModelError> for PlantDefect {
    fn from(error: RobotModelError) -> Self {
        Self::new("mjcf", error.to_string())
    }
}
