//! What can make data younger at a node or on a topic: the changes that advice runs and that causes
//! name.

use std::time::Duration;

use ratelab::{
    Cost, Depth, Draw, Hz, Knob, KnobKind, Link, NodeTopology, Overrun, ReadOrder, Topology, millis,
};
use ratelab_system::{
    Setup,
    graph_file::{GraphFile, KeyChange},
};

/// The parts of a cost or a delay that are tried in its place.
const PARTS: [u32; 3] = [2, 4, 8];

/// The significant digits of usual rates.
const RATES: [f64; 10] = [1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0];

/// The overrun policies that are tried.
const POLICIES: [&str; 3] = ["skip", "queue:1", "catch-up"];

/// Returns the value with which knobs of this `kind` have no effect; `None` where each has one.
fn no_effect(kind: KnobKind) -> Option<&'static str> {
    Some(match kind {
        KnobKind::Takes | KnobKind::Wakes | KnobKind::Link => "none",
        KnobKind::Hang | KnobKind::Offset => "0",
        KnobKind::Clock | KnobKind::StampClock => "0 0",
        KnobKind::Read => "newest",
        KnobKind::Restart => "",
        _ => return None,
    })
}

/// Returns the knob of this `kind` that takes the whole effect of such knobs on `target` away: for a
/// crash, its restart.
pub(crate) fn without(kind: KnobKind, target: &str) -> Option<Knob> {
    let text = format!("{} {target} {}", kind.name(), no_effect(kind)?);
    text.trim_end().parse().ok()
}

/// A change of a run: knobs, and keys of its graph file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AgeChange {
    /// The nodes and topics that it changes.
    pub of: Vec<String>,
    /// The knobs.
    pub knobs: Vec<Knob>,
    /// Changes of the graph file; see [`changed`](ratelab_system::graph_file::changed).
    pub with: Vec<String>,
}

impl AgeChange {
    /// Returns whether `whole` changes this, too.
    pub fn is_part_of(&self, whole: &Self) -> bool {
        let mut knobs = self.knobs.iter();
        knobs.all(|knob| whole.knobs.contains(knob))
            && self.with.iter().all(|with| whole.with.contains(with))
    }

    pub(crate) fn in_file(change: KeyChange) -> Self {
        Self {
            of: vec![change.about],
            knobs: Vec::new(),
            with: vec![change.with],
        }
    }

    /// Returns both changes.
    #[must_use]
    pub fn and(&self, other: &Self) -> Self {
        Self {
            of: [&self.of[..], &other.of].concat(),
            knobs: [&self.knobs[..], &other.knobs].concat(),
            with: [&self.with[..], &other.with].concat(),
        }
    }
}

/// A graph that may be changed.
pub(crate) struct Candidates<'g> {
    pub(crate) topology: &'g Topology,
    pub(crate) setup: &'g Setup,
    pub(crate) file: Option<GraphFile>,
}

impl Candidates<'_> {
    /// Returns the nodes with these names, and all nodes in their executors.
    pub(crate) fn beside(&self, names: &[&str]) -> Vec<usize> {
        let named = |name: &str| names.contains(&name);
        let nodes = self.topology.nodes.iter().enumerate().filter(|(_, node)| {
            let file = self.file.as_ref();
            named(&node.name) || file.is_some_and(|file| file.shares(&node.name, named))
        });
        nodes.map(|(index, _)| index).collect()
    }

    pub(crate) fn topic_changes(&self, topic: usize) -> Vec<AgeChange> {
        let topic = &self.topology.topics[topic];
        let mut changes = Vec::new();
        let mine = self.setup.iter().filter(|knob| knob.target() == topic.name);
        for knob in mine {
            match knob {
                Knob::Link { link, .. } => changes.extend(shorter_links(link)),
                Knob::Read { order, .. } if *order == ReadOrder::Oldest => {
                    changes
                        .extend(no_effect(KnobKind::Read).map(|value| ("read", value.to_owned())));
                }
                _ => {}
            }
        }
        if topic.depth > Depth::ONE {
            changes.push(("depth", Depth::ONE.to_string()));
        }
        knobs(&topic.name, changes)
    }

    pub(crate) fn node_changes(&self, index: usize) -> Vec<AgeChange> {
        let node = &self.topology.nodes[index];
        let mut changes = Vec::new();
        if node.triggers.is_empty() {
            let offset = self.setup.offset(&node.name);
            changes.extend(rates(node.hz).map(|hz| ("rate", hz.get().to_string())));
            let topics = self.topology.topics.iter();
            if topics.clone().any(|topic| topic.readers.contains(&index)) {
                changes.extend(offsets(node.hz, offset.unwrap_or_default()));
            }
        }
        if let Some(Knob::Takes { cost, .. }) = self.setup.knob(KnobKind::Takes, &node.name) {
            changes.extend(shorter_costs(cost));
            changes.extend(self.other_policies(node));
        }
        for kind in [KnobKind::Clock, KnobKind::StampClock] {
            let error = self.setup.knob(kind, &node.name).map(Knob::value);
            let right = no_effect(kind).filter(|right| error.is_some_and(|error| error != *right));
            changes.extend(right.map(|right| (kind.name(), right.to_owned())));
        }
        let mut changes = knobs(&node.name, changes);
        let of_file = self
            .file
            .iter()
            .flat_map(|file| file.changes_of(&node.name));
        changes.extend(of_file.map(AgeChange::in_file));
        changes
    }
}

impl Candidates<'_> {
    /// Other overrun policies of a node that ticks at a rate on a thread of its own.
    fn other_policies(&self, node: &NodeTopology) -> Vec<(&'static str, String)> {
        let timed = node.triggers.is_empty() && node.executor.is_none();
        let known = self
            .setup
            .knob(KnobKind::Late, &node.name)
            .map_or_else(|| Overrun::default().to_string(), |knob| knob.value());
        POLICIES
            .into_iter()
            .filter(|policy| timed && *policy != known)
            .map(|policy| ("late", policy.to_owned()))
            .collect()
    }
}

/// Returns the changes of the node or topic `target`, from kinds of knobs with their values.
fn knobs(target: &str, values: Vec<(&str, String)>) -> Vec<AgeChange> {
    let knobs = values.into_iter().filter_map(|(kind, value)| {
        let knob = format!("{kind} {target} {value}").parse().ok()?;
        Some(AgeChange {
            of: vec![target.to_owned()],
            knobs: vec![knob],
            with: Vec::new(),
        })
    });
    knobs.collect()
}

/// Returns twice the rate `hz`; `None` above all rates.
pub(crate) fn twice(hz: Hz) -> Option<Hz> {
    Hz::new(2.0 * hz.get()).ok()
}

/// Other rates than `hz`: half of it, the usual one below it, twice and five times as often.
fn rates(hz: Hz) -> impl Iterator<Item = Hz> {
    let hz = hz.get();
    let scale = 10_f64.powf(hz.log10().floor());
    let below = RATES.iter().chain(&[0.8]).map(|digits| digits * scale);
    let below = below
        .filter(|below| *below < hz * 0.99)
        .fold(hz / 2.0, f64::max);
    let others = [2.0 * hz, 5.0 * hz, hz / 2.0, below].into_iter();
    others.filter_map(|hz| Hz::new(hz).ok())
}

/// Returns the phases at which a node may tick too: a quarter, a half and three quarters later.
fn offsets(hz: Hz, offset: Duration) -> impl Iterator<Item = (&'static str, String)> {
    let period = hz.period().as_secs_f64() * 1e3;
    [0.25, 0.5, 0.75].into_iter().map(move |share| {
        let ms = (millis::to_millis(offset) + share * period) % period;
        ("offset", ((ms * 1e3).round() / 1e3).to_string())
    })
}

fn shorter(draw: &Draw, by: u32) -> Option<Draw> {
    Some(match draw {
        Draw::Constant(same) => Draw::Constant(*same / by),
        Draw::Uniform(from, to) => Draw::Uniform(*from / by, *to / by),
        Draw::Lognormal { median, p99 } => Draw::Lognormal {
            median: *median / by,
            p99: *p99 / by,
        },
        Draw::Measured(_) => return None,
    })
}

fn shorter_costs(cost: &Cost) -> impl Iterator<Item = (&'static str, String)> {
    PARTS.into_iter().filter_map(|by| {
        let draw = shorter(&cost.draw, by).filter(|draw| !draw.is_none())?;
        let busy = cost.busy;
        Some(("takes", Cost { draw, busy }.to_string()))
    })
}

fn shorter_links(link: &Link) -> impl Iterator<Item = (&'static str, String)> {
    PARTS.into_iter().filter_map(|by| {
        let shorter = Link {
            delay: shorter(&link.delay, by)?,
            loss: link.loss / f64::from(by),
            ..link.clone()
        };
        (shorter != *link).then(|| ("link", shorter.to_string()))
    })
}

/// Returns `last` and the nodes whose messages reach it, the nearest first.
pub fn upstream(topology: &Topology, last: usize) -> Vec<usize> {
    let mut path = vec![last];
    let mut next = 0;
    while let Some(&reader) = path.get(next) {
        let read = topology
            .topics
            .iter()
            .filter(|topic| topic.readers.contains(&reader));
        for node in read.flat_map(|topic| topic.publishers.iter().copied()) {
            if !path.contains(&node) {
                path.push(node);
            }
        }
        next += 1;
    }
    path
}
