//! Graphs as text files (TOML): nodes, topics, and chains with limits of their data age, run
//! without a line of code.
//!
//! ```text
//! text ──► document ──► check ──► GraphFile ──► GraphSystem: a System
//! ```
//!
//! ```
//! use std::sync::Arc;
//! use ratelab_experiment::{Config, Experiment};
//! use ratelab_system::graph_file::GraphFile;
//!
//! let text = r#"
//!     name = "robot"
//!     [node.camera]
//!     rate = 30
//!     takes = 20
//!     publishes = ["/image"]
//!     [node.control]
//!     rate = 10
//!     reads = ["/image"]
//!     publishes = ["/cmd"]
//!     [chain.see-to-act]
//!     path = ["camera", "/image", "control", "/cmd"]
//!     age_ms = 100
//! "#;
//! let system = GraphFile::parse(text)?.system(&[])?;
//! let summary = Experiment::new(Arc::new(system), &Config::default())?.run()?;
//! assert_eq!(summary.verdict.name(), "missed_see_to_act");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A node ticks at a rate or on messages, on a thread of its own or on a thread of an executor.
//! It reads its topics at the beginning of a tick and publishes a message on each of its
//! topics at the end of it. A message carries, for every chain that goes through its topic,
//! the run time at which the data began: the tick of the first node of the chain. A node
//! copies it from the message that it read last on the topic before in the chain, so data
//! ages are exact along the named path. Its header stamp is by the clock of a node, copied or its
//! own: a match compares it, and no age rests on it.

mod change;
mod check;
mod circles;
mod document;
mod error;
mod executors;
pub mod format;
mod insertion;
mod plant;
mod readings;
mod stamp;
mod system;
mod warnings;
mod wiring;

use std::fmt;

use ratelab::{Callback, Executor, Knob, Release, TimedKnob};

use crate::{DataChain, Divider, FigureLimit};

pub use change::{ChangeError, ChangedFile, KeyChange, changed, key_of};
pub use error::GraphFileError;
use error::{GraphRefusal, Placed, holds};
pub use plant::{InnerLoop, PLANT, PLANT_POLICIES, PlantSpec};
pub use readings::{BagReading, doubted, readings};
pub use system::GraphSystem;

/// The longest text (bytes).
pub const MOST_BYTES: usize = 1 << 20;

/// Maximum number of nodes, topics, ends of topics and chains together: a recording of the
/// graph stays readable.
pub const MOST_PARTS: usize = 1_000;

/// A graph file: its content, checked.
#[derive(Clone, Debug, Default)]
pub struct GraphFile {
    text: String,
    name: String,
    nodes: Vec<NodeSpec>,
    /// The settings of its nodes and topics.
    settings: Vec<PlacedKnob>,
    /// What happens during a run.
    events: Vec<PlacedEvent>,
    dividers: Vec<Divider>,
    /// The topics with settings.
    topics: Vec<Placed>,
    chains: Vec<ChainSpec>,
    limits: Vec<FigureLimit>,
    executors: Vec<ExecutorSpec>,
    inner: Option<InnerSpec>,
    /// The plant in its middle, if that is the system there.
    plant: Option<PlantSpec>,
    /// The messages per second of the simulator's clock; `None` without such a clock.
    clock_hz: Option<f64>,
}

/// A setting with its place in the file.
#[derive(Clone, Debug)]
struct PlacedKnob {
    knob: Knob,
    at: usize,
}

/// Something that happens during a run, with the place of its knob in the file.
#[derive(Clone, Debug)]
struct PlacedEvent {
    event: TimedKnob,
    at: usize,
}

/// A node in a graph file.
#[derive(Clone, Debug)]
struct NodeSpec {
    name: String,
    at: usize,
    release: Release,
    /// Its place among nodes that are due together, if it is set.
    priority: Option<u32>,
    /// The topics that trigger it.
    triggers: Vec<Placed>,
    /// The other topics that it reads.
    reads: Vec<Placed>,
    publishes: Vec<Placed>,
    stamp: HeaderStamp,
    /// Whether it publishes only what it made of something new.
    only_new: bool,
    /// The node as its executor knows it.
    callback: Callback,
}

impl NodeSpec {
    /// Returns all topics that it reads, first the ones that trigger it.
    fn inputs(&self) -> impl Iterator<Item = &Placed> {
        self.triggers.iter().chain(&self.reads)
    }

    fn publishes(&self, topic: &str) -> bool {
        holds(&self.publishes, topic)
    }
}

/// Whose header stamp the messages of a node have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum HeaderStamp {
    /// What the clock of the node shows as its tick begins.
    Now,
    /// That of the message that it read last on the input with this number.
    Of(usize),
}

/// An executor in a graph file.
#[derive(Clone, Debug)]
struct ExecutorSpec {
    name: String,
    kind: Executor,
    /// Its nodes, in the order of registration.
    nodes: Vec<Placed>,
}

/// A chain in a graph file.
#[derive(Clone, Debug)]
struct ChainSpec {
    chain: DataChain,
    path: Vec<Placed>,
}

impl ChainSpec {
    fn place(&self, name: &str) -> Option<usize> {
        self.path.iter().position(|place| place.text == name)
    }
}

/// The system in the middle of a graph file.
#[derive(Clone, Debug)]
struct InnerSpec {
    name: Placed,
    /// Topics of the system, each with the topic that is read in its place.
    remap: Vec<(Placed, Placed)>,
}

impl GraphFile {
    /// Reads a graph from `text`.
    ///
    /// # Errors
    /// [`GraphFileError`] with the place of the first error.
    pub fn parse(text: &str) -> Result<Self, GraphFileError> {
        let blocks = match text.len() {
            ..=MOST_BYTES => document::read(text),
            bytes => error::refuse(0, format!("{bytes} bytes: expected up to {MOST_BYTES}")),
        };
        blocks
            .and_then(|blocks| check::check(text, &blocks))
            .map_err(|refusal| refusal.in_text(text))
    }

    /// This graph with its settings and events as `change` returns them, such as with measured durations
    /// that were loaded.
    ///
    /// # Errors
    /// [`GraphFileError`] with the first error of `change`, and the place of the setting.
    pub fn map_settings<E: fmt::Display>(
        mut self,
        mut change: impl FnMut(Knob) -> Result<Knob, E>,
    ) -> Result<Self, GraphFileError> {
        let settings = self.settings.iter_mut().map(|of| (&mut of.knob, of.at));
        let events = self.events.iter_mut().map(|of| (&mut of.event.knob, of.at));
        for (knob, at) in settings.chain(events) {
            match change(knob.clone()) {
                Ok(changed) => *knob = changed,
                Err(why) => {
                    let what = format!("{}: {why}", knob.kind().name());
                    return Err(GraphRefusal::new(at, what).in_text(&self.text));
                }
            }
        }
        Ok(self)
    }

    /// Returns the name of the graph.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the node called `name`.
    fn node(&self, name: &str) -> Option<&NodeSpec> {
        self.nodes.iter().find(|node| node.name == name)
    }

    /// Returns the names of its nodes.
    fn names(&self) -> impl Iterator<Item = &str> + Clone {
        self.nodes.iter().map(|node| &*node.name)
    }

    /// Returns the names of the topics that its nodes publish.
    fn published(&self) -> impl Iterator<Item = &str> + Clone {
        let topics = self.nodes.iter().flat_map(|node| &node.publishes);
        topics.map(|topic| &*topic.text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A graph of two nodes, with `extra` keys in the second.
    fn graph(extra: &str) -> String {
        let control = "[node.control]\nreads = [\"/image\"]\npublishes = [\"/cmd\"]";
        let camera = "[node.camera]\nrate = 30\ntakes = 20\npublishes = [\"/image\"]";
        format!("name = \"robot\"\n{camera}\n{control}\n{extra}\n")
    }

    #[test]
    fn settings_of_nodes_and_topics_are_knobs_in_the_order_of_the_file() {
        for (extra, expected) in [
            ("rate = 10", "rate control 10"),
            (
                "rate = 10\ntakes = \"5..9\"",
                "rate control 10; takes control 5..9",
            ),
            ("rate = \"camera / 4\"", "rate control 7.5"),
            (
                "rate = 10\n[topic.\"/image\"]\ndepth = 3",
                "rate control 10; depth /image 3",
            ),
            (
                "rate = 10\n[clock]\nrate = 100",
                "rate control 10; clock camera 0 0 10; clock control 0 0 10",
            ),
        ] {
            let file = GraphFile::parse(&graph(extra)).expect(extra);
            let knobs = file.settings.iter().map(|placed| placed.knob.to_string());
            let found: Vec<String> = knobs.collect();
            let of_camera = "rate camera 30; takes camera 20";
            assert_eq!(
                found.join("; "),
                format!("{of_camera}; {expected}"),
                "{extra}"
            );
        }
    }

    #[test]
    fn a_setting_that_is_refused_is_told_with_its_place() {
        for (extra, line, column, what) in [
            ("rate = 0", 9, 8, "rate"),
            (
                "rate = 10\ntakes = \"fast\"",
                10,
                9,
                "takes: \"fast\" is not a duration",
            ),
            (
                "rate = \"cam / 4\"",
                9,
                8,
                "rate: no node \"cam\": did you mean \"camera\"?",
            ),
            (
                "rate = 10\nmatch = \"each\"",
                10,
                9,
                "\"control\" ticks at a rate: leave match out",
            ),
            (
                "trigger = [\"/image\"]",
                9,
                1,
                "\"/image\" triggers the node",
            ),
            ("rate = 10\nlate = \"soon\"", 10, 8, "late: "),
        ] {
            let error = GraphFile::parse(&graph(extra)).expect_err(extra);
            assert!(error.what.contains(what), "{extra}: {error}");
            let place = (error.line, error.column);
            assert!(
                place == (line, column) || what.contains("triggers"),
                "{extra}: {error}"
            );
        }
    }

    #[test]
    fn a_change_of_a_setting_that_fails_has_the_place_of_that_setting() {
        let file = GraphFile::parse(&graph("rate = 10")).expect("a graph");
        let refuse_takes = |knob: Knob| match knob {
            Knob::Takes { .. } => Err("no such file"),
            knob => Ok(knob),
        };
        let error = file.map_settings(refuse_takes).expect_err("a refusal");
        assert_eq!(error.to_string(), "line 4, column 9: takes: no such file");
    }
}
