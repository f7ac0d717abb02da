//! What every command works on: a graph with a name; and a graph of the library as one.

use ratelab::{ClockExit, Knob, Time, Topology};

use crate::{
    About, BuildError, BuildInputs, Builder, BuiltGraph, CHAINS, Group, Judge, RobotInfo, Setup,
    Signal, SystemKnobs, Verdict, VerdictKind,
};

/// A graph that every command runs, shows and records. Only its name and its nodes are required.
///
/// What a run means, what the robot looks like and what knobs mean are in traits of their own, which a
/// system returns from [`judge`](Self::judge), [`robot`](Self::robot) and [`knobs`](Self::knobs):
/// usually itself.
pub trait System: Send + Sync + 'static {
    /// Returns the name, such as `drone`. Recordings contain it.
    fn name(&self) -> &str;

    /// Adds the system's nodes and topics to an empty graph. Called once per run; builds
    /// the same graph for the same [`Setup`].
    ///
    /// # Errors
    /// [`BuildError`] if the graph cannot be built.
    fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError>;

    /// Describes the graph.
    fn about(&self) -> About<'_> {
        About::default()
    }

    /// Returns the groups of nodes that share something beside topics, such as the plant: each runs in
    /// one process.
    fn groups(&self) -> Vec<Group> {
        Vec::new()
    }

    /// Returns the signals to plot, the most important first.
    fn signals(&self) -> Vec<Signal> {
        Vec::new()
    }

    /// Returns defects of a run with `setup` that are known before it begins, each with a remedy.
    fn warnings(&self, setup: &Setup) -> Vec<String> {
        let _ = setup;
        Vec::new()
    }

    /// Returns nodes that are asked for more than they can do in a run with `setup`, unless
    /// [`warnings`](Self::warnings) has them. They are told before the run; in a run the parts of
    /// the age tell.
    fn overloads(&self, setup: &Setup) -> Vec<String> {
        let _ = setup;
        Vec::new()
    }

    /// Returns the judge of its runs. By default a run is judged by the reason for its end.
    fn judge(&self) -> &dyn Judge {
        &Plain
    }

    /// Returns what is known of its robot. By default nothing is: it is a graph around data only.
    fn robot(&self) -> &dyn RobotInfo {
        &Plain
    }

    /// Returns what is particular about its knobs. By default nothing is.
    fn knobs(&self) -> &dyn SystemKnobs {
        &Plain
    }
}

/// Answers for a system that does not answer itself.
struct Plain;

impl Judge for Plain {}

impl RobotInfo for Plain {}

impl SystemKnobs for Plain {}

impl BuiltGraph {
    /// Builds the graph of `system`.
    ///
    /// # Errors
    /// [`BuildError`] if the graph cannot be built, or a setting is invalid.
    pub fn new(system: &dyn System, inputs: BuildInputs<'_>) -> Result<Self, BuildError> {
        let mut builder = Builder::new(inputs.seed, inputs.setup, inputs.world);
        (builder.taken, builder.here) = (inputs.taken, inputs.here);
        builder.answers = inputs.answers;
        system.build(&mut builder)?;
        builder.finish(inputs.timed)
    }
}

impl dyn System + '_ {
    /// Returns the topic of its states; see [`About::state`].
    pub fn states_topic(&self) -> Option<&str> {
        self.about().state
    }

    /// Returns the node and the meter of its main latency; see [`About::latency`].
    pub fn latency(&self) -> Option<(&str, &str)> {
        self.about().latency
    }

    /// Returns the topic with the data ages of its chains; `None` without chains.
    pub fn chains_topic(&self) -> Option<&'static str> {
        (!self.about().chains.is_empty()).then_some(CHAINS)
    }

    /// Returns the verdict on a run that stopped with `exit` at run time `at`, from the newest
    /// messages of its states and of its chains.
    pub fn verdict(
        &self,
        exit: &ClockExit,
        at: Time,
        [state, chains]: [Option<&[f64]>; 2],
    ) -> Verdict {
        let verdict = self.judge().verdict(exit, at, state);
        if verdict.is_lost() {
            return verdict;
        }
        let over = *exit != ClockExit::Stopped;
        let missed = self
            .about()
            .chains
            .iter()
            .find_map(|chain| chain.missed(at, chains, over));
        missed.map_or(verdict, |missed| Verdict::new(missed.clone(), at))
    }

    /// Returns all kinds of verdicts on its runs. The first is that of a successful run.
    pub fn verdicts(&self) -> Vec<VerdictKind> {
        let of_chains = self
            .about()
            .chains
            .iter()
            .flat_map(|chain| chain.verdicts());
        self.judge()
            .verdicts()
            .into_iter()
            .chain(of_chains.cloned())
            .collect()
    }

    /// Returns `knob` in recordable form, for a run with this `seed` and `setup`: its
    /// message or its parameter resolved.
    ///
    /// # Errors
    /// The reason why the node would refuse it.
    pub fn resolved(&self, seed: u64, setup: &Setup, knob: Knob) -> Result<Knob, String> {
        match knob {
            Knob::Send { node, text } => {
                let text = self.knobs().resolve(seed, setup, &node, &text)?;
                Ok(Knob::Send { node, text })
            }
            Knob::Parameter { node, name, value } => {
                let value = self.knobs().parameter([&node, &name], &value)?;
                Ok(Knob::Parameter { node, name, value })
            }
            knob => Ok(knob),
        }
    }
}

/// Returns the topic of the states of a plant; `None` for a graph around data only.
pub fn plant_topic(system: &dyn System) -> Option<&str> {
    let state = system.states_topic();
    state.filter(|state| Some(*state) != system.chains_topic())
}

/// Returns the index of the node of `graph` with the [latency](About::latency) of `system`.
pub fn acting_node(system: &dyn System, graph: &Topology) -> Option<usize> {
    let (acts, _) = system.latency()?;
    graph.node(acts)
}

/// A [`Graph`](ratelab::Graph) of the library as a system, by the function that adds its nodes:
/// the lab opens it as it is.
///
/// ```
/// use std::sync::Arc;
/// use ratelab::{Depth, Graph, Hz, Tick, Topic};
/// use ratelab_experiment::{Config, Experiment};
/// use ratelab_system::{BuildError, LibraryGraph};
///
/// fn wire(graph: &mut Graph) -> Result<(), BuildError> {
///     let count = Topic::new("/count", Depth::ONE);
///     graph.node("counter", Hz::new(10.0)?, 0, |wiring| {
///         let (count, mut number) = (wiring.publisher(&count), 0);
///         move |tick: &mut Tick| {
///             number += 1;
///             tick.publish(&count, number);
///         }
///     })?;
///     Ok(graph.node("reader", Hz::new(2.0)?, 1, |wiring| {
///         let mut count = wiring.subscription(&count);
///         move |tick: &mut Tick| {
///             tick.read(&mut count);
///         }
///     })?)
/// }
///
/// let system = LibraryGraph::new("counter", |builder| wire(builder.graph()));
/// let mut config = Config::default();
/// config.setup.set("rate reader 5".parse()?);
/// let summary = Experiment::new(Arc::new(system), &config)?.run()?;
/// assert_eq!(summary.topic("/count").expect("a topic").published, 101);
/// assert_eq!(summary.node("reader").map(|node| node.ticks), Some(51));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct LibraryGraph<F> {
    name: String,
    wire: F,
}

impl<F> LibraryGraph<F>
where
    F: Fn(&mut Builder<'_>) -> Result<(), BuildError> + Send + Sync + 'static,
{
    /// Creates the graph called `name` that `wire` adds to [`Builder::graph`].
    pub fn new(name: impl Into<String>, wire: F) -> Self {
        let name = name.into();
        Self { name, wire }
    }
}

impl<F> System for LibraryGraph<F>
where
    F: Fn(&mut Builder<'_>) -> Result<(), BuildError> + Send + Sync + 'static,
{
    fn name(&self) -> &str {
        &self.name
    }

    fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
        (self.wire)(builder)
    }
}
