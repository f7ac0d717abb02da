//! The content of a graph file, from its sections.

use std::time::Duration;

use ratelab::{Callback, Hz, Knob, KnobKind, Match, Release, SettingError, Time, TimedKnob};

use super::{
    ChainSpec, GraphFile, HeaderStamp, InnerSpec, MOST_PARTS, NodeSpec, PlacedEvent, PlacedKnob,
    document::Block,
    error::{
        Checked, GraphRefusal, Placed, holds, instead, line_and_column, name, node_of, once,
        refuse, topic_name, unknown,
    },
    executors,
    format::{PATH, TOPICS},
    plant::{PLANT, PlantSpec},
};
use crate::{BagAges, Bound, DataChain, Divider, FigureLimit, Limit, MAX_CHAINS, figure_name};

/// Checks the sections of `text`.
pub(super) fn check(text: &str, blocks: &[Block]) -> Checked<GraphFile> {
    let of = |kind: &'static str| {
        blocks
            .iter()
            .filter(move |block| block.section.name == kind)
    };
    let mut file = head(text, blocks)?;
    for block in of("node") {
        let divided = divided_rate(block, of("node"))?;
        let node = node(
            block,
            divided.as_ref().map(|(_, hz)| *hz),
            &mut file.settings,
        )?;
        file.nodes.push(node);
        file.dividers.extend(divided.map(|(divider, _)| divider));
    }
    for block in of("clock") {
        let clocks = simulated_clocks(block, &file)?;
        file.settings.extend(clocks);
        file.clock_hz = block.number("rate");
    }
    for block in of("system") {
        file.inner = Some(inner(block)?);
    }
    for block in of(PLANT) {
        let (plant, inner) = PlantSpec::read(block)?;
        if file.inner.replace(inner).is_some() {
            return refuse(
                block.name.at,
                "a graph has a system or a plant: leave one out",
            );
        }
        file.plant = Some(plant);
    }
    size(&file, of("chain").count())?;
    // One without a list gets the nodes that the others leave.
    let listed = |listed: bool| of("executor").filter(move |e| e.at("nodes").is_some() == listed);
    for block in listed(true).chain(listed(false)) {
        let executor = executors::executor(block, &file)?;
        file.executors.push(executor);
    }
    for (block, node) in of("node").zip(&file.nodes) {
        executors::placement(block, node, &file)?;
    }
    for block in of("topic") {
        topic(block, &mut file)?;
    }
    for block in of("chain") {
        let chain = chain(block, &file)?;
        file.chains.push(chain);
    }
    file.limits = of("limit").filter_map(|block| limit(text, block)).collect();
    whole(&file)?;
    Ok(file)
}

/// Returns what stands before all sections.
fn head(text: &str, blocks: &[Block]) -> Checked<GraphFile> {
    let mut file = GraphFile {
        text: text.to_owned(),
        ..GraphFile::default()
    };
    if let Some(top) = blocks.first() {
        if let Some(own) = top.text("name") {
            name(own)?;
            file.name.clone_from(&own.text);
        }
        file.events = events(top)?;
    }
    Ok(file)
}

fn topics(block: &Block, key: &str) -> Checked<Vec<Placed>> {
    let topics = block.list(key);
    for (index, topic) in topics.iter().enumerate() {
        topic_name(topic)?;
        once(key, topic, &topics[..index])?;
    }
    Ok(topics.to_vec())
}

/// Returns what the section `at` has happen during a run.
fn events(top: &Block) -> Checked<Vec<PlacedEvent>> {
    let events = top.list("at").chunks_exact(2).map(|pair| {
        let [time, knob] = [&pair[0], &pair[1]];
        let seconds: Option<f64> = time.text.trim().parse().ok();
        let at = seconds.and_then(|seconds| Time::from_secs_f64(seconds).ok());
        let Some(at) = at else {
            let what = format!("at: {:?} is not a time: expected seconds", time.text);
            return refuse(time.at, what);
        };
        match knob.text.trim().parse() {
            Ok(parsed) => Ok(PlacedEvent {
                event: TimedKnob { at, knob: parsed },
                at: knob.at,
            }),
            Err(why) => refuse(knob.at, format!("at: {why}")),
        }
    });
    events.collect()
}

/// Returns the settings in `block`, as knobs.
fn settings(block: &Block) -> Checked<Vec<PlacedKnob>> {
    let mut knobs = Vec::new();
    let is_divided = |kind, text: &str| kind == KnobKind::Rate && divider(block, text).is_some();
    for (key, kind, Placed { text, at }) in block.knobs() {
        if is_divided(kind, text) {
            continue;
        }
        let refused = |why: String| GraphRefusal::new(*at, why);
        let knob = kind
            .set(&block.name.text, text.trim())
            .map_err(|error| refused(format!("{key}: {error}")))?;
        knobs.push(PlacedKnob { knob, at: *at });
    }
    Ok(knobs)
}

fn divider(block: &Block, text: &str) -> Option<Divider> {
    Divider::parse(&block.name.text, text)
}

/// Returns the divider of a node whose rate is a fraction of that of one of the `nodes`, and the
/// rate.
fn divided_rate<'b>(
    block: &Block,
    nodes: impl Iterator<Item = &'b Block> + Clone,
) -> Checked<Option<(Divider, Hz)>> {
    let rate = block.text("rate");
    let divided = rate.and_then(|rate| Some((divider(block, &rate.text)?, rate)));
    let Some((divider, Placed { text, at })) = divided else {
        return Ok(None);
    };
    let Some(other) = nodes.clone().find(|node| node.name.text == divider.of) else {
        let names = nodes.map(|node| &*node.name.text);
        return unknown("rate: no node", &Placed::new(&divider.of, *at), names);
    };
    let hz = other.number("rate").and_then(|hz| Hz::new(hz).ok());
    match hz.and_then(|hz| divider.rate(hz)) {
        Some(hz) => Ok(Some((divider, hz))),
        None => refuse(
            *at,
            format!(
                "rate: {text:?} is not a rate: expected NODE / N, of a node whose rate is a number"
            ),
        ),
    }
}

/// Returns a node, with its rate if that is `divided`; its knobs go to `all`.
fn node(block: &Block, divided: Option<Hz>, all: &mut Vec<PlacedKnob>) -> Checked<NodeSpec> {
    name(&block.name)?;
    let mut knobs = settings(block)?;
    knobs.extend(divided.map(|hz| {
        let node = block.name.text.clone();
        let at = block.at("rate").unwrap_or_default();
        PlacedKnob {
            knob: Knob::Rate { node, hz },
            at,
        }
    }));
    let rate = knobs.iter().find_map(|placed| match &placed.knob {
        Knob::Rate { hz, .. } => Some(*hz),
        _ => None,
    });
    all.extend(knobs);
    let (triggers, reads) = (topics(block, "trigger")?, topics(block, "reads")?);
    if let Some(topic) = reads.iter().find(|topic| holds(&triggers, &topic.text)) {
        let what = format!("{:?} triggers the node, which reads it", topic.text);
        return refuse(topic.at, format!("{what}: leave it out"));
    }
    let release = match (rate, block.at("match")) {
        (None, _) => matching(block, &triggers)?.into(),
        (Some(hz), None) => Release::AtRate(hz),
        (Some(_), Some(at)) => {
            let what = format!("{:?} ticks at a rate: leave match out", block.name.text);
            return refuse(at, what);
        }
    };
    if let (Some(_), Some(at)) = (rate, block.at("every")) {
        let what = format!("{:?} ticks at a rate: leave every out", block.name.text);
        return refuse(at, what);
    }
    for other in block.list("or") {
        if let Err(why) = format!("or = {{ {} }}", other.text).parse::<toml::Table>() {
            let what = format!("or: {:?} has no keys: {}", other.text, why.message());
            return refuse(other.at, what);
        }
    }
    let only_new = block.text("only_new").filter(|flag| flag.text == "true");
    if let Some(flag) = only_new.filter(|_| reads.is_empty()) {
        let what = format!("{:?} reads nothing: leave only_new out", block.name.text);
        return refuse(flag.at, what);
    }
    Ok(NodeSpec {
        name: block.name.text.clone(),
        at: block.name.at,
        release,
        priority: block.number("priority").map(|number| number as u32),
        stamp: HeaderStamp::read(block, triggers.iter().chain(&reads))?,
        triggers,
        reads,
        publishes: topics(block, "publishes")?,
        only_new: only_new.is_some(),
        callback: callback(block)?,
    })
}

/// Returns the clocks of nodes that get the time from messages, except nodes with a clock of their
/// own.
fn simulated_clocks(block: &Block, file: &GraphFile) -> Checked<Vec<PlacedKnob>> {
    let period = block.number("rate").map_or(0.0, |hz| 1e9 / hz);
    let error = format!("0 0 {}", period.round() / 1e6);
    let has_own = |node: &NodeSpec| {
        let mut settings = file.settings.iter().map(|placed| &placed.knob);
        settings.any(|knob| knob.kind() == KnobKind::Clock && knob.target() == node.name)
    };
    let nodes = file.nodes.iter().filter(|node| !has_own(node));
    let at = block.at("rate").unwrap_or_default();
    let clock = |node: &NodeSpec| {
        KnobKind::Clock
            .set(&node.name, &error)
            .map(|knob| PlacedKnob { knob, at })
            .or_else(|_| refuse(at, "rate: expected 0.001 to 1000000".to_owned()))
    };
    nodes.map(clock).collect()
}

/// Returns how the messages of the `triggers` of a node are combined.
fn matching(block: &Block, triggers: &[Placed]) -> Checked<Match> {
    let name = &block.name.text;
    if let (true, Some(at)) = (triggers.is_empty(), block.at("trigger")) {
        let expected = TOPICS.expected();
        return refuse(at, format!("trigger: no topic: expected {expected}"));
    }
    let mut timers = ["offset", "late", "only_new"].into_iter();
    if let Some((key, at)) = timers.find_map(|key| Some((key, block.at(key)?))) {
        let what = format!("messages trigger {name:?}: leave {key} out");
        return refuse(at, what);
    }
    let every = block.text("every");
    let parsed: Result<Match, SettingError> = match (block.text("match"), every) {
        (None, None) => return Ok(Match::Each),
        (Some(matching), None) => {
            let parsed = matching.text.parse();
            return parsed.or_else(|error| refuse(matching.at, format!("match: {error}")));
        }
        (Some(_), Some(every)) => {
            let what = format!("{name:?} has both match and every: leave one of them out");
            return refuse(every.at, what);
        }
        (None, Some(every)) => format!("every:{}", every.text).parse(),
    };
    let at = every.map_or(0, |every| every.at);
    parsed.or_else(|_| refuse(at, "every: expected a whole number from 1 on".to_owned()))
}

fn callback(block: &Block) -> Checked<Callback> {
    let mut callback = Callback::new(&*block.name.text);
    if let Some(group) = block.text("group") {
        name(group)?;
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

fn size(file: &GraphFile, chains: usize) -> Checked {
    let ends = |node: &NodeSpec| 1 + node.inputs().count() + 2 * node.publishes.len();
    let parts = file.nodes.iter().map(ends).sum::<usize>() + 2 * chains;
    let what = if parts > MOST_PARTS {
        format!(
            "the graph has {parts} parts (nodes, topics, their ends, chains): expected up to \
             {MOST_PARTS}"
        )
    } else if chains > MAX_CHAINS {
        format!("{chains} chains: expected up to {MAX_CHAINS}")
    } else if file.nodes.is_empty() && file.plant.is_none() {
        "the graph has no nodes: add a section such as [node.camera]".to_owned()
    } else {
        return Ok(());
    };
    refuse(0, what)
}

fn topic(block: &Block, file: &mut GraphFile) -> Checked {
    let name = &block.name;
    topic_name(name)?;
    let alone = file.inner.is_none();
    if alone {
        publisher(file, name)?;
    }
    let knobs = settings(block)?;
    let mut inputs = file.nodes.iter().flat_map(NodeSpec::inputs);
    let unread = alone && !inputs.any(|input| input.text == name.text);
    let mut of_readers = knobs.iter();
    let of_readers = of_readers.find(|placed| placed.knob.kind() != KnobKind::Depth);
    if let Some(PlacedKnob { knob, at }) = of_readers.filter(|_| unread) {
        let key = knob.kind().name();
        let what = format!("{:?} has no reader: leave {key} out", name.text);
        return refuse(*at, what);
    }
    file.settings.extend(knobs);
    file.topics.push(name.clone());
    Ok(())
}

/// Checks that a node publishes `topic`.
fn publisher(file: &GraphFile, topic: &Placed) -> Checked {
    if file.published().any(|known| known == topic.text) {
        return Ok(());
    }
    // Its own outputs are of no use to a node.
    let reads = |node: &&NodeSpec| node.inputs().any(|input| input.at == topic.at);
    let published = file
        .nodes
        .iter()
        .filter(|node| !reads(node))
        .flat_map(|node| &node.publishes)
        .map(|topic| &*topic.text);
    unknown("no node publishes", topic, published)
}

fn inner(block: &Block) -> Checked<InnerSpec> {
    Ok(InnerSpec {
        name: block.text("name").unwrap_or(&block.name).clone(),
        remap: remap(block)?,
    })
}

/// Topics of a system, each with the topic that is read in its place.
pub(super) fn remap(block: &Block) -> Checked<Vec<(Placed, Placed)>> {
    let remap = block.list("remap");
    remap.iter().try_for_each(topic_name)?;
    let pairs = remap
        .chunks_exact(2)
        .map(|pair| (pair[0].clone(), pair[1].clone()));
    Ok(pairs.collect())
}

fn chain(block: &Block, file: &GraphFile) -> Checked<ChainSpec> {
    name(&block.name)?;
    let Placed { text: name, at } = &block.name;
    let mut names = file.chains.iter().map(|spec| spec.chain.name());
    if let Some(like) = names.find(|known| figure_name(known) == figure_name(name)) {
        let what = format!("{name:?} is too much like {like:?}: choose another name");
        return refuse(*at, what);
    }
    let path = path(block, file)?;
    let share = block.number("share");
    let limit = block.number("age_ms").map(|ms| Limit {
        age: duration(ms),
        share: share.unwrap_or(1.0),
    });
    if let (Some(_), None) = (share, limit) {
        let what = format!("chain {name:?} has a share without a limit: add age_ms");
        return refuse(*at, what);
    }
    let names = path.iter().map(|place| &*place.text);
    let mut chain = DataChain::new(name, file.chains.len(), names, limit);
    chain.bag = bag_ages(block)?;
    Ok(ChainSpec { chain, path })
}

/// Returns the ages that a bag had.
fn bag_ages(block: &Block) -> Checked<Option<BagAges>> {
    let Some(mean_ms) = block.number("bag_mean_ms") else {
        let others = ["bag_p99_ms", "unsure", "open"].into_iter();
        return match others.filter_map(|key| Some((key, block.at(key)?))).next() {
            Some((key, at)) => refuse(at, format!("{key} without bag_mean_ms: add that")),
            None => Ok(None),
        };
    };
    Ok(Some(BagAges {
        mean_ms,
        p99_ms: block.number("bag_p99_ms"),
        unsure: block.text("unsure").map(|why| why.text.clone()),
        open: block.text("open").map(|why| why.text.clone()),
    }))
}

/// Returns the limit of a figure, which has one bound.
fn limit(text: &str, block: &Block) -> Option<FigureLimit> {
    let most = block.number("at_most").map(Bound::AtMost);
    Some(FigureLimit {
        figure: block.name.text.clone(),
        bound: most.or(block.number("at_least").map(Bound::AtLeast))?,
        place: line_and_column(text, block.name.at),
    })
}

fn path(block: &Block, file: &GraphFile) -> Checked<Vec<Placed>> {
    let path = block.list("path");
    let [first, _, ..] = path else {
        let expected = PATH.expected();
        let what = format!("chain {:?} has no way to go: {expected}", block.name.text);
        return refuse(block.name.at, what);
    };
    for (index, place) in path.iter().enumerate() {
        if holds(&path[..index], &place.text) {
            let what = format!("{:?} is in the path twice: end it before", place.text);
            return refuse(place.at, what);
        }
    }
    for pair in path.windows(2) {
        step(file, &pair[0], &pair[1])?;
    }
    if first.is_topic() {
        let what = format!("a path begins with a node, not with {:?}", first.text);
        return refuse(first.at, what);
    }
    Ok(path.to_vec())
}

/// Checks one step of a path: from a node to a topic that it publishes, or from a topic to
/// a node that reads it. Nodes and topics of a system are checked when it is known.
fn step(file: &GraphFile, from: &Placed, to: &Placed) -> Checked {
    let (node, topic) = if from.is_topic() {
        (to, from)
    } else {
        (from, to)
    };
    if topic.is_topic() == node.is_topic() {
        let what = format!("{:?} follows {:?}", to.text, from.text);
        let rule = "nodes and topics take turns in a path";
        return refuse(to.at, format!("{what}: {rule}"));
    }
    let Some(known) = node_of(file, node)? else {
        return Ok(());
    };
    let (topics, verb): (Vec<&Placed>, _) = if to.is_topic() {
        (known.publishes.iter().collect(), "publish")
    } else {
        (known.inputs().collect(), "read")
    };
    if topics.iter().any(|known| known.text == topic.text) {
        return Ok(());
    }
    let instead = instead(&topic.text, topics.iter().map(|topic| &*topic.text));
    let what = format!("{} does not {verb} {:?}: {instead}", node.text, topic.text);
    refuse(to.at, what)
}

/// Checks the graph as a whole.
fn whole(file: &GraphFile) -> Checked {
    if let Some((topic, circle)) = file.trigger_circle() {
        let remedy = "let one of them tick at a rate";
        let what = format!("nodes trigger each other in a circle: {circle}; {remedy}");
        return refuse(topic.at, what);
    }
    if file.inner.is_some() {
        return Ok(());
    }
    file.nodes
        .iter()
        .flat_map(NodeSpec::inputs)
        .try_for_each(|topic| publisher(file, topic))
}

/// Returns a duration of `ms` milliseconds.
fn duration(ms: f64) -> Duration {
    Duration::from_nanos((ms * 1e6).round() as u64)
}
