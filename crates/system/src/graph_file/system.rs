//! A graph file as a system.

use std::sync::{Arc, OnceLock};

use ratelab::{ClockExit, Knob, Release, Time, Topology};

use super::{
    ChainSpec, GraphFile, GraphFileError, PlacedKnob,
    error::{GraphRefusal, unknown},
    insertion::{Middle, insert},
};
use crate::{
    About, BuildError, Builder, CHAINS, DataChain, Final, Group, PEAKS, Setup, Signal, System,
    Verdict, VerdictKind, WorldKind, kept_kind, kept_list, kept_text,
};

/// The system of a graph file, with another system in its middle if the file names one.
pub struct GraphSystem {
    name: &'static str,
    pub(super) file: GraphFile,
    pub(super) middle: Option<Middle>,
    pub(super) topology: OnceLock<Topology>,
    /// Its settings, behind the settings of the system in its middle.
    settings: Vec<Knob>,
    pub(super) chains: Vec<DataChain>,
    signals: Vec<Signal>,
    groups: Vec<Group>,
    verdicts: Vec<&'static VerdictKind>,
}

impl GraphFile {
    /// The graph as a system. `known` are the systems that it may have in its middle.
    ///
    /// # Errors
    /// [`GraphFileError`] if it names another system, or does not fit around it.
    pub fn system(&self, known: &[Arc<dyn System>]) -> Result<GraphSystem, GraphFileError> {
        let middle = self.inner.as_ref().map(|inner| {
            let system = known.iter().find(|system| system.name() == inner.name.text);
            match system {
                Some(system) => insert(self, inner, system.clone()),
                None => {
                    let known = known.iter().map(|system| system.name());
                    unknown("unknown system", &inner.name, known)
                }
            }
        });
        let middle = middle.transpose();
        let middle = middle.map_err(|refusal| refusal.in_text(&self.text))?;
        Ok(GraphSystem::new(self, middle))
    }

    /// The verdicts where all limits are kept: to the end of the run, and until it was stopped.
    fn kept(&self) -> [&'static VerdictKind; 2] {
        let limits = self.chains.iter().filter_map(|spec| spec.chain.within());
        let limits: Vec<String> = limits.collect();
        let limits = match &limits[..] {
            [only] => only.clone(),
            all => format!("{} chains within their limits", all.len()),
        };
        [
            kept_kind("kept", false, &format!("KEPT ({limits})")),
            kept_kind(
                "stopped",
                false,
                &format!("STOPPED at {{at}} (so far {limits})"),
            ),
        ]
    }
}

impl GraphSystem {
    /// Checks that its graph takes each setting of the file.
    ///
    /// # Errors
    /// [`GraphFileError`] with the place of the first setting that is refused.
    pub fn check_settings(&self) -> Result<(), GraphFileError> {
        let setup = Setup::default();
        let mut builder = Builder::new(0, &setup, WorldKind::Course);
        // Whatever else is wrong is told where the graph is built with its settings.
        if self.build(&mut builder).is_err() {
            return Ok(());
        }
        for PlacedKnob { knob, at } in &self.file.settings {
            if let Err(why) = builder.graph.check(knob) {
                let what = format!("{}: {why}", knob.kind().name());
                return Err(GraphRefusal::new(*at, what).in_text(&self.file.text));
            }
        }
        Ok(())
    }

    fn new(file: &GraphFile, middle: Option<Middle>) -> Self {
        let inner = middle.as_ref().map(|middle| &*middle.system);
        let about = inner.map(System::about).unwrap_or_default();
        let chains: Vec<DataChain> = file.chains.iter().map(|spec| spec.chain.clone()).collect();
        let mut verdicts = match inner {
            Some(inner) => inner.verdicts().to_vec(),
            None if chains.iter().all(|chain| chain.limit.is_none()) => {
                VerdictKind::OF_EXITS.to_vec()
            }
            None => file.kept().to_vec(),
        };
        verdicts.extend(chains.iter().flat_map(DataChain::verdicts));
        let own = file.settings.iter().map(|placed| &placed.knob);
        let settings = about.settings.iter().chain(own).cloned();
        Self {
            name: kept_text(&file.name),
            signals: signals(file, inner),
            groups: [about.groups, &groups(file, &chains)].concat(),
            settings: settings.collect(),
            file: file.clone(),
            middle,
            topology: OnceLock::new(),
            chains,
            verdicts,
        }
    }
}

/// The plots: first of the system in the middle, then the data age of each chain.
fn signals(file: &GraphFile, inner: Option<&dyn System>) -> Vec<Signal> {
    let inner = inner.map_or(&[][..], System::signals).iter().copied();
    let ages = file.chains.iter().zip(PEAKS).map(|(spec, value)| {
        let limit = spec.chain.limit.map(|limit| limit.ms());
        let highest = limit.map_or_else(|| usual_age(file, spec), |limit| 1.5 * limit);
        Signal {
            name: kept_text(&format!("{} age", spec.chain.name)),
            unit: "ms",
            topic: CHAINS,
            value,
            limits: limit.map(|limit| [0.0, limit]),
            range: [0.0, highest],
        }
    });
    inner.chain(ages).collect()
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

/// The nodes at the ends of chains share the ages, the nodes of an executor its threads.
fn groups(file: &GraphFile, chains: &[DataChain]) -> Vec<Group> {
    let mut nodes: Vec<&str> = chains.iter().map(DataChain::last).collect();
    nodes.sort_unstable();
    nodes.dedup();
    let ends = (nodes.len() > 1).then(|| Group {
        name: "ends of chains",
        nodes: kept_list(nodes),
    });
    let executors = file.executors.iter().map(|executor| Group {
        name: kept_text(&format!("executor {}", executor.name)),
        nodes: kept_list(executor.nodes.iter().map(|node| &node.text)),
    });
    ends.into_iter().chain(executors).collect()
}

impl System for GraphSystem {
    fn name(&self) -> &'static str {
        self.name
    }

    fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
        if let Some(middle) = &self.middle {
            builder.insert(middle.relays.clone());
            middle.system.build(builder)?;
        }
        self.add_nodes(builder)?;
        for executor in &self.file.executors {
            let nodes = executor.nodes.iter();
            let callbacks = nodes.map(|node| self.file.callback(&node.text));
            builder.executor(executor.kind, callbacks)?;
        }
        Ok(())
    }

    fn inner(&self) -> Option<&dyn System> {
        Some(&*self.middle.as_ref()?.system)
    }

    fn about(&self) -> About<'_> {
        let first = self.chains.first().filter(|_| self.middle.is_none());
        About {
            groups: &self.groups,
            settings: &self.settings,
            dividers: &self.file.dividers,
            graph_file: Some(&self.file.text),
            chains: &self.chains,
            limits: &self.file.limits,
            latency_path: first.map_or(&[], DataChain::topics),
            ..self.inner().map(System::about).unwrap_or_default()
        }
    }

    fn signals(&self) -> &[Signal] {
        &self.signals
    }

    fn state(&self) -> Option<&'static str> {
        match self.inner() {
            Some(inner) => inner.state(),
            None => (!self.chains.is_empty()).then_some(CHAINS),
        }
    }

    fn latency(&self) -> Option<(&'static str, &'static str)> {
        match self.inner() {
            Some(inner) => inner.latency(),
            None => self.chains.first().map(|chain| (chain.last(), chain.name)),
        }
    }

    fn verdict(&self, exit: &ClockExit, at: Time, state: Option<&[f64]>) -> Verdict {
        if let Some(inner) = self.inner() {
            return inner.verdict(exit, at, state);
        }
        let limited = self.chains.iter().any(|chain| chain.limit.is_some());
        match exit {
            _ if !limited => Verdict::from_exit(exit, at),
            ClockExit::Completed => Verdict::new(self.verdicts[0], at),
            _ => Verdict::new(self.verdicts[1], at),
        }
    }

    fn verdicts(&self) -> &[&'static VerdictKind] {
        &self.verdicts
    }

    fn finals(&self, state: &[f64]) -> Vec<Final> {
        let at = state.first().map_or(0.0, |ms| ms * 1e6);
        self.finals_at(Time::from_nanos(at.round() as u64), state)
    }

    fn finals_at(&self, at: Time, state: &[f64]) -> Vec<Final> {
        match self.inner() {
            Some(inner) => inner.finals_at(at, state),
            None => {
                let chains = self.chains.iter();
                chains.flat_map(|chain| chain.finals(at, state)).collect()
            }
        }
    }

    fn warnings(&self, setup: &Setup) -> Vec<String> {
        let mut warnings = self.overloads(setup);
        warnings.extend(self.file.dead_circles());
        warnings.extend(self.clock_warnings(setup));
        warnings.extend(self.file.idle_settings());
        warnings.extend(self.file.idle_stamp_clocks(setup));
        warnings
    }
}
