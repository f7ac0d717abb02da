//! A graph file as a system.

use std::sync::{Arc, OnceLock};

use ratelab::{ClockExit, Knob, Release, Time, TimedKnob, Topology};

use super::{
    ChainSpec, GraphFile, GraphFileError,
    error::{GraphRefusal, unknown},
    insertion::{Middle, insert},
};
use crate::{
    About, BuildError, Builder, CHAINS, DataChain, Final, Group, Judge, RobotInfo, Setup, Signal,
    SignalValue, System, SystemKnobs, Verdict, VerdictKind, WorldKind, peak,
};

/// The system of a graph file, with another system in its middle if the file names one.
pub struct GraphSystem {
    pub(super) file: GraphFile,
    pub(super) middle: Option<Middle>,
    pub(super) topology: OnceLock<Topology>,
    /// Its settings, behind the settings of the system in its middle.
    settings: Vec<Knob>,
    events: Vec<TimedKnob>,
    pub(super) chains: Vec<DataChain>,
    /// The verdicts where all limits are kept.
    kept: Option<KeptVerdicts>,
}

/// The verdicts where all limits are kept.
struct KeptVerdicts {
    /// The run reached its end.
    kept: VerdictKind,
    /// The run was stopped before its end.
    stopped: VerdictKind,
}

impl KeptVerdicts {
    /// Creates the verdicts that name the limits of `chains`; `None` without limits.
    fn new(chains: &[DataChain]) -> Option<Self> {
        let limits: Vec<String> = chains.iter().filter_map(DataChain::within).collect();
        let limits = match &limits[..] {
            [] => return None,
            [only] => only.clone(),
            all => format!("{} chains within their limits", all.len()),
        };
        let held = |name: &'static str, text: String| VerdictKind {
            name: name.into(),
            lost: false,
            text: text.into(),
        };
        Some(Self {
            kept: held("kept", format!("KEPT ({limits})")),
            stopped: held("stopped", format!("STOPPED at {{at}} (so far {limits})")),
        })
    }
}

impl GraphFile {
    /// Returns the graph as a system. `known` are the systems that it may have in its middle.
    ///
    /// # Errors
    /// [`GraphFileError`] if it names another system, or does not fit around it.
    pub fn system(&self, known: &[Arc<dyn System>]) -> Result<GraphSystem, GraphFileError> {
        let middle = self
            .inner
            .as_ref()
            .map(|inner| {
                let system = known.iter().find(|system| system.name() == inner.name.text);
                match system {
                    Some(system) => insert(self, inner, system.clone()),
                    None => {
                        let known = known.iter().map(|system| system.name());
                        unknown("unknown system", &inner.name, known)
                    }
                }
            })
            .transpose()
            .map_err(|refusal| refusal.in_text(&self.text))?;
        Ok(GraphSystem::new(self, middle))
    }
}

impl GraphSystem {
    /// Returns the system in the middle of the graph.
    fn inner(&self) -> Option<&dyn System> {
        Some(&*self.middle.as_ref()?.system)
    }

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
        let settings = self.file.settings.iter().map(|of| (&of.knob, of.at));
        let events = self.file.events.iter().map(|of| (&of.event.knob, of.at));
        for (knob, at) in settings.chain(events) {
            if let Err(why) = builder.graph.check(knob) {
                let what = format!("{}: {why}", knob.kind().name());
                return Err(GraphRefusal::new(at, what).in_text(&self.file.text));
            }
        }
        Ok(())
    }

    fn new(file: &GraphFile, middle: Option<Middle>) -> Self {
        let about = middle.as_ref().map(|middle| middle.system.about());
        let inner = about.map_or(&[][..], |about| about.settings).iter();
        let own = file.settings.iter().map(|placed| &placed.knob);
        let chains = file.chains.iter().map(|spec| spec.chain.clone());
        let chains: Vec<DataChain> = chains.collect();
        Self {
            settings: inner.chain(own).cloned().collect(),
            kept: KeptVerdicts::new(&chains),
            chains,
            events: file.events.iter().map(|of| of.event.clone()).collect(),
            file: file.clone(),
            topology: OnceLock::new(),
            middle,
        }
    }
}

/// Returns the plots: first of the system in the middle, then the data age of each chain.
fn signals(file: &GraphFile, inner: Option<&dyn System>) -> Vec<Signal> {
    let inner = inner.map_or_else(Vec::new, System::signals);
    let ages = file.chains.iter().enumerate().map(|(chain, spec)| {
        let limit = spec.chain.limit.map(|limit| limit.ms());
        let highest = limit.map_or_else(|| usual_age(file, spec), |limit| 1.5 * limit);
        Signal {
            name: format!("{} age", spec.chain.name).into(),
            unit: "ms".into(),
            topic: CHAINS.into(),
            value: SignalValue::new(move |row| peak(row, chain)),
            limits: limit.map(|limit| [0.0, limit]),
            range: [0.0, highest],
        }
    });
    inner.into_iter().chain(ages).collect()
}

/// Returns a bound of the age along `chain` where nothing is late: the periods of its nodes (ms);
/// 100 without any.
fn usual_age(file: &GraphFile, chain: &ChainSpec) -> f64 {
    let periods = file
        .nodes
        .iter()
        .filter(|node| chain.place(&node.name).is_some())
        .map(|node| match node.release {
            Release::AtRate(hz) => hz.period().as_secs_f64() * 1e3,
            Release::On(_) => 0.0,
        });
    match 2.0 * periods.sum::<f64>() {
        0.0 => 100.0,
        bound => bound,
    }
}

/// Returns the groups that share something: ends of chains the ages, nodes of an executor its threads.
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
            let callbacks = executor
                .nodes
                .iter()
                .map(|node| self.file.callback(&node.text));
            builder.executor(executor.kind, callbacks)?;
        }
        Ok(())
    }

    fn about(&self) -> About<'_> {
        let about = About {
            settings: &self.settings,
            events: &self.events,
            dividers: &self.file.dividers,
            graph_file: Some(&self.file.text),
            chains: &self.chains,
            limits: &self.file.limits,
            ..self.inner().map(System::about).unwrap_or_default()
        };
        if self.middle.is_some() {
            return about;
        }
        let first = self.chains.first();
        About {
            state: first.map(|_| CHAINS),
            latency: first.map(|chain| (chain.last(), chain.name())),
            ..about
        }
    }

    fn groups(&self) -> Vec<Group> {
        let inner = self.inner().map_or_else(Vec::new, System::groups);
        [inner, groups(&self.file, &self.chains)].concat()
    }

    fn signals(&self) -> Vec<Signal> {
        signals(&self.file, self.inner())
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

    fn judge(&self) -> &dyn Judge {
        match self.inner() {
            Some(inner) => inner.judge(),
            None => self,
        }
    }

    fn robot(&self) -> &dyn RobotInfo {
        match self.inner() {
            Some(inner) => inner.robot(),
            None => self,
        }
    }

    fn knobs(&self) -> &dyn SystemKnobs {
        match self.inner() {
            Some(inner) => inner.knobs(),
            None => self,
        }
    }
}

/// Judges a graph without a system in its middle: by its chains.
impl Judge for GraphSystem {
    fn verdict(&self, exit: &ClockExit, at: Time, _: Option<&[f64]>) -> Verdict {
        match (&self.kept, exit) {
            (None, _) => Verdict::from_exit(exit, at),
            (Some(of), ClockExit::Completed) => Verdict::new(of.kept.clone(), at),
            (Some(of), _) => Verdict::new(of.stopped.clone(), at),
        }
    }

    fn verdicts(&self) -> Vec<VerdictKind> {
        match &self.kept {
            None => VerdictKind::OF_EXITS.to_vec(),
            Some(of) => vec![of.kept.clone(), of.stopped.clone()],
        }
    }

    fn finals(&self, state: &[f64]) -> Vec<Final> {
        let at = state.first().map_or(0.0, |ms| ms * 1e6);
        self.finals_at(Time::from_nanos(at.round() as u64), state)
    }

    fn finals_at(&self, at: Time, state: &[f64]) -> Vec<Final> {
        self.chains
            .iter()
            .flat_map(|chain| chain.finals(at, state))
            .collect()
    }
}

impl RobotInfo for GraphSystem {}

impl SystemKnobs for GraphSystem {}
