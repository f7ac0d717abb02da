//! What a system says about itself, as data.

use ratelab::{Knob, Time};

use super::{
    Alias, DataChain, Divider, FigureLimit, Joints, Planning, PlantRecord, QuadraticCost, Setup,
};

/// The description of a [`System`](super::System). Each part may be left out.
#[derive(Clone, Copy, Debug, Default)]
pub struct About<'s> {
    /// The engine of its plant, with the version, such as `MuJoCo` and `3.9.0`: another version
    /// may compute other bits. Recordings contain it.
    pub engine: Option<(&'static str, &'static str)>,
    /// Its own names for some knobs, such as `control-hz` for `rate policy`.
    pub aliases: &'static [Alias],
    /// The function of nodes in a few words that begin with the verb, such as `sensor` and
    /// `reads the plant`.
    pub captions: &'static [(&'static str, &'static str)],
    /// A knob that makes runs fail, as text, such as `control-hz 5`: the setting of `--break`.
    pub broken: Option<&'static str>,
    /// The topics whose messages are joint states for other robot software.
    pub joints: &'static [Joints],
    /// The table format of its states, if it differs from run time and numbers.
    pub table: Option<StateTable>,
    /// The quadratic cost of its states: it rates runs that are not lost.
    pub quadratic_cost: Option<QuadraticCost>,
    /// Its settings. The settings of a run replace them.
    pub settings: &'s [Knob],
    /// The rates that follow others.
    pub dividers: &'s [Divider],
    /// The text of its [graph file](crate::graph_file). Recordings contain it.
    pub graph_file: Option<&'s str>,
    /// The robot in its middle that moves by itself. Recordings contain it.
    pub plant: Option<&'s PlantRecord>,
    /// Its chains, whose data ages are on the topic [`CHAINS`](super::CHAINS): they count in the
    /// verdict.
    pub chains: &'s [DataChain],
    /// The limits for figures of its runs.
    pub limits: &'s [FigureLimit],
    /// Where its plans are, if it plans ahead.
    pub planning: Option<Planning>,
    /// Parameters that may spoil a run, the worst first.
    pub spoilers: &'static [Spoiler],
    /// Node and name of the parameters that count for a whole run.
    pub fixed: &'static [[&'static str; 2]],
    /// The topics on the way of the data to the node of its latency, the sensor first; empty if
    /// the origin of each message tells it.
    pub latency_path: &'s [String],
}

/// Nodes that share something beside topics.
#[derive(Clone, Debug)]
pub struct Group {
    /// Name of the group, such as `plant`.
    pub name: String,
    /// Names of its nodes. A run may lack some of them.
    pub nodes: Vec<String>,
}

impl Group {
    /// Creates the group called `name` of these nodes.
    pub fn new(name: impl Into<String>, nodes: impl IntoIterator<Item: Into<String>>) -> Self {
        Self {
            name: name.into(),
            nodes: nodes.into_iter().map(Into::into).collect(),
        }
    }
}

/// The format of a system's states as comma-separated values, for systems with a format
/// of their own.
#[derive(Clone, Copy, Debug)]
pub struct StateTable {
    /// Comma-separated names of the columns.
    pub header: &'static str,
    /// Writes a row from run time and state.
    pub row: fn(Time, &[f64]) -> String,
    /// Comma-separated names of columns that stand behind all others.
    pub more: &'static str,
    /// Writes the cells of these columns from a state.
    pub more_cells: fn(&[f64]) -> String,
}

/// A parameter that may spoil a run, with the value that does not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Spoiler {
    /// Its node.
    pub node: &'static str,
    /// Its name.
    pub name: &'static str,
    /// Its value in a run with plans that sets none.
    pub usual: &'static str,
    /// The value that spoils nothing.
    pub sound: &'static str,
    /// What any other value does, with `{}` for that.
    pub told: &'static str,
}

impl About<'_> {
    /// Whether `knob` counts for a whole run: it cannot be turned while that goes on.
    pub fn is_fixed(&self, knob: &Knob) -> bool {
        matches!(knob, Knob::Parameter { node, name, .. } if self.fixed.contains(&[&**node, &**name]))
    }

    /// The function of `node`.
    pub fn caption(&self, node: &str) -> Option<&'static str> {
        let mut captions = self.captions.iter();
        captions.find(|(of, _)| *of == node).map(|(_, text)| *text)
    }

    /// Its settings as the knobs of a run.
    pub fn setup(&self) -> Setup {
        self.settings.iter().cloned().collect()
    }

    /// What follows from `knob` for other nodes.
    pub fn followers(&self, knob: &Knob) -> impl Iterator<Item = Knob> {
        let dividers = self.dividers.iter();
        dividers.filter_map(move |divider| divider.follow(knob))
    }
}
