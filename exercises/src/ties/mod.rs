//! Ties between due times: one graph, two schedules, two latencies.

mod accumulating;

use ratelab::{Depth, Flow, Graph, GraphError, Hz, Node, Tick, Time, Topic, Wiring};
use ratelab_cart_pole::{
    ACTION, ACTUATOR, Action, Actuator, CartPole, ControlStep, OBS, Observation, POLICY, Plant,
    PolicyNode, SENSE_TO_ACT, SENSOR, STATE, Sensor, SharedPlant, SimilarReadings,
    policy::Scripted,
};
use ratelab_experiment::{Config, Experiment};
use ratelab_metrics::{Distribution, Observer, Snapshot};
use ratelab_system::BuildError;

use crate::framework::{
    Answer, Failure, Findings, Measurement, PredictionPlace, Table, asked, cart_pole, hz, mean_ms,
};

/// Control rates, as published (Hz).
const RATES: [f64; 6] = [50.0, 25.0, 20.0, 15.0, 10.0, 5.0];

/// The rate of the question (Hz).
const ASKED: f64 = 25.0;

pub(crate) fn measure() -> Result<Findings, Failure> {
    let pairs = Pair::for_rates(&RATES, |nodes, hz, end| {
        accumulating::schedule(nodes, hz.get(), end.as_secs_f64())
    })?;
    let asked = asked(&pairs, |pair| pair.hz.get() == ASKED)?;
    Ok(Findings {
        table: table(&pairs),
        place: PredictionPlace::Column(2),
        answer: Answer::Exactly(asked.exact.latency_ms),
        meaning: meaning(asked),
        measurements: pairs.iter().flat_map(measurements).collect(),
    })
}

/// The result of a run, under any scheduler.
pub(crate) struct TimedRun {
    /// Mean latency from sensing to acting.
    pub(crate) latency_ms: f64,
    /// Mean age of readings when the policy used them.
    reading_age_ms: f64,
    /// Mean age of actions when they were applied.
    action_age_ms: f64,
    /// Readings lost unread.
    dropped: u64,
    /// Control steps of the plant.
    pub(crate) steps: u64,
}

impl TimedRun {
    /// Runs `config` under the lab's scheduler.
    fn exact(config: &Config) -> Result<Self, Failure> {
        let experiment = Experiment::new(cart_pole(), config)?;
        let observer = experiment.observer();
        let summary = experiment.run()?;
        Ok(Self::new(&observer.snapshot(), summary.steps))
    }

    /// Creates the result of a run with these accounts and plant steps.
    fn new(run: &Snapshot, steps: u64) -> Self {
        let reader = |topic| run.topic(topic).and_then(|topic| topic.readers.first());
        let age_ms = |topic| mean_ms(reader(topic).and_then(|reader| reader.ages.mean_s()));
        let latency = run.meter(ACTUATOR, SENSE_TO_ACT);
        Self {
            latency_ms: mean_ms(latency.and_then(Distribution::mean_s)),
            reading_age_ms: age_ms(OBS),
            action_age_ms: age_ms(ACTION),
            dropped: reader(OBS).map_or(0, |reader| reader.dropped),
            steps,
        }
    }

    pub(crate) fn latency(&self) -> String {
        format!("{:.4} ms", self.latency_ms)
    }

    pub(crate) fn reading_age(&self) -> String {
        format!("{:.1} ms", self.reading_age_ms)
    }

    fn action_age(&self) -> String {
        format!("{:.1} ms", self.action_age_ms)
    }
}

/// A run with a control rate under another scheduler, and under the lab's.
pub(crate) struct Pair {
    pub(crate) hz: Hz,
    pub(crate) other: TimedRun,
    pub(crate) exact: TimedRun,
}

impl Pair {
    /// Returns a pair for each of `rates` (Hz); `schedule` ticks the nodes of the other run, with
    /// the policy at the rate, up to a run time.
    pub(crate) fn for_rates(
        rates: &[f64],
        schedule: impl Fn(&mut Nodes, Hz, Time) -> Result<(), Failure>,
    ) -> Result<Vec<Self>, Failure> {
        let pairs = hz(rates)?.into_iter().map(|hz| {
            let config = CartPole::config(&format!("control-hz {}", hz.get()))?;
            let run = |nodes: &mut Nodes| schedule(nodes, hz, config.end);
            Ok(Self {
                hz,
                other: run_nodes(config.seed, run)?,
                exact: TimedRun::exact(&config)?,
            })
        });
        pairs.collect()
    }
}

fn meaning(pair: &Pair) -> String {
    let (added, exact) = (&pair.other, &pair.exact);
    format!(
        "At {} the scheduler that adds periods reports {:.4} ms, the exact one {:.4} ms: \
             {:.1} ms less. Added up, the due times of policy and sensor differ in the last bit, \
             and where they should be equal this bit decides who ticks first. Sometimes the policy \
             ticks just before the sensor and uses the reading of one period ago (readings are \
             {:.1} ms older on average). Sometimes it ticks just after the actuator, and its action \
             waits for the next step (actions are {:.1} ms older). Each time one period of the \
             plant is lost, and the drops do not show it: {} in the one, {} in the other.",
        pair.hz,
        added.latency_ms,
        exact.latency_ms,
        added.latency_ms - exact.latency_ms,
        added.reading_age_ms - exact.reading_age_ms,
        added.action_age_ms - exact.action_age_ms,
        added.dropped,
        exact.dropped,
    )
}

fn measurements(pair: &Pair) -> impl Iterator<Item = Measurement> {
    let runs = [("periods added", &pair.other), ("exact time", &pair.exact)];
    runs.into_iter().flat_map(|(how, run)| {
        Measurement::list(
            format_args!("{}, {how}", pair.hz),
            [
                ("mean latency (ms)", run.latency_ms),
                ("/obs dropped", run.dropped as f64),
                ("steps", run.steps as f64),
            ],
        )
    })
}

/// Returns a row for each rate, with both schedules side by side.
fn table(pairs: &[Pair]) -> Table {
    Table::from_items(
        pairs,
        &[
            ("rate", &|pair| pair.hz.to_string()),
            ("periods added", &|pair| pair.other.latency()),
            ("exact time", &|pair| pair.exact.latency()),
            ("reading age", &|pair| pair.other.reading_age()),
            ("exact", &|pair| pair.exact.reading_age()),
            ("action age", &|pair| pair.other.action_age()),
            ("exact", &|pair| pair.exact.action_age()),
        ],
    )
}

/// The nodes by priority: sensor, policy and actuator.
pub struct Nodes {
    sensor: Sensor,
    policy: PolicyNode,
    actuator: Actuator,
}

impl Nodes {
    /// Ticks node number `node` at run time `now`; returns whether the run goes on.
    ///
    /// # Errors
    /// [`Failure`] if the node fails.
    pub fn tick(&mut self, node: usize, now: Time) -> Result<bool, Failure> {
        let nodes: [&mut dyn Node; 3] = [&mut self.sensor, &mut self.policy, &mut self.actuator];
        let Some(node) = nodes.into_iter().nth(node) else {
            return Ok(false);
        };
        let mut tick = Tick::at(now);
        let flow = node.tick(&mut tick)?;
        Ok(flow.and(node.apply(&mut tick)?) == Flow::Continue)
    }
}

/// Runs the scripted policy from the start for `seed`, with defaults for the rest, as
/// `schedule` ticks the nodes.
///
/// # Errors
/// [`Failure`] if the plant cannot be created, or of the schedule.
pub fn run_nodes(
    seed: u64,
    schedule: impl FnOnce(&mut Nodes) -> Result<(), Failure>,
) -> Result<TimedRun, Failure> {
    let plant = SharedPlant::new(Plant::new(seed)?);
    let (graph, mut nodes) = wired(&plant)?;
    let observer = Observer::new(&graph);
    schedule(&mut nodes)?;
    let steps = plant.at(Time::ZERO).steps();
    Ok(TimedRun::new(&observer.snapshot(), steps))
}

/// Returns the nodes, with their ends of topics from a graph that only measures: it never runs.
fn wired(plant: &SharedPlant) -> Result<(Graph, Nodes), BuildError> {
    let mut graph = Graph::new();
    let observations = Topic::<Observation>::new(OBS, Depth::ONE);
    let actions = Topic::<Action>::new(ACTION, Depth::ONE);
    let steps = Topic::<ControlStep>::new(STATE, Depth::ONE);
    let sensor = taken(&mut graph, SENSOR, |wiring| Sensor {
        plant: plant.clone(),
        observations: wiring.publisher(&observations),
        similar: SimilarReadings::default(),
    })?;
    let policy = taken(&mut graph, POLICY, |wiring| PolicyNode {
        policy: Box::new(Scripted),
        observations: wiring.subscription(&observations),
        actions: wiring.publisher(&actions),
    })?;
    let actuator = taken(&mut graph, ACTUATOR, |wiring| {
        Actuator::wired(wiring, plant.clone(), &actions, Some(&steps))
    })?;
    let nodes = Nodes {
        sensor,
        policy,
        actuator,
    };
    Ok((graph, nodes))
}

/// Adds a node called `name` to the graph, and takes it out to be ticked from elsewhere.
fn taken<N>(
    graph: &mut Graph,
    name: &str,
    build: impl FnOnce(&mut Wiring<'_>) -> N,
) -> Result<N, GraphError> {
    let mut node = None;
    graph.node(name, Hz::MIN, 0, |wiring| {
        node = Some(build(wiring));
        |_: &mut Tick| {}
    })?;
    node.ok_or_else(|| GraphError::DuplicateNode(name.to_owned()))
}
