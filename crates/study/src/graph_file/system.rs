//! A graph file as a system.

use std::{path::PathBuf, sync::Arc};

use ratelab::{ClockExit, Release, Shared, Time, Topic, Topology};
use ratelab_account::RecordedTopic;

use super::{
    CHAINS, ChainSpec, GraphFile, GraphFileError, NodeSpec,
    chain::{self, ChainAges, Numbers, PEAKS},
    document::Placed,
    error::instead,
    graph_node::{Beginning, ChainEnds, GraphNode, NodeInput, Output},
    insertion::insert,
    judged::{FIGURES, Judged},
    leaked::{leaked, leaked_kind, leaked_list},
};
use crate::system::{
    AgeLimits, Alias, BuildError, Builder, Final, ForwardingNode, Group, Joints, Picture,
    QuadraticCost, Setup, Signal, StateTable, System, Verdict, VerdictKind,
};

/// The system of a graph file, with another system in its middle if the file names one.
pub struct GraphSystem {
    pub(super) file: GraphFile,
    inner: Option<Arc<dyn System>>,
    /// Its graph.
    pub(super) topology: Option<Topology>,
    relays: Vec<ForwardingNode>,
    name: &'static str,
    /// The topics of its own, in the order of the file.
    topics: Vec<OwnTopic>,
    /// Names of the numbers on [`CHAINS`].
    chain_fields: &'static [&'static str],
    chains: Vec<Judged>,
    signals: &'static [Signal],
    groups: &'static [Group],
    verdicts: &'static [&'static VerdictKind],
    kept: &'static VerdictKind,
    stopped: &'static VerdictKind,
    /// The topics before the last node of the first chain.
    first_path: &'static [&'static str],
}

/// A topic of a graph file, with the chains through it.
struct OwnTopic {
    name: String,
    chains: Vec<usize>,
    fields: &'static [&'static str],
}

impl GraphFile {
    /// The graph as a system. `known` are the systems that it may have in its middle.
    ///
    /// # Errors
    /// [`GraphFileError`] if it names another system, or does not fit around it.
    pub fn system(&self, known: &[Arc<dyn System>]) -> Result<GraphSystem, GraphFileError> {
        let Some(inner) = &self.inner else {
            return Ok(GraphSystem::new(self, None, Vec::new(), None));
        };
        let system = known.iter().find(|system| system.name() == inner.name.text);
        let Some(system) = system else {
            let instead = instead(&inner.name.text, known.iter().map(|system| system.name()));
            let what = format!("unknown system {:?}: {instead}", inner.name.text);
            return Err(GraphFileError::at(&self.text, inner.name.at, what));
        };
        let (relays, topology) = insert(self, inner, &**system)?;
        let (inner, topology) = (Some(system.clone()), Some(topology));
        Ok(GraphSystem::new(self, inner, relays, topology))
    }
}

impl ChainSpec {
    /// Its nodes, in the direction of the data.
    pub(super) fn nodes(&self) -> impl Iterator<Item = String> {
        let nodes = self.path.iter().map(|place| &place.text);
        nodes.filter(|text| !text.starts_with('/')).cloned()
    }

    /// The node at its end.
    pub(super) fn last(&self) -> &str {
        let mut nodes = self.path.iter().rev();
        let last = nodes.find(|place| !place.text.starts_with('/'));
        last.map_or("", |node| &node.text)
    }

    /// The topics before that node.
    fn topics(&self) -> impl Iterator<Item = String> {
        let last = self.place(self.last()).unwrap_or_default();
        let topics = self.path[..last].iter();
        let topics = topics.filter(|place| place.text.starts_with('/'));
        topics.map(|topic| topic.text.clone())
    }

    fn place(&self, name: &str) -> Option<usize> {
        self.path.iter().position(|place| place.text == name)
    }
}

impl GraphSystem {
    fn new(
        file: &GraphFile,
        inner: Option<Arc<dyn System>>,
        relays: Vec<ForwardingNode>,
        topology: Option<Topology>,
    ) -> Self {
        let chains: Vec<Judged> = file.chains.iter().map(Judged::of).collect();
        let limits = file.chains.iter().filter_map(ChainSpec::within);
        let limits: Vec<String> = limits.collect();
        let limits = match &limits[..] {
            [only] => only.clone(),
            all => format!("{} chains within their limits", all.len()),
        };
        let kept = leaked_kind("kept", false, &format!("KEPT ({limits})"));
        let stopped = format!("STOPPED at {{at}} (so far {limits})");
        let stopped = leaked_kind("stopped", false, &stopped);
        let limited = chains.iter().filter(|chain| chain.limit.is_some());
        let missed = limited
            .clone()
            .flat_map(|chain| [chain.missed, chain.silent]);
        let verdicts: Vec<&'static VerdictKind> = match &inner {
            Some(inner) => inner.verdicts().iter().copied().chain(missed).collect(),
            None if limited.count() == 0 => VerdictKind::OF_EXITS.to_vec(),
            None => [kept, stopped].into_iter().chain(missed).collect(),
        };
        let of_chains = file.chains.iter().map(|chain| chain.name.as_str());
        Self {
            topics: own_topics(file, &relays),
            chain_fields: leaked_list(chain::fields(of_chains)),
            signals: signals(file, &chains, inner.as_deref()),
            groups: groups(file, &chains, inner.as_deref()),
            name: leaked(&file.name),
            verdicts: verdicts.leak(),
            first_path: leaked_list(file.chains.first().into_iter().flat_map(ChainSpec::topics)),
            file: file.clone(),
            inner,
            topology,
            relays,
            chains,
            kept,
            stopped,
        }
    }

    fn is_relay(&self, node: &str) -> bool {
        self.relays.iter().any(|relay| relay.node == node)
    }

    /// Where `node` takes the beginning of chain number `chain` from, for its output to
    /// `next`, or at the end of the chain.
    fn beginning(&self, node: &NodeSpec, chain: usize, next: Option<&str>) -> Beginning {
        let spec = &self.file.chains[chain];
        let Some(place) = spec.place(&node.name) else {
            return Beginning::Elsewhere;
        };
        if next.is_some_and(|next| spec.place(next) != Some(place + 1)) {
            return Beginning::Elsewhere;
        }
        let Some(before) = place
            .checked_sub(1)
            .and_then(|before| spec.path.get(before))
        else {
            return Beginning::Tick;
        };
        let mut reads = node.inputs();
        let Some(input) = reads.position(|topic| topic.text == before.text) else {
            return Beginning::Elsewhere;
        };
        let own = self.topics.iter().find(|topic| topic.name == before.text);
        let place = own.and_then(|own| own.chains.iter().position(|known| *known == chain));
        place.map_or(Beginning::Sensing { input }, |place| Beginning::Number {
            input,
            place,
        })
    }

    fn add_node(
        &self,
        builder: &mut Builder<'_>,
        (index, node): (usize, &NodeSpec),
        topics: &[Topic<Numbers>],
        (ages, chain_topic): (&Arc<Shared<ChainAges>>, &Topic<Numbers>),
    ) -> Result<(), BuildError> {
        let inputs = |topics: &[Placed]| {
            let topics = topics.iter();
            let topics = topics.filter_map(|topic| builder.recorded(&topic.text));
            topics.collect::<Vec<Arc<dyn RecordedTopic>>>()
        };
        let (triggers, reads) = (inputs(&node.triggers), inputs(&node.reads));
        let own = |name: &str| self.topics.iter().position(|topic| topic.name == name);
        let outputs = node.publishes.iter().filter_map(|topic| {
            let place = own(&topic.text)?;
            let chains = self.topics[place].chains.iter();
            let chains = chains.map(|chain| self.beginning(node, *chain, Some(&topic.text)));
            Some((topics[place].clone(), chains.collect::<Vec<_>>()))
        });
        let outputs: Vec<_> = outputs.collect();
        let ends = self.chains.iter().enumerate();
        let ends = ends.filter(|(_, chain)| chain.last() == node.name);
        let ends = ends.map(|(at, chain)| (at, chain.name, self.beginning(node, at, None)));
        let ends: Vec<_> = ends.collect();
        let acts = self.inner.is_none() && ends.iter().any(|(chain, ..)| *chain == 0);
        let (ages, chain_topic) = (ages.clone(), chain_topic.clone());
        // After the nodes of a system that are due at the same time.
        let before = if self.inner.is_some() { 100 } else { 0 };
        let priority = before + node.priority.unwrap_or(index as u32);
        let release = node.release.clone();
        builder.released_node(&node.name, release, priority, move |wiring| {
            let mut inputs: Vec<NodeInput> = Vec::new();
            inputs.extend(
                triggers
                    .iter()
                    .map(|topic| NodeInput::new(topic.trigger(wiring))),
            );
            inputs.extend(
                reads
                    .iter()
                    .map(|topic| NodeInput::new(topic.reader(wiring))),
            );
            GraphNode {
                inputs,
                outputs: outputs
                    .iter()
                    .map(|(topic, chains)| Output {
                        publisher: wiring.publisher(topic),
                        chains: chains.clone(),
                    })
                    .collect(),
                ends: (!ends.is_empty()).then(|| ChainEnds {
                    chains: ends
                        .iter()
                        .map(|(chain, name, of)| (*chain, *of, wiring.meter(name)))
                        .collect(),
                    ages: ages.clone(),
                    publisher: wiring.publisher(&chain_topic),
                    push_age: acts.then(|| wiring.push_age()),
                    pending: Vec::new(),
                }),
            }
        })
    }
}

/// The topics that the nodes of `file` publish, but for those behind a topic of a system.
fn own_topics(file: &GraphFile, relays: &[ForwardingNode]) -> Vec<OwnTopic> {
    let mut topics: Vec<OwnTopic> = Vec::new();
    for topic in file.nodes.iter().flat_map(|node| &node.publishes) {
        let known = topics.iter().any(|known| known.name == topic.text);
        if known || relays.iter().any(|relay| relay.to == topic.text) {
            continue;
        }
        let chains = file.chains.iter().enumerate();
        let through = chains.filter(|(_, chain)| chain.place(&topic.text).is_some());
        let (chains, names): (Vec<_>, Vec<_>) = through
            .map(|(index, chain)| (index, format!("{} origin (ns)", chain.name)))
            .unzip();
        let fields = match names.is_empty() {
            true => vec!["origin (ns)".to_owned()],
            false => names,
        };
        topics.push(OwnTopic {
            name: topic.text.clone(),
            chains,
            fields: leaked_list(fields),
        });
    }
    topics
}

/// The plots: the data age of each chain, then those of the system.
fn signals(file: &GraphFile, chains: &[Judged], inner: Option<&dyn System>) -> &'static [Signal] {
    let inner = inner.map_or(&[][..], System::signals).iter().copied();
    let specs = file.chains.iter().zip(chains).zip(PEAKS);
    let ages = specs.map(|((spec, chain), value)| {
        let limit = chain.limit.map(|limit| limit.age.as_secs_f64() * 1e3);
        Signal {
            name: leaked(&format!("{} age", chain.name)),
            unit: "ms",
            topic: CHAINS,
            value,
            limits: limit.map(|limit| [0.0, limit]),
            range: [
                0.0,
                limit.map_or_else(|| usual_age(file, spec), |limit| 1.5 * limit),
            ],
        }
    });
    inner.chain(ages).collect::<Vec<_>>().leak()
}

/// A bound of the age along `chain` where nothing is late: the periods of its nodes (ms); 100
/// without any.
fn usual_age(file: &GraphFile, chain: &ChainSpec) -> f64 {
    let nodes = file.nodes.iter();
    let on_it = nodes.filter(|node| chain.place(&node.name).is_some());
    let periods = on_it.map(|node| match node.release {
        Release::Every(hz) => hz.period().as_secs_f64() * 1e3,
        Release::On(_) => 0.0,
    });
    match 2.0 * periods.sum::<f64>() {
        0.0 => 100.0,
        bound => bound,
    }
}

/// The nodes at the ends of chains share the ages, those of an executor its threads, and those
/// of the system what they share there.
fn groups(file: &GraphFile, chains: &[Judged], inner: Option<&dyn System>) -> &'static [Group] {
    let mut nodes: Vec<&'static str> = chains.iter().map(Judged::last).collect();
    nodes.sort_unstable();
    nodes.dedup();
    let ends = (nodes.len() > 1).then(|| Group {
        name: "ends of chains",
        nodes: nodes.leak(),
    });
    let inner = inner.map_or(&[][..], System::groups).iter().copied();
    let executors = file.executors.iter().map(|executor| Group {
        name: leaked(&format!("executor {}", executor.name)),
        nodes: leaked_list(executor.nodes.iter().map(|node| node.text.clone())),
    });
    inner
        .chain(ends)
        .chain(executors)
        .collect::<Vec<_>>()
        .leak()
}

impl System for GraphSystem {
    fn name(&self) -> &'static str {
        self.name
    }

    fn engine(&self) -> Option<String> {
        self.inner.as_ref()?.engine()
    }

    fn graph_file(&self) -> Option<&str> {
        Some(&self.file.text)
    }

    fn settings(&self) -> Setup {
        let inner = self.inner.iter().flat_map(|inner| {
            let settings = inner.settings();
            settings.iter().cloned().collect::<Vec<_>>()
        });
        inner.chain(self.file.settings.iter().cloned()).collect()
    }

    fn warnings(&self, setup: &Setup) -> Vec<String> {
        let mut warnings = self.overloads(setup);
        warnings.extend(self.file.idle_settings());
        warnings
    }

    fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
        if let Some(inner) = &self.inner {
            builder.insert(self.relays.clone());
            inner.build(builder)?;
        }
        let topics = self.topics.iter();
        let topics = topics.map(|topic| builder.named_topic(&topic.name, topic.fields));
        let topics: Vec<Topic<Numbers>> = topics.collect();
        let chain_topic = match self.chains.is_empty() {
            true => builder.internal_topic(CHAINS),
            false => builder.named_topic(CHAINS, self.chain_fields),
        };
        let limits = self.chains.iter();
        let limits = limits.map(|chain| chain.limit.map(|limit| limit.age));
        let ages = Arc::new(Shared::new("data ages of chains", ChainAges::new(limits)));
        let nodes = self.file.nodes.iter().enumerate();
        let own = nodes.filter(|(_, node)| !self.is_relay(&node.name));
        for node in own {
            self.add_node(builder, node, &topics, (&ages, &chain_topic))?;
        }
        for executor in &self.file.executors {
            let nodes = executor.nodes.iter();
            let callbacks = nodes.map(|node| self.file.callback(&node.text));
            builder.executor(executor.kind, callbacks)?;
        }
        Ok(())
    }

    fn groups(&self) -> &'static [Group] {
        self.groups
    }

    fn signals(&self) -> &'static [Signal] {
        self.signals
    }

    fn chains(&self) -> Option<&'static str> {
        (!self.chains.is_empty()).then_some(CHAINS)
    }

    fn state(&self) -> Option<&'static str> {
        match &self.inner {
            Some(inner) => inner.state(),
            None => self.chains(),
        }
    }

    fn latency(&self) -> Option<(&'static str, &'static str)> {
        match &self.inner {
            Some(inner) => inner.latency(),
            None => self.chains.first().map(|chain| (chain.last(), chain.name)),
        }
    }

    fn latency_path(&self) -> &'static [&'static str] {
        match self.inner {
            Some(_) => &[],
            None => self.first_path,
        }
    }

    fn verdict(&self, exit: &ClockExit, at: Time, state: Option<&[f64]>) -> Verdict {
        match &self.inner {
            Some(inner) => inner.verdict(exit, at, state),
            None => Verdict::of_exit(exit, at),
        }
    }

    fn verdict_on_chains(
        &self,
        verdict: Verdict,
        exit: &ClockExit,
        at: Time,
        chains: Option<&[f64]>,
    ) -> Verdict {
        let limited = self.chains.iter().any(|chain| chain.limit.is_some());
        if verdict.is_lost() || !limited {
            return verdict;
        }
        let mut each = self.chains.iter().enumerate();
        let over = *exit != ClockExit::Stopped;
        let missed = each.find_map(|(index, chain)| chain.missed(index, at, chains, over));
        match (missed, exit, &self.inner) {
            (Some(missed), ..) => Verdict::new(missed, at),
            (None, _, Some(_)) => verdict,
            (None, ClockExit::Completed, None) => Verdict::new(self.kept, at),
            (None, _, None) => Verdict::new(self.stopped, at),
        }
    }

    fn verdicts(&self) -> &'static [&'static VerdictKind] {
        self.verdicts
    }

    fn chain_lines(&self, at: Time, chains: &[f64], idle: &[&str]) -> Vec<String> {
        let each = self.chains.iter().enumerate();
        each.map(|(index, chain)| chain.line(index, at, chains, idle))
            .collect()
    }

    fn finals(&self, state: &[f64]) -> Vec<Final> {
        let at = state.first().map_or(0.0, |ms| ms * 1e6);
        self.finals_at(Time::from_nanos(at.round() as u64), state)
    }

    fn finals_at(&self, at: Time, state: &[f64]) -> Vec<Final> {
        if let Some(inner) = &self.inner {
            return inner.finals_at(at, state);
        }
        let each = self.chains.iter().enumerate();
        let figures = each.flat_map(|(index, chain)| {
            let figures = chain.figures_at(index, at, state);
            let names = chain.figures.iter().zip(FIGURES);
            names.map(move |(name, (_, unit, value))| Final {
                name,
                unit,
                value: figures.map_or(f64::NAN, value),
            })
        });
        figures.collect()
    }

    fn joints(&self) -> &'static [Joints] {
        self.inner.as_ref().map_or(&[], |inner| inner.joints())
    }

    fn watchdog(&self, setup: &Setup) -> Option<String> {
        self.inner.as_ref()?.watchdog(setup)
    }

    fn aliases(&self) -> &'static [Alias] {
        self.inner.as_ref().map_or(&[], |inner| inner.aliases())
    }

    fn caption(&self, node: &str) -> Option<&'static str> {
        self.inner.as_ref()?.caption(node)
    }

    fn broken(&self) -> Option<&'static str> {
        self.inner.as_ref()?.broken()
    }

    fn resolve(&self, seed: u64, setup: &Setup, node: &str, text: &str) -> Result<String, String> {
        match &self.inner {
            Some(inner) => inner.resolve(seed, setup, node, text),
            None => Ok(text.to_owned()),
        }
    }

    fn file(&self, node: &str, text: &str) -> Option<PathBuf> {
        self.inner.as_ref()?.file(node, text)
    }

    fn table(&self) -> Option<StateTable> {
        self.inner.as_ref()?.table()
    }

    fn quadratic_cost(&self) -> Option<QuadraticCost> {
        self.inner.as_ref()?.quadratic_cost()
    }

    fn lost_anyway(&self, setup: &Setup) -> Option<String> {
        self.inner.as_ref()?.lost_anyway(setup)
    }

    fn age_limits(&self, setup: &Setup) -> AgeLimits {
        let inner = self.inner.as_ref();
        inner.map_or_else(AgeLimits::default, |inner| inner.age_limits(setup))
    }

    fn picture(&self, state: &[f64]) -> Option<Picture> {
        self.inner.as_ref()?.picture(state)
    }
}
