//! All that a bag says: clocks, nodes, chains and their ages.

use std::collections::HashMap;

use crate::{
    ages::Ages,
    bag::{Bag, NO_STAMP},
    clocks::{Clocks, kept, slope},
    edges::{NamedEdge, apply},
    figures::TopicFigures,
    guesses::{Guess, guess},
    losses::put_back,
    node::{BagNode, Kind, NodeSearch},
    numbers::{MS, S, median, nearest, quantile},
    parallel::each,
    pauses::{Pause, moved, pauses},
    period::period,
    stamps::{MAX_RELATED, Relations, TopicEvents, is_stamped},
    threads::{NodeThreads, busy_until},
};

/// The most topics that are guessed about.
const MAX_GUESSED: usize = 200;

/// The time at which the data of a message began.
#[derive(Clone, Debug)]
struct RootClock {
    /// For each stamp of the root, when the data began (ns).
    begins: HashMap<i64, i64>,
    /// Between a stamp and that, where the root lacks it.
    usual: i64,
    is_shifted: bool,
    rate_ppm: f64,
}

/// A topic and the data in it, back to where it began.
#[derive(Clone, Debug)]
pub struct BagChain {
    /// The topic at its end.
    pub topic: usize,
    /// The topics from the root to it.
    pub path: Vec<usize>,
    /// How old the data is; `None` of too few messages.
    pub ages: Option<Ages>,
    /// Whether the stamps are of an unknown clock: ages count from the quickest message.
    pub is_from_quickest: bool,
    /// How much faster the stamps' clock runs (parts per million), if it is another time.
    pub rate_ppm: f64,
}

/// All that a bag says.
#[derive(Debug)]
pub struct Analysis {
    /// The names of the topics.
    pub names: Vec<String>,
    /// What each topic did.
    pub figures: Vec<TopicFigures>,
    /// The clocks.
    pub clocks: Clocks,
    /// When the recorder stood still.
    pub pauses: Vec<Pause>,
    /// The events of each topic, with what was put back.
    pub series: Vec<TopicEvents>,
    /// Which topics pass on whose data.
    pub relations: Relations,
    /// The nodes with stamps, by topic.
    pub nodes: Vec<BagNode>,
    /// Messages of each topic that were put back.
    pub filled: Vec<usize>,
    /// Groups of topics whose nodes share a thread.
    pub shared: Vec<Vec<usize>>,
    /// Pairs of topics whose nodes may share a thread: too few of their runs met to tell.
    pub may_share: Vec<(usize, usize)>,
    /// What may follow what, by timing alone.
    pub guesses: Vec<Guess>,
    /// The chains, by topic.
    pub chains: Vec<BagChain>,
    /// The greatest event (ns).
    pub end: i64,
    begins: HashMap<usize, RootClock>,
}

impl Analysis {
    /// Works out what `bag` says.
    pub fn new(bag: &Bag) -> Self {
        Self::with_edges(bag, &[])
    }

    /// Works out what `bag` says, where `edges` name what follows what though stamps are renewed.
    pub fn with_edges(bag: &Bag, edges: &[NamedEdge]) -> Self {
        let clocks = Clocks::new(bag);
        let pauses = pauses(bag);
        let mut series = all_series(bag, &clocks, &pauses);
        apply(&mut series, edges, clocks.least_transport);
        let ends = series.iter().filter_map(|series| series.events.last());
        let mut analysis = Self {
            names: bag.topics.iter().map(|topic| topic.name.clone()).collect(),
            figures: bag.topics.iter().map(TopicFigures::new).collect(),
            end: ends.copied().max().unwrap_or(0),
            filled: vec![0; bag.topics.len()],
            relations: Relations::default(),
            nodes: Vec::new(),
            shared: Vec::new(),
            may_share: Vec::new(),
            guesses: Vec::new(),
            chains: Vec::new(),
            begins: HashMap::new(),
            clocks,
            pauses,
            series,
        };
        analysis.find_nodes();
        analysis.find_threads();
        analysis.find_begins();
        analysis.find_guesses();
        analysis.find_chains();
        analysis
    }

    /// Returns what nodes are found in.
    pub fn found(&self) -> NodeSearch<'_> {
        NodeSearch {
            series: &self.series,
            relations: &self.relations,
            transport: self.clocks.least_transport,
        }
    }

    /// Returns the node that publishes a topic.
    pub fn node(&self, topic: usize) -> Option<&BagNode> {
        self.nodes.iter().find(|node| node.topic == topic)
    }

    /// Returns whether the node that publishes a topic shares its thread.
    pub fn shares_a_thread(&self, topic: usize) -> bool {
        self.shared.iter().any(|thread| thread.contains(&topic))
    }

    /// Returns the chain that ends with a topic.
    pub fn chain(&self, topic: usize) -> Option<&BagChain> {
        self.chains.iter().find(|chain| chain.topic == topic)
    }

    /// Finds the nodes, and puts back what the recorder lost of their inputs.
    fn find_nodes(&mut self) {
        let names = self.names.clone();
        const ROUNDS: usize = 2;
        let mut known = HashMap::new();
        for round in 0..=ROUNDS {
            self.relations = Relations::new(&self.series, &names);
            let is_leader = |topic: &usize| {
                self.series[*topic].is_stamped && self.relations.leaders[*topic] == *topic
            };
            let leaders: Vec<usize> = (0..self.series.len())
                .filter(is_leader)
                .take(MAX_RELATED)
                .collect();
            let found = self.found();
            let periods = each(&leaders, |topic| match known.get(topic) {
                Some(known) => *known,
                None => period(&self.series[*topic].events),
            });
            known.extend(leaders.iter().copied().zip(periods));
            self.nodes = each(&leaders, |topic| found.node(*topic, known[topic]));
            if round == ROUNDS {
                break;
            }
            let changed = put_back(&mut self.series, &self.nodes, &mut self.filled);
            if changed.is_empty() {
                break;
            }
            known.retain(|topic, _| !changed.contains(topic));
        }
    }

    /// Finds nodes that share a thread, and what their runs cost then.
    fn find_threads(&mut self) {
        let found = self.found();
        let runs: Vec<_> = self.nodes.iter().map(|node| found.runs(node)).collect();
        let NodeThreads {
            shared: groups,
            undecided,
        } = NodeThreads::new(&runs);
        let mut again = Vec::new();
        for group in &groups {
            let events = |place: &usize| &*self.series[self.nodes[*place].topic].events;
            let of_thread: Vec<&[i64]> = group.iter().map(events).collect();
            for place in group {
                let busy = busy_until(events(place), &of_thread);
                again.push((*place, found.again(&self.nodes[*place], &busy)));
            }
        }
        for (place, node) in again {
            self.nodes[place] = node;
        }
        let topic = |place: usize| self.nodes[place].topic;
        let undecided = undecided.into_iter();
        self.may_share = undecided
            .map(|(one, other)| (topic(one), topic(other)))
            .collect();
        let topics = |group: Vec<usize>| group.into_iter().map(|place| self.nodes[place].topic);
        self.shared = groups
            .into_iter()
            .map(|group| topics(group).collect())
            .collect();
    }

    /// Finds when the data of each root began.
    fn find_begins(&mut self) {
        let begins = self
            .nodes
            .iter()
            .filter(|node| node.kind == Kind::Sensor)
            .map(|node| (node.topic, self.root_clock(node.topic)));
        self.begins = begins.collect();
    }

    fn root_clock(&self, root: usize) -> RootClock {
        let (series, mapping) = (&self.series[root], self.clocks.mapping(root));
        let pairs: Vec<(i64, i64)> = series
            .events
            .iter()
            .copied()
            .zip(series.stamps.iter().copied())
            .filter(|(_, stamp)| *stamp != NO_STAMP)
            .collect();
        let ages: Vec<(i64, i64)> = pairs
            .iter()
            .map(|(e, s)| (*e, e.saturating_sub(*s)))
            .collect();
        let mut rate = 0.0;
        if !series.has_source && ages.len() >= 50 {
            rate = Some(slope(&ages))
                .filter(|slope| slope.abs() > 200e-6)
                .unwrap_or(0.0);
        }
        let first = series.events.first().copied().unwrap_or(0);
        let begin = |event: i64, stamp: i64| {
            let drift = nearest(rate * (event - first) as f64);
            kept(mapping.map(stamp, stamp).saturating_add(drift))
        };
        let mut begins: Vec<i64> = pairs
            .iter()
            .map(|(event, stamp)| begin(*event, *stamp))
            .collect();
        let mut ages: Vec<i64> = pairs
            .iter()
            .zip(&begins)
            .map(|((event, _), begin)| event.saturating_sub(*begin))
            .collect();
        let negative = ages.iter().filter(|age| **age < 0).count();
        let is_shifted = negative * 100 > ages.len() || median(ages.clone()) > (10 * S) as f64;
        if is_shifted {
            let shift = quantile(&mut ages, 1);
            begins
                .iter_mut()
                .for_each(|begin| *begin = kept(begin.saturating_add(shift)));
        }
        let differences = pairs
            .iter()
            .zip(&begins)
            .map(|((_, stamp), begin)| begin.saturating_sub(*stamp));
        let usual = nearest(median(differences.collect()));
        let firsts = pairs.iter().zip(&begins).rev();
        RootClock {
            begins: firsts.map(|((_, stamp), begin)| (*stamp, *begin)).collect(),
            usual,
            is_shifted,
            rate_ppm: rate * 1e6,
        }
    }

    /// Returns the topics from the root to `topic`.
    fn path(&self, topic: usize) -> Vec<usize> {
        let mut path = vec![topic];
        let parent = |topic: usize| self.node(topic).and_then(BagNode::parent);
        while let Some(parent) = path.last().and_then(|topic| parent(*topic)) {
            if path.contains(&parent) {
                break;
            }
            path.push(parent);
        }
        path.reverse();
        path
    }

    /// Returns when the data of each message of a topic began: by its event (ns).
    pub fn begun(&self, root: usize, topic: usize) -> Vec<(i64, i64)> {
        let Some(clock) = self.begins.get(&root) else {
            return Vec::new();
        };
        let series = &self.series[topic];
        let begun = series
            .events
            .iter()
            .zip(&series.stamps)
            .filter(|(_, stamp)| **stamp != NO_STAMP)
            .map(|(event, stamp)| {
                let usual = || kept(stamp.saturating_add(clock.usual));
                let begin = clock.begins.get(stamp).copied().unwrap_or_else(usual);
                (*event, begin)
            });
        begun.collect()
    }

    fn find_chains(&mut self) {
        let chains = self.nodes.iter().map(|node| {
            let path = self.path(node.topic);
            let clock = self.begins.get(&path[0]);
            BagChain {
                topic: node.topic,
                ages: Ages::new(&self.begun(path[0], node.topic), self.end),
                is_from_quickest: clock.is_some_and(|clock| clock.is_shifted),
                rate_ppm: clock.map_or(0.0, |clock| clock.rate_ppm),
                path,
            }
        });
        self.chains = chains.collect();
    }

    /// Guesses what topics follow whose stamps do not tell it.
    fn find_guesses(&mut self) {
        let is_open = |topic: &usize| {
            if !self.series[*topic].is_stamped {
                return self.series[*topic].events.len() >= 40;
            }
            let is_root = self
                .node(*topic)
                .is_some_and(|node| node.kind == Kind::Sensor);
            let ages = self.begun(*topic, *topic).into_iter();
            is_root && median(ages.map(|(event, begin)| event - begin).collect()) < (2 * MS) as f64
        };
        let open = (0..self.series.len()).filter(is_open).take(MAX_GUESSED);
        self.guesses = open
            .filter_map(|topic| guess(&self.series, topic))
            .collect();
    }
}

/// Returns the events of all topics.
fn all_series(bag: &Bag, clocks: &Clocks, pauses: &[Pause]) -> Vec<TopicEvents> {
    let series = bag.topics.iter().enumerate().map(|(place, topic)| {
        let mut events = clocks.events(place, &topic.messages);
        moved(bag, clocks, place, pauses, &mut events);
        let mut series = TopicEvents {
            events,
            stamps: topic.messages.iter().map(|message| message.stamp).collect(),
            has_source: topic.publish_time() == crate::bag::PublishTime::Source,
            is_stamped: is_stamped(&topic.messages),
            length: topic.mean_length(),
            ..TopicEvents::default()
        };
        series.sort();
        series.find_quantum(bag.first_log);
        series
    });
    series.collect()
}
