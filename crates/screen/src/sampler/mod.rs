//! Creates frames of a running session.

mod data;
mod standing;

use std::{
    collections::VecDeque,
    time::{Duration, Instant},
};

use ratelab::{ClockExit, Event, Head, KnobKind, Time, TimeSpan, TimedKnob};
use ratelab_experiment::{
    Config,
    cause::{Facts, Hang, late},
};
use ratelab_metrics::{LATELY, Rows, Snapshot};
use ratelab_system::{AgeLimits, Setup, System, Verdict, depends_on_the_world, names, plant_topic};

use data::{Figures, marks, topic_data};
use standing::RunMoment;

use super::{
    age::AgeData,
    asked::Asked,
    cause::CureTrials,
    frame::{FrameData, Ghost, LatencyData, PlanData, SignalTrace, TRACE_S},
    knobs::{RATE_KEYS, first_node, setting},
    plan::Plans,
    push_age::PushAges,
    run::{RunDigest, RunSource, WatchedRows, signal, signal_is_push_age},
};

/// Duration of the light on a node after a tick (wall time).
const LIT: Duration = Duration::from_millis(100);

/// Points kept for the chart: an hour at 50 Hz.
const POINTS_KEPT: usize = 180_000;

/// State kept between frames.
#[derive(Default)]
pub struct Sampler {
    /// Per node, the tick count at the last sample and the time of its last change.
    ticks: Vec<(u64, Option<Instant>)>,
    /// Number of events already searched for knobs.
    events: usize,
    /// The knobs turned since the start of the run.
    turned: Vec<TimedKnob>,
    /// The run again without what made its pushes old.
    trials: CureTrials,
    figures: Figures,
    /// The newest state of the plant, and its run time.
    state: Vec<f64>,
    state_at: Time,
    /// The verdict from the first lost state on; `None` while the states are not lost.
    lost: Option<Verdict>,
    /// Age of the sensing behind the newest state.
    newest_age: Option<f64>,
    /// Push age over time.
    push_ages: PushAges,
    /// What is planned ahead.
    pub plans: Plans,
    /// The age limits with the setup in force.
    limits: Asked<Setup, AgeLimits>,
    /// Whether the screen hides them.
    pub hides_limits: bool,
    /// Run time (s) and value of the signal.
    points: VecDeque<(f64, f64)>,
    /// The previous run.
    last: Option<LastRun>,
}

/// A run for comparison.
struct LastRun {
    ghost: Ghost,
    /// To compare with; a recorded run has none.
    digest: Option<RunDigest>,
    ended: bool,
}

impl Sampler {
    /// Returns a frame of `session` as of now, with its new `rows`.
    pub fn frame_data(&mut self, session: &mut dyn RunSource, rows: &[WatchedRows]) -> FrameData {
        let graph = self.take(session, rows);
        let (session, now): (&dyn RunSource, _) = (session, graph.now);
        let (system, config) = (session.system(), session.config());
        let (setup, hangs) = self.knobs(config);
        let age = self.age(session, &graph, &setup);
        let plan = (system.robot().planning()).and_then(|plan| self.plans.at(&plan, now));
        let at_rest = session.at_rest();
        self.figures.refresh(system, &graph, at_rest);
        let lit = self.lit_nodes(&graph, session.summary().is_none(), at_rest);
        let lineage = session.lineage();
        let moment = RunMoment {
            session,
            facts: Facts {
                system,
                setup: &setup,
                commands: &self.turned,
                lost: self.lost.is_some()
                    || session.summary().is_some_and(|run| run.verdict.is_lost()),
                graph: &graph,
                lineage,
                age,
                late: late(system, &graph, lineage, age),
                plan: plan.as_ref().map(PlanData::facts),
                hangs: &hangs,
                stepped_rates: RATE_KEYS.len(),
            },
            live: session.live(),
            state: &self.state,
            state_at: self.state_at,
            lost: self.lost.clone(),
            same: self.same(session),
        };
        let (verdict, push) = (moment.verdict(&mut self.trials), moment.push());
        let figures = &self.figures;
        let nodes = graph.nodes.iter().zip(&figures.nodes).zip(lit);
        let topics = graph.topics.iter().zip(&figures.ages);
        FrameData {
            now,
            wall_s: session.wall_time().as_secs(),
            status: graph.status,
            seed: config.seed,
            world: world(session, &setup),
            settings: settings(system, &setup),
            wrong_stamps: wrong_stamps(&setup),
            verdict,
            age,
            awaits_limits: self.limits.is_coming() || self.trials.is_coming(),
            push,
            same: moment.same,
            latency: self.latency(),
            nodes: nodes
                .map(|((node, figures), lit)| moment.node(node, *figures, lit))
                .collect(),
            topics: topics
                .map(|(topic, age)| topic_data(topic, *age, now))
                .collect(),
            plan,
            state: self.state.clone(),
            telemetry_lost: session.lost(),
        }
    }

    /// Returns the latency of the system, with the newest age.
    fn latency(&self) -> Option<LatencyData> {
        let latency = self.figures.latency.clone()?;
        Some(LatencyData {
            newest: self.newest_age,
            ..latency
        })
    }

    /// Takes the new `rows` and knobs of `session`; returns its graph.
    fn take(&mut self, session: &mut dyn RunSource, rows: &[WatchedRows]) -> Snapshot {
        let (system, observer) = (session.system(), session.observer());
        let events = observer.events(self.events);
        self.events += events.len();
        self.turned.extend(events.iter().filter_map(Event::knob));
        let graph = observer.snapshot();
        self.push_ages.look(system, &graph);
        for (topic, rows) in rows {
            self.remember(system, topic, rows);
        }
        // By now it has all that the counters have.
        session.update_lineage();
        graph
    }

    /// Looks at the age of the push between two frames.
    pub fn look(&mut self, session: &dyn RunSource) {
        let graph = session.observer().snapshot();
        self.push_ages.look(session.system(), &graph);
    }

    /// Creates the sampler of the run after `session`.
    pub fn next(&self, session: &dyn RunSource) -> Self {
        let ghost = Ghost {
            points: self.points.iter().copied().collect(),
            ages: self.push_ages.saw(0.0, f64::INFINITY).into(),
        };
        let last = LastRun {
            ghost,
            digest: session.digest().cloned(),
            ended: session.summary().is_some(),
        };
        Self {
            last: Some(last),
            ..Self::default()
        }
    }

    /// Returns whether `session` equals the previous run so far, bit for bit.
    fn same(&self, session: &dyn RunSource) -> Option<bool> {
        let last = self.last.as_ref()?;
        let whole = session.summary().is_some() && last.ended;
        Some(session.digest()?.is_same(last.digest.as_ref()?, whole))
    }

    /// Returns the signal before `now`, with a mark for each knob in `events`; `None` without a
    /// signal.
    pub fn trace(&self, system: &dyn System, now: Time, events: &[Event]) -> Option<SignalTrace> {
        let end = now.as_secs_f64();
        let begin = end - TRACE_S;
        let from = self.points.partition_point(|(at, _)| *at < begin);
        let to = self.points.partition_point(|(at, _)| *at <= end);
        let last = self.last.as_ref();
        Some(SignalTrace {
            signal: signal(system)?,
            points: self.points.range(from..to).copied().collect(),
            ages: if signal_is_push_age(system) {
                Vec::new()
            } else {
                self.push_ages.saw(begin, end)
            },
            // They are for what no plan predicted, and this is all of the age.
            limits: match self.plans.predicted(TimeSpan::new(now - LATELY, now)) {
                Some(Duration::ZERO) | None if !self.hides_limits => self.limits(),
                _ => AgeLimits::default(),
            },
            safe: None,
            marks: marks(system, events, begin),
            ghost: last.map_or_else(Ghost::default, |last| last.ghost.clone()),
        })
    }

    /// Returns the knobs in force in a run of `config`, and its hangs.
    fn knobs(&self, config: &Config) -> (Setup, Vec<Hang>) {
        let mut setup = config.setup.clone();
        setup.extend(self.turned.iter().map(|timed| timed.knob.clone()));
        let mut hangs = Hang::at_the_start(&config.setup);
        hangs.extend(self.turned.iter().filter_map(Hang::from_knob));
        (setup, hangs)
    }

    /// Returns the recent push age and its limits.
    fn age(&mut self, session: &dyn RunSource, graph: &Snapshot, setup: &Setup) -> Option<AgeData> {
        let period = first_node(session.system(), graph).map(|node| node.hz.period());
        let recent = self
            .push_ages
            .recent(period.unwrap_or_default(), graph.now)?;
        if !self.limits.is(setup) {
            let system = session.shared_system().clone();
            self.limits
                .ask(setup.clone(), move |setup| system.judge().age_limits(setup));
        }
        self.limits.receive(session.summary().is_some());
        Some(AgeData {
            limits: self.limits(),
            predicted: self.plans.predicted(recent.stretch),
            hidden: self.hides_limits,
            ..recent
        })
    }

    /// Returns the age limits as far as computed.
    fn limits(&self) -> AgeLimits {
        self.limits.newest().copied().unwrap_or_default()
    }

    fn remember(&mut self, system: &dyn System, topic: &str, rows: &Rows) {
        if let Some(signal) = signal(system).filter(|signal| signal.topic == topic) {
            let points = rows
                .iter()
                .map(|(head, row)| (head.at.as_secs_f64(), signal.value.compute(row)));
            self.points.extend(points);
            let old = self.points.len().saturating_sub(POINTS_KEPT);
            self.points.drain(..old);
        }
        if let Some(planning) = system.robot().planning() {
            self.plans.remember(&planning, topic, rows);
        }
        if system.states_topic() == Some(topic) {
            rows.iter()
                .for_each(|(head, row)| self.judge(system, head, row));
            if let Some((head, row)) = rows.last() {
                self.state = row.to_vec();
                self.state_at = head.at;
                self.newest_age = age(head);
            }
        }
    }

    fn judge(&mut self, system: &dyn System, head: &Head, state: &[f64]) {
        let (exit, at) = (&ClockExit::Stopped, head.at);
        let verdict = if system.chains_topic() == system.states_topic() {
            system.verdict(exit, at, [Some(state); 2])
        } else {
            system.judge().verdict(exit, at, Some(state))
        };
        // A lost run stays lost from its first moment on.
        let lost = self.lost.take();
        self.lost = verdict.is_lost().then(|| lost.unwrap_or(verdict));
        if let Some(sensed) = head.origin {
            self.push_ages.state(head.at, sensed);
        }
    }

    /// Returns the nodes that ticked recently; at rest, the nodes that ticked last.
    fn lit_nodes(&mut self, snapshot: &Snapshot, running: bool, at_rest: bool) -> Vec<bool> {
        self.ticks.resize(snapshot.nodes.len(), (0, None));
        let now = Instant::now();
        for (node, (ticks, changed)) in snapshot.nodes.iter().zip(&mut self.ticks) {
            if node.ticks != *ticks {
                (*ticks, *changed) = (node.ticks, Some(now));
            }
        }
        let last_change = self.ticks.iter().filter_map(|(_, changed)| *changed).max();
        let lit = |changed: Option<Instant>| match (changed, at_rest) {
            (None, _) => false,
            _ if !running => false,
            (changed, true) => changed == last_change,
            (Some(changed), false) => now - changed < LIT,
        };
        self.ticks
            .iter()
            .map(|(_, changed)| lit(*changed))
            .collect()
    }
}

/// Returns the messages in `setup`, such as `policy scripted`.
fn settings(system: &dyn System, setup: &Setup) -> Vec<String> {
    let shown = names::shown(system, |alias| names::is_set(alias, setup)).into_iter();
    shown
        .filter(|alias| alias.kind() == KnobKind::Send)
        .map(|alias| setting(system, alias, setup))
        .collect()
}

/// Returns the nodes whose clocks for stamps are wrong in `setup`, each with its error.
fn wrong_stamps(setup: &Setup) -> Vec<String> {
    setup
        .iter()
        .filter(|knob| knob.kind() == KnobKind::StampClock && knob.value() != "0 0")
        .map(|knob| format!("{} ({})", knob.target(), knob.value()))
        .collect()
}

/// Returns a note on the world of `session`, where it is relevant.
fn world(session: &dyn RunSource, setup: &Setup) -> Option<&'static str> {
    let moves = session.system().about().plant.is_some();
    if moves || !session.config().world.is_course() {
        return Some("world: own");
    }
    plant_topic(session.system())?;
    let asked = setup.iter().any(depends_on_the_world);
    asked.then_some("world: waits")
}

/// Returns the age of the sensing behind a message at its publication (s).
fn age(head: &Head) -> Option<f64> {
    let sensed = head.origin?.as_secs_f64();
    Some(head.at.as_secs_f64() - sensed)
}
