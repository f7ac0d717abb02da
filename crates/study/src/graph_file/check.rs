//! The content of a graph file, from its sections.

use std::time::Duration;

use ratelab::{Hz, Knob, KnobKind, Release};
use ratelab_effects::{Callback, Draw, Match, draw, knob};

use super::{
    CHAINS, ChainSpec, GraphFile, InnerSpec, Limit, MOST_CHAINS, MOST_PARTS, NodeSpec,
    document::{Block, Placed},
    error::{GraphFileError, instead},
    format::Form,
};

/// The longest name (characters).
const LONGEST_NAME: usize = 64;

/// Checks the sections of `text`.
pub(super) fn check(text: &str, blocks: &[Block]) -> Result<GraphFile, GraphFileError> {
    let checker = Checker { text };
    let of = |kind: &'static str| {
        blocks
            .iter()
            .filter(move |block| block.section.name == kind)
    };
    let mut file = GraphFile {
        text: text.to_owned(),
        name: String::new(),
        nodes: Vec::new(),
        settings: Vec::new(),
        topics: Vec::new(),
        chains: Vec::new(),
        executors: Vec::new(),
        inner: None,
    };
    if let Some(name) = blocks.first().and_then(|top| top.text("name")) {
        checker.name(&name)?;
        file.name = name.text;
    }
    for block in of("node") {
        let node = checker.node(block, &mut file.settings)?;
        file.nodes.push(node);
    }
    checker.size(&file, of("chain").count())?;
    for block in of("system") {
        file.inner = Some(checker.inner(block)?);
    }
    // One without a list gets the nodes that the others leave.
    let listed = |listed: bool| of("executor").filter(move |e| e.at("nodes").is_some() == listed);
    for block in listed(true).chain(listed(false)) {
        let executor = checker.executor(block, &file)?;
        file.executors.push(executor);
    }
    for (block, node) in of("node").zip(&file.nodes) {
        checker.placement(block, node, &file)?;
    }
    for block in of("topic") {
        checker.topic(block, &mut file)?;
    }
    for block in of("chain") {
        let chain = checker.chain(block, &file)?;
        file.chains.push(chain);
    }
    checker.whole(&file)?;
    Ok(file)
}

pub(super) struct Checker<'t> {
    text: &'t str,
}

impl Checker<'_> {
    pub(super) fn refuse(&self, at: usize, what: impl Into<String>) -> GraphFileError {
        GraphFileError::at(self.text, at, what)
    }

    /// Refuses a name that would be ambiguous in knobs, options and recordings.
    pub(super) fn name(&self, name: &Placed) -> Result<(), GraphFileError> {
        let plain = |c: char| c.is_alphanumeric() || "_-.".contains(c);
        let fits = name.text.chars().all(plain)
            && name.text.starts_with(|c: char| c.is_alphanumeric())
            && name.text.chars().count() <= LONGEST_NAME;
        let expected = "expected letters, digits, _ and -, beginning with a letter or a digit";
        fits.then_some(())
            .ok_or_else(|| self.refuse(name.at, format!("{:?} is no name: {expected}", name.text)))
    }

    fn topic_name(&self, name: &Placed) -> Result<(), GraphFileError> {
        let parts = name.text.strip_prefix('/').map(|rest| rest.split('/'));
        let plain = |c: char| c.is_alphanumeric() || "_-".contains(c);
        let fits = name.text.chars().count() <= LONGEST_NAME
            && parts.is_some_and(|mut parts| {
                parts.all(|part| !part.is_empty() && part.chars().all(plain))
            });
        if name.text == CHAINS {
            let what = format!("{CHAINS} has the data ages: choose another name");
            return Err(self.refuse(name.at, what));
        }
        fits.then_some(()).ok_or_else(|| {
            let expected = "expected a slash, then letters, digits, _ and -, such as \"/image\"";
            self.refuse(name.at, format!("{:?} is no topic: {expected}", name.text))
        })
    }

    fn topics(&self, block: &Block, key: &str) -> Result<Vec<Placed>, GraphFileError> {
        let topics = block.list(key);
        for (index, topic) in topics.iter().enumerate() {
            self.topic_name(topic)?;
            if topics[..index].iter().any(|other| other.text == topic.text) {
                let what = format!("{key}: {:?} is there twice: leave one out", topic.text);
                return Err(self.refuse(topic.at, what));
            }
        }
        Ok(topics)
    }

    /// The settings in `block`, as knobs.
    fn settings(&self, block: &Block) -> Result<Vec<Knob>, GraphFileError> {
        let mut knobs = Vec::new();
        for (key, at, text) in block.knobs() {
            let Form::Knob(kind) = key.form else { continue };
            let knob = knob(kind, &block.name.text, text.trim());
            let knob = knob.map_err(|error| self.refuse(at, format!("{}: {error}", key.name)))?;
            let draw = draw(&knob).map_err(|why| self.refuse(at, why))?;
            if matches!(draw, Some(Draw::Recorded(_))) {
                let option = "measured durations are for the command line";
                let what = format!("{}: {option}: --knob \"{knob}\"", key.name);
                return Err(self.refuse(at, what));
            }
            knobs.push(knob);
        }
        Ok(knobs)
    }

    fn node(&self, block: &Block, settings: &mut Vec<Knob>) -> Result<NodeSpec, GraphFileError> {
        self.name(&block.name)?;
        let knobs = self.settings(block)?;
        let rate = knobs.iter().find_map(|knob| match knob {
            Knob::Rate { hz, .. } => Some(*hz),
            _ => None,
        });
        settings.extend(knobs);
        let (triggers, reads) = (self.topics(block, "trigger")?, self.topics(block, "reads")?);
        let twice = |topic: &&Placed| triggers.iter().any(|known| known.text == topic.text);
        if let Some(topic) = reads.iter().find(twice) {
            let what = format!(
                "{:?} triggers the node, which reads it: leave it out",
                topic.text
            );
            return Err(self.refuse(topic.at, what));
        }
        let release = match rate {
            Some(hz) => Release::Every(self.without_trigger(block, hz)?),
            None => self.matching(block, &triggers)?.into(),
        };
        Ok(NodeSpec {
            name: block.name.text.clone(),
            at: block.name.at,
            release,
            priority: block.number("priority").map(|number| number as u32),
            triggers,
            reads,
            publishes: self.topics(block, "publishes")?,
            callback: self.callback(block)?,
        })
    }

    /// The rate `hz` of a node that no message triggers.
    fn without_trigger(&self, block: &Block, hz: Hz) -> Result<Hz, GraphFileError> {
        let what = format!("{:?} ticks at a rate: leave match out", block.name.text);
        let at = block.at("match");
        at.map_or(Ok(hz), |at| Err(self.refuse(at, what)))
    }

    /// How the messages of the `triggers` of a node are combined.
    fn matching(&self, block: &Block, triggers: &[Placed]) -> Result<Match, GraphFileError> {
        let name = &block.name.text;
        if let (true, Some(at)) = (triggers.is_empty(), block.at("trigger")) {
            let expected = Form::Topics.expected();
            return Err(self.refuse(at, format!("trigger: no topic: expected {expected}")));
        }
        if let Some(at) = block.at("offset") {
            let what = format!("messages trigger {name:?}: leave offset out");
            return Err(self.refuse(at, what));
        }
        let Some(text) = block.text("match") else {
            return Ok(Match::Each);
        };
        let matching = text.text.parse();
        matching.map_err(|error: String| self.refuse(text.at, format!("match: {error}")))
    }

    fn callback(&self, block: &Block) -> Result<Callback, GraphFileError> {
        let mut callback = Callback::of(&*block.name.text);
        if let Some(group) = block.text("group") {
            self.name(&group)?;
            callback = match &*group.text {
                "reentrant" => callback.in_reentrant_group(),
                name => callback.in_group(name),
            };
        }
        Ok(match block.number("deadline_ms") {
            Some(ms) => callback.with_deadline(duration(ms)),
            None => callback,
        })
    }

    fn size(&self, file: &GraphFile, chains: usize) -> Result<(), GraphFileError> {
        let ends = |node: &NodeSpec| 1 + node.inputs().count() + 2 * node.publishes.len();
        let parts = file.nodes.iter().map(ends).sum::<usize>() + 2 * chains;
        let what = if parts > MOST_PARTS {
            format!(
                "the graph has {parts} parts (nodes, topics, their ends, chains): expected up to \
                 {MOST_PARTS}"
            )
        } else if chains > MOST_CHAINS {
            format!("{chains} chains: expected up to {MOST_CHAINS}")
        } else if file.nodes.is_empty() {
            "the graph has no nodes: add a section such as [node.camera]".to_owned()
        } else {
            return Ok(());
        };
        Err(self.refuse(0, what))
    }

    fn topic(&self, block: &Block, file: &mut GraphFile) -> Result<(), GraphFileError> {
        let name = &block.name;
        self.topic_name(name)?;
        let nodes = || file.nodes.iter();
        let is_it = |topic: &Placed| topic.text == name.text;
        let published = nodes().flat_map(|node| &node.publishes).any(is_it);
        let read = nodes().flat_map(NodeSpec::inputs).any(is_it);
        if !published && file.inner.is_none() {
            return Err(self.without_publisher(file, name));
        }
        let knobs = self.settings(block)?;
        let of_readers = knobs.iter().find(|knob| knob.kind() != KnobKind::Depth);
        if let Some(knob) = of_readers.filter(|_| !read && file.inner.is_none()) {
            let key = knob.kind().name();
            let what = format!("{:?} has no reader: leave {key} out", name.text);
            return Err(self.refuse(name.at, what));
        }
        file.settings.extend(knobs);
        file.topics.push(name.clone());
        Ok(())
    }

    fn without_publisher(&self, file: &GraphFile, topic: &Placed) -> GraphFileError {
        // Its own outputs are of no use to a node.
        let reads = |node: &&NodeSpec| node.inputs().any(|input| input.at == topic.at);
        let others = file.nodes.iter().filter(|node| !reads(node));
        let published = others.flat_map(|node| &node.publishes);
        let instead = instead(&topic.text, published.map(|topic| &*topic.text));
        self.refuse(
            topic.at,
            format!("no node publishes {:?}: {instead}", topic.text),
        )
    }

    fn inner(&self, block: &Block) -> Result<InnerSpec, GraphFileError> {
        let name = block.text("name").unwrap_or_else(|| block.name.clone());
        let remap = block.map("remap");
        for (from, to) in &remap {
            self.topic_name(from)?;
            self.topic_name(to)?;
        }
        Ok(InnerSpec { name, remap })
    }

    fn chain(&self, block: &Block, file: &GraphFile) -> Result<ChainSpec, GraphFileError> {
        self.name(&block.name)?;
        let name = &block.name.text;
        let key = super::judged::key(name);
        if let Some(like) = file
            .chains
            .iter()
            .find(|chain| super::judged::key(&chain.name) == key)
        {
            let what = format!(
                "{name:?} is too much like {:?}: choose another name",
                like.name
            );
            return Err(self.refuse(block.name.at, what));
        }
        let path = block.list("path");
        if path.len() < 2 {
            let expected = Form::Path.expected();
            let what = format!("chain {name:?} has no way to go: {expected}");
            return Err(self.refuse(block.name.at, what));
        }
        for (index, place) in path.iter().enumerate() {
            if path[..index].iter().any(|other| other.text == place.text) {
                let what = format!("{:?} is in the path twice: end it before", place.text);
                return Err(self.refuse(place.at, what));
            }
        }
        for step in path.windows(2) {
            self.step(file, &step[0], &step[1])?;
        }
        let first = &path[0];
        if first.text.starts_with('/') {
            let what = format!("a path begins with a node, not with {:?}", first.text);
            return Err(self.refuse(first.at, what));
        }
        let share = block.number("share");
        let limit = block.number("age_ms").map(|ms| Limit {
            age: duration(ms),
            share: share.unwrap_or(1.0),
        });
        if let (Some(_), None) = (share, limit) {
            let what = format!("chain {name:?} has a share without a limit: add age_ms");
            return Err(self.refuse(block.name.at, what));
        }
        Ok(ChainSpec {
            name: name.clone(),
            path,
            limit,
        })
    }

    /// Checks one step of a path: from a node to a topic that it publishes, or from a topic to
    /// a node that reads it. Nodes and topics of a system are checked when it is known.
    fn step(&self, file: &GraphFile, from: &Placed, to: &Placed) -> Result<(), GraphFileError> {
        let (node, topic) = match from.text.starts_with('/') {
            true => (to, from),
            false => (from, to),
        };
        if topic.text.starts_with('/') == node.text.starts_with('/') {
            let what = format!(
                "{:?} follows {:?}: nodes and topics take turns in a path",
                to.text, from.text
            );
            return Err(self.refuse(to.at, what));
        }
        let Some(known) = file.nodes.iter().find(|known| known.name == node.text) else {
            if file.inner.is_some() {
                return Ok(());
            }
            let instead = instead(&node.text, file.nodes.iter().map(|node| &*node.name));
            return Err(self.refuse(node.at, format!("no node {:?}: {instead}", node.text)));
        };
        let (topics, verb): (Vec<&Placed>, _) = match std::ptr::eq(node, from) {
            true => (known.publishes.iter().collect(), "publish"),
            false => (known.inputs().collect(), "read"),
        };
        if topics.iter().any(|known| known.text == topic.text) {
            return Ok(());
        }
        let instead = instead(&topic.text, topics.iter().map(|topic| &*topic.text));
        let what = format!("{} does not {verb} {:?}: {instead}", node.text, topic.text);
        Err(self.refuse(to.at, what))
    }

    /// Checks the graph as a whole.
    fn whole(&self, file: &GraphFile) -> Result<(), GraphFileError> {
        if let Err((topic, circle)) = file.trigger_order() {
            let remedy = "let one of them tick at a rate";
            let what = format!("nodes trigger each other in a circle: {circle}; {remedy}");
            return Err(self.refuse(topic.at, what));
        }
        if file.inner.is_some() {
            return Ok(());
        }
        let is_published = |topic: &Placed| {
            let mut published = file.nodes.iter().flat_map(|node| &node.publishes);
            published.any(|known| known.text == topic.text)
        };
        let mut read = file.nodes.iter().flat_map(NodeSpec::inputs);
        match read.find(|topic| !is_published(topic)) {
            Some(topic) => Err(self.without_publisher(file, topic)),
            None => Ok(()),
        }
    }
}

/// A duration of `ms` milliseconds.
fn duration(ms: f64) -> Duration {
    Duration::from_nanos((ms * 1e6).round() as u64)
}
