//! One run of a system as a value: configuration in, summary out.
//!
//! ```
//! use std::sync::Arc;
//! use ratelab_experiment::{Config, Experiment};
//! use ratelab_system::graph_file::GraphFile;
//!
//! let robot = r#"
//!     name = "robot"
//!     node.camera = { rate = 30, publishes = ["/image"] }
//!     node.control = { rate = 10, reads = ["/image"] }
//! "#;
//! let system = Arc::new(GraphFile::parse(robot)?.system(&[])?);
//! let summary = Experiment::new(system, &Config::default())?.run()?;
//! assert_eq!(summary.verdict.name(), "completed");
//! assert_eq!(summary.topic("/image").expect("a topic").published, 301);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::{
    sync::{Arc, Mutex},
    time::Instant,
};

use crossbeam_channel::Sender;
use ratelab::{
    Clock, ClockExit, ClockKind, Command, Fault, Graph, Head, Inbox, Interrupt, Knob, KnobRefusal,
    TimedCommand, TimedKnob, clock::RunWriter, run, sync::lock,
};
use ratelab_metrics::{Observer, Rows, TapHandle};
use ratelab_re_execution::RunLog;
use ratelab_real_clock::RealClock;
use ratelab_system::{
    AnswersOfNodes, BuildError, BuildInputs, BuiltGraph, Group, MeanCost, RunTally, Setup, System,
    WorldKind,
};

use crate::{Config, Summary, Taps, ages::AgeWatch};

/// The graph of a system, ready to run once.
pub struct Experiment {
    pub(crate) system: Arc<dyn System>,
    pub(crate) config: Config,
    pub(crate) graph: Graph,
    taps: Taps,
    cost: Option<Sum<MeanCost>>,
    tally: Option<Sum<SystemTally>>,
    ages: Option<AgeWatch>,
    commands: Sender<Command>,
    inbox: Inbox,
}

/// What is added up of the messages of a run.
type Sum<T> = Arc<Mutex<T>>;

/// The figures of a system.
type SystemTally = Box<dyn RunTally>;

/// Adds each message of a recorded topic to `sum` by `add`; `None` without such a topic.
fn listen<T: Send + 'static>(
    taps: &Taps,
    name: &str,
    sum: &Sum<T>,
    add: impl Fn(&mut T, &Head, &[f64]) + Send + 'static,
) -> Option<()> {
    let topic = taps.topic(name)?;
    let sum = sum.clone();
    let add = move |head: &Head, row: &[f64]| {
        add(&mut lock(&sum), head, row);
        true
    };
    topic.listen(&taps.tap_handle, Box::new(add));
    Some(())
}

/// Begins to measure what the states of `system` cost, if it judges them.
fn watch_cost(system: &dyn System, taps: &Taps) -> Option<Sum<MeanCost>> {
    let (cost, state) = system.judge().quadratic_cost().zip(system.states_topic())?;
    let mean = Sum::default();
    listen(taps, state, &mean, move |mean: &mut MeanCost, head, row| {
        mean.state(head.at, (cost.of_state)(row));
    })?;
    Some(mean)
}

/// Begins to add up the figures of `system` in a run with `setup`; `None` without figures.
fn watch_figures(system: &dyn System, setup: &Setup, taps: &Taps) -> Option<Sum<SystemTally>> {
    let tally = system.judge().tally(setup)?;
    let (names, tally) = (tally.topics(), Arc::new(Mutex::new(tally)));
    for name in names {
        listen(taps, name, &tally, |tally, _, row| tally.message(name, row))?;
    }
    Some(tally)
}

impl Experiment {
    /// Builds the graph of `system` with the settings of `config`.
    ///
    /// # Errors
    /// [`BuildError`] if the graph cannot be built or a setting is invalid.
    pub fn new(system: Arc<dyn System>, config: &Config) -> Result<Self, BuildError> {
        let config = config.resolved(&*system)?;
        Self::from_resolved(system, config)
    }

    /// Builds the graph for running a recording again. The recorded run was turned by the
    /// `taken` knobs: this graph takes them, even if a new run may not. Nodes with `answers` start
    /// no program, and give these.
    ///
    /// # Errors
    /// [`BuildError`] if the system cannot, or does not take a setting.
    pub fn again(
        system: Arc<dyn System>,
        config: &Config,
        taken: &[TimedKnob],
        answers: AnswersOfNodes,
    ) -> Result<Self, BuildError> {
        let config = config.resolved(&*system)?;
        Self::built(system, config, (taken, answers), None)
    }

    /// Builds the graph for a process that runs only the nodes named in `here`, on the
    /// real clock: the others are in the graph, with their topics, and run elsewhere.
    ///
    /// # Errors
    /// [`BuildError`] if the graph cannot be built, a setting is invalid, or nodes are
    /// named that it lacks or that belong together.
    pub fn part(
        system: Arc<dyn System>,
        config: &Config,
        here: &[String],
    ) -> Result<Self, BuildError> {
        let config = Config {
            clock: ClockKind::Real,
            ..config.resolved(&*system)?
        };
        let part = Self::built(system, config, Default::default(), Some(here))?;
        let graph = part.graph.topology();
        let names: Vec<&str> = graph.nodes.iter().map(|node| &*node.name).collect();
        let refused = refusal_of_part(&part.system.groups(), &names, here);
        refused.map_or(Ok(part), |why| Err(BuildError::Setting(why)))
    }

    /// Builds the graph for a configuration with resolved messages; see [`Config::resolved`].
    ///
    /// # Errors
    /// [`BuildError`] if the graph cannot be built or a setting is invalid.
    pub fn from_resolved(system: Arc<dyn System>, config: Config) -> Result<Self, BuildError> {
        Self::built(system, config, Default::default(), None)
    }

    fn built(
        system: Arc<dyn System>,
        config: Config,
        (taken, answers): (&[TimedKnob], AnswersOfNodes),
        here: Option<&[String]>,
    ) -> Result<Self, BuildError> {
        let inputs = BuildInputs {
            seed: config.seed,
            setup: &config.setup,
            world: config.world,
            timed: &config.knobs,
            taken,
            answers,
            here,
        };
        let BuiltGraph {
            mut graph,
            topics,
            tracker,
        } = BuiltGraph::new(&*system, inputs)?;
        graph.set_clock(config.clock);
        graph.set_speed(config.speed);
        let timed = config.knobs.iter().cloned().map(TimedCommand::from);
        let (commands, inbox) = Inbox::new(timed.collect());
        // From here on the graph is observed, and logged under the real clock.
        let taps = Taps {
            tap_handle: TapHandle::new(&graph),
            topics,
            tracker,
        };
        if let Some(tracker) = &taps.tracker {
            taps.tap_handle.forward_records_to(tracker.clone());
        }
        RunLog::attach(&graph.state());
        Ok(Self {
            cost: watch_cost(&*system, &taps),
            tally: watch_figures(&*system, &config.setup, &taps),
            ages: None,
            system,
            config,
            graph,
            taps,
            commands,
            inbox,
        })
    }

    /// Checks that the caller's real clock can run the graph, if the run begins under it.
    ///
    /// # Errors
    /// [`BuildError`] if an executor needs more than the clock has.
    pub fn check_clock(&mut self, real: &dyn Clock) -> Result<(), BuildError> {
        self.graph.set_cores(real.cores());
        let refusal = self.graph.refusal_of(self.config.clock);
        refusal.map_or(Ok(()), |why| Err(BuildError::Setting(why)))
    }

    /// Returns the inputs of the run, with messages in recordable form; see
    /// [`SystemKnobs::resolve`](ratelab_system::SystemKnobs::resolve).
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// Returns the system.
    pub fn system(&self) -> &Arc<dyn System> {
        &self.system
    }

    /// Checks that the graph has this knob, and that all its value needs is loaded.
    ///
    /// # Errors
    /// The reason, with the available alternatives.
    pub fn check(&self, knob: &Knob) -> Result<(), KnobRefusal> {
        self.graph.check(knob)
    }

    /// Returns a sender of commands for the running graph.
    pub fn commands(&self) -> Sender<Command> {
        self.commands.clone()
    }

    /// Reads the graph while it runs.
    pub fn observer(&self) -> Observer {
        Observer::new(&self.graph)
    }

    /// Writes the state of the run, for what hears of nodes in other processes.
    pub fn run_writer(&self) -> RunWriter {
        self.graph.run_writer()
    }

    /// Taps the graph, before and during its run.
    pub fn taps(&self) -> Taps {
        self.taps.clone()
    }

    /// Adds up the ages of the run with their parts, for its summary; without this call nobody
    /// does.
    pub fn watch_ages(&mut self) {
        let (system, setup) = (&*self.system, &self.config.setup);
        self.ages = Some(AgeWatch::start(system, setup, &self.taps, self.observer()));
    }

    /// Adds timed `commands` to the knobs of the configuration.
    pub fn schedule(&mut self, commands: Vec<TimedCommand>) {
        self.inbox.schedule(commands);
    }

    /// Runs until the end time, or until a node or a command ends the run. All taps end
    /// with it.
    ///
    /// # Errors
    /// [`Fault`] if a node failed.
    pub fn run(self) -> Result<Summary, Fault> {
        self.run_with(&mut RealClock::default())
    }

    /// Runs as [`run`](Self::run) does, on the clock and at the speed of the configuration; `None` if
    /// `interrupt` stopped the run before it came to a result.
    ///
    /// # Errors
    /// [`Fault`] if a node failed.
    pub fn run_until(mut self, interrupt: &Interrupt) -> Result<Option<Summary>, Fault> {
        let end = self.config.end;
        self.inbox.stop_on(interrupt);
        let summary = self.run()?;
        let is_over = summary.sim_time >= end || summary.verdict.is_lost();
        Ok((is_over || !interrupt.is_asked()).then_some(summary))
    }

    /// Runs with the caller's real clock, such as one with real-time scheduling, whenever
    /// the run is on the real clock; or with [`ReExecution`](ratelab_re_execution::ReExecution), which
    /// executes such a run again.
    ///
    /// # Errors
    /// [`Fault`] if a node failed.
    pub fn run_with(mut self, real: &mut dyn Clock) -> Result<Summary, Fault> {
        let (observer, end, clock) = (self.observer(), self.config.end, self.config.clock);
        // From here on only the caller's senders can end a pause.
        drop(self.commands);
        let began = Instant::now();
        let end = run(&mut self.graph, &mut self.inbox, end, clock, real);
        let wall_time = began.elapsed();
        let system = &*self.system;
        let [state, chains] = [system.states_topic(), system.chains_topic()].map(|name| {
            name.and_then(|name| self.taps.topic(name)?.newest())
                .as_ref()
                .and_then(Rows::last)
                .map(|(_, row)| row.to_vec())
        });
        // Taps end with the topics, which the nodes hold as well.
        drop((self.graph, self.taps));
        let exit = end?;
        let sim_time = match exit {
            ClockExit::Ended { at, .. } => at,
            _ => observer.now(),
        };
        let newest = [state.as_deref(), chains.as_deref()];
        let verdict = system.verdict(&exit, sim_time, newest);
        let figures = self.tally.map(|tally| lock(&tally).figures());
        let summary = Summary {
            wall_time,
            figures: figures.unwrap_or_default(),
            state: state.unwrap_or_default(),
            chains: chains.unwrap_or_default(),
            cost: self.cost.and_then(|mean| lock(&mean).until(sim_time)),
            ..Summary::new(&self.config, verdict)
        };
        let mut summary = summary.observed(system, &observer);
        let ages = self.ages;
        let ages = ages.map(|ages| ages.finish(summary.sim_time, &summary.nodes));
        summary.set_ages(system, ages.unwrap_or_default());
        Ok(summary)
    }
}

/// Returns a world that moves by itself for a run of `system`: that of `config`, or one with the
/// default step; `None` if the system has none.
pub fn own_world(system: &Arc<dyn System>, config: &Config) -> Option<WorldKind> {
    if !config.world.is_course() {
        return Some(config.world);
    }
    let own = Config {
        world: WorldKind::OWN,
        ..config.clone()
    };
    let built = Experiment::new(system.clone(), &own);
    built.is_ok().then_some(WorldKind::OWN)
}

/// Returns the reason why the nodes named in `here` cannot be a process of their own, of all nodes
/// `names`, if there is one.
fn refusal_of_part(groups: &[Group], names: &[&str], here: &[String]) -> Option<String> {
    let is_here = |name: &str| here.iter().any(|node| node == name);
    if let Some(unknown) = here.iter().find(|node| !names.contains(&node.as_str())) {
        let known = names.join(", ");
        return Some(format!(
            "there is no node {unknown:?}: expected some of {known}"
        ));
    }
    for Group { name, nodes } in groups {
        let (in_here, away): (Vec<&str>, Vec<&str>) = nodes
            .iter()
            .map(String::as_str)
            .filter(|node| names.contains(node))
            .partition(|node| is_here(node));
        if let (Some(here), Some(away)) = (in_here.first(), away.first()) {
            return Some(format!(
                "{here} and {away} share the {name}: run them in one process, as {name}"
            ));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_that_share_something_are_one_process() {
        let groups = [Group::new("plant", ["sensor", "actuator"])];
        let names = ["sensor", "policy", "actuator"];
        for (here, expected) in [
            (&["policy"][..], None),
            (&["sensor", "actuator"], None),
            (&[], None),
            (
                &["sensor"],
                Some("sensor and actuator share the plant: run them in one process, as plant"),
            ),
            (
                &["pilot"],
                Some("there is no node \"pilot\": expected some of sensor, policy, actuator"),
            ),
        ] {
            let here: Vec<String> = here.iter().map(|name| (*name).to_owned()).collect();
            let refused = refusal_of_part(&groups, &names, &here);
            assert_eq!(refused.as_deref(), expected, "{here:?}");
        }
    }
}
