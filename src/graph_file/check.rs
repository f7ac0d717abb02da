//! The content of a graph file, from its sections.

use std::time::Duration;

use super::{
    CHAINS, ChainSpec, GraphFile, InnerSpec, Limit, MOST_CHAINS, MOST_PARTS, NodeSpec,
    document::{Block, Placed},
    error::{GraphFileError, instead},
    format::Form,
};
use crate::runtime::{Hz, Knob, KnobKind};

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
        chains: Vec::new(),
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

struct Checker<'t> {
    text: &'t str,
}

impl Checker<'_> {
    fn refuse(&self, at: usize, what: impl Into<String>) -> GraphFileError {
        GraphFileError::at(self.text, at, what)
    }

    /// Refuses a name that would be ambiguous in knobs, options and recordings.
    fn name(&self, name: &Placed) -> Result<(), GraphFileError> {
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
            let knob = kind.set(&block.name.text, text.trim());
            let knob = knob.map_err(|error| self.refuse(at, format!("{}: {error}", key.name)))?;
            if knob.draw().and_then(|draw| draw.missing()).is_some() {
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
        Ok(NodeSpec {
            name: block.name.text.clone(),
            at: block.name.at,
            hz: rate.unwrap_or(Hz::MIN),
            reads: self.topics(block, "reads")?,
            publishes: self.topics(block, "publishes")?,
        })
    }

    fn size(&self, file: &GraphFile, chains: usize) -> Result<(), GraphFileError> {
        let ends = |node: &NodeSpec| 1 + node.reads.len() + 2 * node.publishes.len();
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
        let ends = |topics: fn(&NodeSpec) -> &[Placed]| {
            let mut topics = file.nodes.iter().flat_map(topics);
            topics.any(|topic| topic.text == name.text)
        };
        let (published, read) = (ends(|node| &node.publishes), ends(|node| &node.reads));
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
        Ok(())
    }

    fn without_publisher(&self, file: &GraphFile, topic: &Placed) -> GraphFileError {
        let published = file.nodes.iter().flat_map(|node| &node.publishes);
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
        let key = super::system::key(name);
        if let Some(like) = file
            .chains
            .iter()
            .find(|chain| super::system::key(&chain.name) == key)
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
            age: Duration::from_nanos((ms * 1e6).round() as u64),
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
        let (topics, verb) = match std::ptr::eq(node, from) {
            true => (&known.publishes, "publish"),
            false => (&known.reads, "read"),
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
        if file.inner.is_some() {
            return Ok(());
        }
        let is_published = |topic: &Placed| {
            let mut published = file.nodes.iter().flat_map(|node| &node.publishes);
            published.any(|known| known.text == topic.text)
        };
        let mut read = file.nodes.iter().flat_map(|node| &node.reads);
        match read.find(|topic| !is_published(topic)) {
            Some(topic) => Err(self.without_publisher(file, topic)),
            None => Ok(()),
        }
    }
}
