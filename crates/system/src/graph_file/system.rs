//! A graph file as a system.

use std::sync::{Arc, OnceLock};

use ratelab::{ClockExit, Knob, Release, Time, Topology};

use super::{
    ChainSpec, GraphFile, GraphFileError, PlacedKnob,
    error::{GraphRefusal, unknown},
    insertion::{Middle, insert},
};
use crate::{
    About, BuildError, Builder, CHAINS, DataChain, Final, Group, PEAKS, Setup, Signal, SignalValue,
    System, Verdict, VerdictKind, WorldKind,
};

/// The system of a graph file, with another system in its middle if the file names one.
pub struct GraphSystem {
    pub(super) file: GraphFile,
    pub(super) middle: Option<Middle>,
    pub(super) topology: OnceLock<Topology>,
    /// Its settings, behind the settings of the system in its middle.
    settings: Vec<Knob>,
    pub(super) chains: Vec<DataChain>,
    verdicts: Vec<VerdictKind>,
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
    fn kept(&self) -> [VerdictKind; 2] {
        let limits = self.chains.iter().filter_map(|spec| spec.chain.within());
        let limits: Vec<String> = limits.collect();
        let limits = match &limits[..] {
            [only] => only.clone(),
            all => format!("{} chains within their limits", all.len()),
        };
        let held = |name: &'static str, text: String| VerdictKind {
            name: name.into(),
            lost: false,
            text: text.into(),
        };
        [
            held("kept", format!("KEPT ({limits})")),
            held("stopped", format!("STOPPED at {{at}} (so far {limits})")),
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
            Some(inner) => inner.verdicts(),
            None if chains.iter().all(|chain| chain.limit.is_none()) => {
                VerdictKind::OF_EXITS.to_vec()
            }
            None => file.kept().into(),
        };
        verdicts.extend(chains.iter().flat_map(DataChain::verdicts).cloned());
        let own = file.settings.iter().map(|placed| &placed.knob);
        let settings = about.settings.iter().chain(own).cloned();
        Self {
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
    let inner = inner.map_or_else(Vec::new, System::signals);
    let ages = file.chains.iter().zip(PEAKS).map(|(spec, value)| {
        let limit = spec.chain.limit.map(|limit| limit.ms());
        let highest = limit.map_or_else(|| usual_age(file, spec), |limit| 1.5 * limit);
        Signal {
            name: format!("{} age", spec.chain.name).into(),
            unit: "ms".into(),
            topic: CHAINS.into(),
            value: SignalValue::new(value),
            limits: limit.map(|limit| [0.0, limit]),
            range: [0.0, highest],
        }
    });
    inner.into_iter().chain(ages).collect()
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
    let ends = (nodes.len() > 1).then(|| Group::new("ends of chains", nodes));
    let executors = file.executors.iter().map(|executor| {
        let nodes = executor.nodes.iter().map(|node| &node.text);
        Group::new(format!("executor {}", executor.name), nodes)
    });
    ends.into_iter().chain(executors).collect()
}

impl System for GraphSystem {
    fn name(&self) -> &str {
        &self.file.name
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
            settings: &self.settings,
            dividers: &self.file.dividers,
            graph_file: Some(&self.file.text),
            chains: &self.chains,
            limits: &self.file.limits,
            latency_path: first.map_or(&[], DataChain::topics),
            ..self.inner().map(System::about).unwrap_or_default()
        }
    }

    fn groups(&self) -> Vec<Group> {
        let inner = self.inner().map_or_else(Vec::new, System::groups);
        [inner, groups(&self.file, &self.chains)].concat()
    }

    fn signals(&self) -> Vec<Signal> {
        signals(&self.file, self.inner())
    }

    fn state(&self) -> Option<&str> {
        match self.inner() {
            Some(inner) => inner.state(),
            None => (!self.chains.is_empty()).then_some(CHAINS),
        }
    }

    fn latency(&self) -> Option<(&str, &str)> {
        match self.inner() {
            Some(inner) => inner.latency(),
            None => self
                .chains
                .first()
                .map(|chain| (chain.last(), chain.name())),
        }
    }

    fn verdict(&self, exit: &ClockExit, at: Time, state: Option<&[f64]>) -> Verdict {
        if let Some(inner) = self.inner() {
            return inner.verdict(exit, at, state);
        }
        let limited = self.chains.iter().any(|chain| chain.limit.is_some());
        match exit {
            _ if !limited => Verdict::from_exit(exit, at),
            ClockExit::Completed => Verdict::new(self.verdicts[0].clone(), at),
            _ => Verdict::new(self.verdicts[1].clone(), at),
        }
    }

    fn verdicts(&self) -> Vec<VerdictKind> {
        self.verdicts.clone()
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
        if let Some(plant) = self.inner().filter(|inner| inner.about().plant.is_some()) {
            warnings.extend(plant.warnings(setup));
        }
        warnings.extend(self.file.dead_circles());
        warnings.extend(self.clock_warnings(setup));
        warnings.extend(self.file.idle_settings());
        warnings.extend(self.file.idle_stamp_clocks(setup));
        warnings
    }
}
