//! Creates frames of a running session.

use std::{
    collections::{HashSet, VecDeque},
    sync::Arc,
    time::{Duration, Instant},
};

use ratelab::{ClockExit, Event, Head, KnobKind, Time};
use ratelab_account::{Lineage, NodeAccount, Observer, Rows, Snapshot, TopicAccount};
use ratelab_study::{
    experiment::{Config, Summary},
    system::{Setup, Signal, System, Verdict, VerdictKind, verdict},
};

use super::{
    age_limits::LimitsInForce,
    cause::{CureTrials, Facts, Hang, Trial, acting, latest},
    figures::{Figures, NodeFigures},
    flights::dots,
    frame::{
        AgeData, FrameData, Ghost, Health, LatencyData, NodeData, PartKind, Place, PushData,
        PushSentence, Quantiles, SignalTrace, Standing, Strain, TRACE_S, TopicData, VerdictData,
    },
    knob_focus::first_node,
    push_age::PushAges,
    reaction,
    sameness::RunDigest,
    settings::{in_words, setting},
    timeline::{Timeline, TimelineView},
};
use crate::{
    names,
    timing::{depends_on_the_world, plant},
};

/// Run time without a step after which the plant stands still, unless two periods are
/// longer.
const STILL: Duration = Duration::from_millis(250);

/// Why the same rates may give another age from the start.
const PHASE: &str = "turned on the way, ticks meet at another phase: after r the age may differ";

/// Duration of the light on a node after a tick (wall time).
const LIT: Duration = Duration::from_millis(100);

/// Points kept for the chart: an hour at 50 Hz.
const POINTS_KEPT: usize = 180_000;

/// New messages of a watched topic, with its name.
pub type WatchedRows = (&'static str, Rows);

/// The topics whose every message is drawn: the topic of states, and that of the first
/// signal.
pub fn watched(system: &dyn System) -> impl Iterator<Item = &'static str> {
    let (state, signal) = (system.state(), signal(system).map(|signal| signal.topic));
    state
        .into_iter()
        .chain(signal.filter(move |topic| Some(*topic) != state))
}

/// The plotted signal.
pub fn signal(system: &dyn System) -> Option<&Signal> {
    system.signals().first()
}

/// A source of frames: a live run or a replay.
pub trait RunSource {
    /// The system.
    fn shared_system(&self) -> &Arc<dyn System>;

    /// The same as a reference.
    fn system(&self) -> &dyn System {
        &**self.shared_system()
    }

    /// The configuration at the start.
    fn config(&self) -> &Config;

    /// Reads the graph.
    fn observer(&self) -> &Observer;

    /// Wall time since the beginning, or of the whole run.
    fn wall_time(&self) -> Duration;

    /// The chains behind its actions, as of the last update.
    fn lineage(&self) -> &Lineage;

    /// Brings these chains up to now.
    fn update_lineage(&mut self) {}

    /// The digest of the run so far, if it is to be compared with another run.
    fn digest(&self) -> Option<&RunDigest> {
        None
    }

    /// The messages on the [`watched`] topics since the last call.
    fn new_rows(&mut self) -> Vec<WatchedRows>;

    /// Number of messages lost because the dashboard was too slow.
    fn lost(&self) -> u64;

    /// The summary, once the run is over.
    fn summary(&self) -> Option<&Summary>;

    /// The process in which the node called `node` runs, if that is another one.
    fn place(&self, node: &str) -> Option<Place> {
        let _ = node;
        None
    }

    /// Whether its knobs can be turned.
    fn live(&self) -> bool {
        true
    }

    /// Whether it is at rest.
    fn at_rest(&self) -> bool {
        self.observer().status().paused || self.summary().is_some()
    }
}

/// State kept between frames.
#[derive(Default)]
pub struct Sampler {
    /// Per node, the tick count at the last sample and the time of its last change.
    ticks: Vec<(u64, Option<Instant>)>,
    /// Number of events already searched for knobs.
    events: usize,
    /// The knobs turned since the start of the run.
    turned: Setup,
    /// The hangs turned since the start of the run.
    hangs: Vec<Hang>,
    /// The run again without what made its pushes old.
    trials: CureTrials,
    figures: Figures,
    /// The newest state of the plant.
    state: Vec<f64>,
    /// The verdict from the first lost state on; `None` while the states are not lost.
    lost: Option<Verdict>,
    /// Age of the sensing behind the newest state.
    newest_age: Option<f64>,
    /// Push age over time.
    push_ages: PushAges,
    /// The age limits with the setup in force.
    limits: LimitsInForce,
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
    /// A frame of `session` as of now, with its new `rows`.
    pub fn frame_data(&mut self, session: &mut impl RunSource, rows: &[WatchedRows]) -> FrameData {
        let (system, observer) = (session.system(), session.observer());
        self.push_ages.meet(system, || observer.snapshot());
        for (topic, rows) in rows {
            self.remember(session.system(), topic, rows);
        }
        self.follow_knobs(session.observer());
        let counters = session.observer().snapshot();
        self.push_ages.look(&counters);
        let age = self.age(session, &counters);
        let verdict = self.verdict(session, &counters, age);
        let push = push(session, &counters, age);
        let running = session.summary().is_none();
        let at_rest = session.at_rest();
        self.figures.refresh(session.system(), &counters, at_rest);
        let lit = self.lit_nodes(&counters, running, at_rest);
        let hangs = self.hangs(session);
        let figures = &self.figures;
        let nodes = counters.nodes.iter().zip(&figures.nodes).zip(lit);
        let topics = counters.topics.iter().zip(&figures.ages);
        FrameData {
            now: counters.now,
            wall_s: session.wall_time().as_secs(),
            status: counters.status,
            seed: session.config().seed,
            world: world(session, &self.setup(session)),
            settings: self.settings(session),
            verdict,
            age,
            awaits_limits: self.limits.are_coming() || self.trials.are_coming(),
            push,
            same: self.same(session),
            latency: figures.latency.as_ref().map(|latency| LatencyData {
                newest: self.newest_age,
                ..latency.clone()
            }),
            nodes: nodes
                .map(|((node, figures), lit)| NodeData {
                    lit,
                    ..node_data(session, node, *figures, (&hangs, counters.now))
                })
                .collect(),
            topics: topics
                .map(|(topic, age)| topic_data(topic, *age, counters.now))
                .collect(),
            state: self.state.clone(),
            telemetry_lost: session.lost(),
        }
    }

    /// Looks at the age of the push between two frames, where it is sampled.
    pub fn look(&mut self, session: &impl RunSource) {
        let graph = || session.observer().snapshot();
        self.push_ages.meet(session.system(), graph);
        if self.push_ages.is_sampled() {
            self.push_ages.look(&graph());
        }
    }

    /// Creates the sampler of the run after `session`.
    pub fn next(&self, session: &impl RunSource) -> Self {
        let shared = |points: &mut dyn Iterator<Item = (f64, f64)>| points.collect();
        let ghost = Ghost {
            points: shared(&mut self.points.iter().copied()),
            ages: shared(&mut self.push_ages.saw(0.0, f64::INFINITY).into_iter()),
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

    /// Whether `session` equals the previous run so far, bit for bit.
    fn same(&self, session: &impl RunSource) -> Option<bool> {
        let last = self.last.as_ref()?;
        let whole = session.summary().is_some() && last.ended;
        Some(session.digest()?.is_same(last.digest.as_ref()?, whole))
    }

    /// The signal before `now`, with a mark for each knob in `events`; `None` without a
    /// signal.
    pub fn trace(&self, system: &dyn System, now: Time, events: &[Event]) -> Option<SignalTrace> {
        let end = now.as_secs_f64();
        let begin = end - TRACE_S;
        let first = self.points.partition_point(|(at, _)| *at < begin);
        let last = self.points.partition_point(|(at, _)| *at <= end);
        Some(SignalTrace {
            signal: *signal(system)?,
            points: self.points.range(first..last).copied().collect(),
            ages: self.push_ages.saw(begin, end),
            limits: self.limits.known(),
            safe: None,
            marks: marks(system, events, begin),
            ghost: self
                .last
                .as_ref()
                .map(|last| last.ghost.clone())
                .unwrap_or_default(),
        })
    }

    fn follow_knobs(&mut self, observer: &Observer) {
        let events = observer.events(self.events);
        self.events += events.len();
        let turned = events.iter().filter_map(Event::knob);
        for timed in turned {
            self.hangs.extend(Hang::of(&timed));
            self.turned.extend([timed.knob]);
        }
    }

    /// All hangs of `session`.
    fn hangs(&self, session: &impl RunSource) -> Vec<Hang> {
        let mut hangs = Hang::at_the_start(&session.config().setup);
        hangs.extend(self.hangs.iter().cloned());
        hangs
    }

    /// The setup of `session` in force.
    fn setup(&self, session: &impl RunSource) -> Setup {
        let mut setup = session.config().setup.clone();
        setup.extend(self.turned.iter().cloned());
        setup
    }

    /// The recent push age and its limits.
    fn age(&mut self, session: &impl RunSource, graph: &Snapshot) -> Option<AgeData> {
        let period = first_node(session.system(), graph).map(|node| node.hz.period());
        let recent = self.push_ages.recent(period.unwrap_or_default())?;
        let (system, setup) = (session.shared_system(), self.setup(session));
        let over = session.summary().is_some();
        Some(AgeData {
            limits: self.limits.follow(system, setup, over),
            ..recent
        })
    }

    fn settings(&self, session: &impl RunSource) -> Vec<String> {
        let (system, setup) = (session.system(), self.setup(session));
        let shown = names::shown(system, |alias| names::is_set(alias, &setup)).into_iter();
        let sent = shown.filter(|alias| alias.kind() == KnobKind::Send);
        sent.map(|alias| setting(system, alias, &setup)).collect()
    }

    fn remember(&mut self, system: &dyn System, topic: &str, rows: &Rows) {
        if let Some(signal) = signal(system).filter(|signal| signal.topic == topic) {
            let points = rows.iter();
            let points = points.map(|(head, row)| (head.at.as_secs_f64(), (signal.value)(row)));
            self.points.extend(points);
            let old = self.points.len().saturating_sub(POINTS_KEPT);
            self.points.drain(..old);
        }
        if system.state() == Some(topic) {
            rows.iter()
                .for_each(|(head, row)| self.judge(system, head, row));
            if let Some((head, row)) = rows.last() {
                self.state = row.to_vec();
                self.newest_age = age(head);
            }
        }
    }

    fn judge(&mut self, system: &dyn System, head: &Head, state: &[f64]) {
        let (exit, at) = (&ClockExit::Stopped, head.at);
        let verdict = match system.chains() == system.state() {
            true => verdict(system, exit, at, [Some(state); 2]),
            false => system.verdict(exit, at, Some(state)),
        };
        // A lost run stays lost from its first moment on.
        let since = self.lost.unwrap_or(verdict);
        self.lost = verdict.is_lost().then_some(since);
        if let Some(sensed) = head.origin {
            self.push_ages.state(head.at, sensed);
        }
    }

    /// The nodes that ticked recently; at rest, those that ticked last.
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

    /// The state of the run, and the reason for its end, in measured figures.
    fn verdict(
        &mut self,
        session: &mut impl RunSource,
        snapshot: &Snapshot,
        age: Option<AgeData>,
    ) -> VerdictData {
        let ended = session.summary().map(|summary| summary.verdict);
        let Some(verdict) = ended.or(self.lost) else {
            return self.going_on(session, snapshot, age);
        };
        let lost = verdict.is_lost();
        let why = match still(session.system(), snapshot) {
            Some(_) => self.waits(session, snapshot),
            None if lost => self.reasons(session, snapshot, age),
            None => Vec::new(),
        };
        VerdictData {
            standing: if lost { Standing::Lost } else { Standing::Done },
            word: verdict.name().replace('_', " "),
            headline: format!("{verdict}{}", self.as_before(session)),
            why,
        }
    }

    /// The state of a running run that is not lost.
    fn going_on(
        &mut self,
        session: &mut impl RunSource,
        graph: &Snapshot,
        age: Option<AgeData>,
    ) -> VerdictData {
        if let Some(unheard) = unheard(session, graph) {
            return unheard;
        }
        if let Some(silent) = self.silent(session.system(), graph.now) {
            return VerdictData {
                standing: Standing::Good,
                word: String::new(),
                headline: "RUNNING, no data so far".to_owned(),
                why: self
                    .overloads(session)
                    .into_iter()
                    .chain([silent])
                    .collect(),
            };
        }
        if let Some(since) = still(session.system(), graph) {
            let why = self.waits(session, graph);
            return VerdictData {
                standing: Standing::Warned,
                word: "stands still".to_owned(),
                headline: since.map_or_else(
                    || "NOT MOVED: the plant made no step so far".to_owned(),
                    |last| format!("STANDS STILL: the last step of the plant was at {last}"),
                ),
                why,
            };
        }
        let (strain, idle) = (
            age.map(|age| age.strain()),
            is_idle(session.system(), graph),
        );
        let (standing, why) = match strain {
            Some(Strain::Swings | Strain::Falls) => {
                (Standing::Warned, self.reasons(session, graph, age))
            }
            None if idle => (Standing::Warned, self.reasons(session, graph, age)),
            _ => {
                let mut why = self.overloads(session);
                why.extend(living(session.system(), graph, age));
                let turned = self.turned.iter().any(|knob| knob.kind() == KnobKind::Rate);
                why.extend(age.filter(|_| turned).map(|_| PHASE.to_owned()));
                (Standing::Good, why)
            }
        };
        VerdictData {
            standing,
            word: String::new(),
            headline: match strain {
                Some(Strain::Falls) => "NOT LOST YET: pushes are older than it bears".to_owned(),
                None if idle => "NOT LOST YET: no action was applied so far".to_owned(),
                _ => so_far(session.system()) + self.as_before(session),
            },
            why,
        }
    }

    /// The verdict on a chain through which nothing came so far, if the run ended now.
    fn silent(&self, system: &dyn System, now: Time) -> Option<String> {
        if system.chains().is_none() || system.chains() != system.state() {
            return None;
        }
        let state = (!self.state.is_empty()).then_some(&self.state[..]);
        let ended = verdict(system, &ClockExit::Completed, now, [state; 2]);
        ended.is_lost().then(|| format!("if it ended now: {ended}"))
    }

    /// What the nodes are asked for beyond their time, with the knobs in force.
    fn overloads(&self, session: &impl RunSource) -> Vec<String> {
        let mut setup = session.system().about().setup();
        setup.extend(self.setup(session).iter().cloned());
        session.system().warnings(&setup)
    }

    /// States that the run equals the previous one, if it does.
    fn as_before(&self, session: &impl RunSource) -> &'static str {
        match (self.same(session), session.summary()) {
            (Some(true), Some(_)) => ": identical to the last run, bit for bit",
            (Some(true), None) => ", as in the last run, bit for bit",
            _ => "",
        }
    }

    /// Why the plant stands still.
    fn waits(&self, session: &impl RunSource, graph: &Snapshot) -> Vec<String> {
        let gone = gone(session, graph);
        let Some((_, node)) = moves(session.system(), graph).filter(|_| gone.is_empty()) else {
            return gone;
        };
        let (name, key) = (&node.name, if session.live() { ":" } else { "" });
        vec![match health(node, &self.hangs(session), graph.now) {
            Health::Crashed => {
                format!("the {name} crashed: the plant waits for it. {key}restart {name} goes on")
            }
            Health::Hangs => format!("the {name} hangs in one tick: the plant waits for its end"),
            _ if node.busy => format!("the {name} is in a long tick: the plant waits for its end"),
            _ => format!("the {name} does not tick: the plant waits for it"),
        }]
    }

    fn reasons(
        &mut self,
        session: &mut impl RunSource,
        graph: &Snapshot,
        age: Option<AgeData>,
    ) -> Vec<String> {
        let gone = gone(session, graph);
        if !gone.is_empty() {
            return gone;
        }
        let mut reasons = self.overloads(session);
        let (setup, hangs) = (self.setup(session), self.hangs(session));
        let (system, live) = (session.shared_system().clone(), session.live());
        let trial = Trial::new(system.clone(), session.config(), setup.clone(), graph.now);
        let over = session.summary().is_some();
        session.update_lineage();
        let lineage = session.lineage();
        let late = match (age, acting(&*system, graph)) {
            (Some(age), _) => age.stretch,
            (None, Some(acts)) => latest(graph, lineage, acts),
            (None, None) => (Time::ZERO, graph.now),
        };
        let facts = Facts {
            system: &*system,
            setup: &setup,
            turned: &self.turned,
            graph,
            lineage,
            age,
            late,
            hangs: &hangs,
            live,
        };
        let tried = self.trials.follow(trial, facts.cures(), over);
        // More load than there is time for comes before the parts of an age, which follow from it.
        reasons.extend(facts.cause(tried));
        reasons
    }
}

/// The state of `node` at run time `now`. A hang takes effect at the first tick after its
/// command.
fn health(node: &NodeAccount, hangs: &[Hang], now: Time) -> Health {
    let mut hangs = hangs.iter().filter(|hang| *hang.node == *node.name);
    let hangs = hangs.any(|hang| hang.is_at(now, node.hz.period()));
    match node.crashed {
        true => Health::Crashed,
        false if hangs && node.busy => Health::Hangs,
        false => Health::Works,
    }
}

/// Whether the plant stands still, and since which step; `None` if it moves.
fn still(system: &dyn System, graph: &Snapshot) -> Option<Option<Time>> {
    let (steps, node) = moves(system, graph)?;
    let patience = STILL.max(node.hz.period() * 2);
    let rest = graph.now.since(steps.newest.unwrap_or(Time::ZERO));
    (rest > patience).then_some(steps.newest)
}

/// Whether the plant moves, and nothing has pushed it for long after the start.
fn is_idle(system: &dyn System, graph: &Snapshot) -> bool {
    let pushed =
        acting(system, graph).is_none_or(|acts| graph.nodes[acts].push_age.in_force().is_some());
    let periods = graph.nodes.iter().map(|node| node.hz.period());
    let patience = STILL.max(periods.max().unwrap_or_default() * 2);
    !pushed && plant(system).is_some() && graph.now > Time::ZERO + patience
}

/// The steps of the plant, and the node that makes them.
fn moves<'g>(
    system: &dyn System,
    graph: &'g Snapshot,
) -> Option<(&'g TopicAccount, &'g NodeAccount)> {
    let steps = graph.topic(plant(system)?)?;
    let node = graph.nodes.get(*steps.publishers.first()?)?;
    Some((steps, node))
}

/// A line for each process of which nothing is heard.
fn gone(session: &impl RunSource, graph: &Snapshot) -> Vec<String> {
    let places = graph
        .nodes
        .iter()
        .filter_map(|node| session.place(&node.name));
    let mut lines: Vec<String> = places.filter_map(|place| place.absent).collect();
    let mut seen = HashSet::new();
    lines.retain(|line| seen.insert(line.clone()));
    lines
}

/// The state of a run that has yet to begin elsewhere, or of whose plant nothing is heard.
fn unheard(session: &impl RunSource, graph: &Snapshot) -> Option<VerdictData> {
    let absent = gone(session, graph);
    let plant = moves(session.system(), graph).map(|(_, node)| node);
    let place = session.place(&plant.or(graph.nodes.first())?.name)?;
    let (word, headline) = match graph.now {
        Time::ZERO if !absent.is_empty() => {
            ("waiting", "WAITING: the run has yet to begin".to_owned())
        }
        now => {
            place.absent?;
            let headline = format!("UNKNOWN: nothing is heard of the run since {now}");
            ("unknown", headline)
        }
    };
    Some(VerdictData {
        standing: Standing::Warned,
        word: word.to_owned(),
        headline,
        why: absent,
    })
}

/// The timeline of `session` at run time `now`, as `view` shows it.
pub fn timeline(session: &impl RunSource, view: TimelineView, now: Time) -> Option<Timeline> {
    let lineage = session.lineage();
    let acts = acting_name(session.system(), lineage)?;
    Timeline::of(lineage, acts, view, now)
}

/// Selects another push in the timeline of `session`; see [`TimelineView::select`].
pub fn select(session: &impl RunSource, view: &mut TimelineView, now: Time, later: bool) {
    let lineage = session.lineage();
    if let Some(acts) = acting_name(session.system(), lineage) {
        view.select(lineage, acts, now, later);
    }
}

/// The marks of the knobs in `events` from run time `begin` (s) on.
fn marks(system: &dyn System, events: &[Event], begin: f64) -> Vec<(f64, String)> {
    let recent = events
        .iter()
        .filter(|event| event.at.as_secs_f64() >= begin);
    let knobs: Vec<_> = recent.filter_map(Event::knob).collect();
    let marks = in_words(system, &knobs).into_iter();
    marks.map(|(at, text)| (at.as_secs_f64(), text)).collect()
}

fn acting_name(system: &dyn System, lineage: &Lineage) -> Option<usize> {
    let (acts, _) = system.latency()?;
    let nodes = &lineage.topology().nodes;
    nodes.iter().position(|node| node.name == acts)
}

/// The current activity, in a sentence with current figures.
fn living(system: &dyn System, graph: &Snapshot, age: Option<AgeData>) -> Vec<String> {
    let (Some(age), Some(node)) = (age, first_node(system, graph)) else {
        return Vec::new();
    };
    let (name, hz, ms) = (&node.name, node.hz, age.greatest.as_secs_f64() * 1e3);
    vec![format!(
        "the {name} decides at {hz}; each push is based on a reading at most {ms:.0} ms old"
    )]
}

/// The parts of the age of the push in force.
fn push(session: &mut impl RunSource, graph: &Snapshot, age: Option<AgeData>) -> Option<PushData> {
    let acts = acting(session.system(), graph)?;
    session.update_lineage();
    let lineage = session.lineage();
    let (from, to) = match age {
        Some(age) => age.stretch,
        None => latest(graph, lineage, acts),
    };
    let parts = lineage.push_at(acts, graph.now)?.parts(graph.now);
    let stages = lineage.mean_parts(acts, from, to);
    let mut mean = PartKind::ALL.map(|kind| {
        let of_kind = stages
            .iter()
            .filter(|(stage, _)| PartKind::of(*stage) == kind);
        let ns: f64 = of_kind.map(|(_, ns)| ns).sum();
        (kind, Duration::from_nanos(ns as u64))
    });
    let known: Duration = mean.iter().map(|(_, took)| *took).sum();
    let rest = age.map_or(Duration::ZERO, |age| age.mean.saturating_sub(known));
    mean.iter_mut()
        .filter(|(kind, _)| *kind == PartKind::Elsewhere)
        .for_each(|(_, took)| *took += rest);
    Some(PushData {
        sentence: PushSentence::of(&parts, lineage.topology()),
        reaction: reaction::greatest(lineage, acts, from, to),
        mean: mean.to_vec(),
    })
}

/// A note on the world of `session`, where it is relevant.
fn world(session: &impl RunSource, setup: &Setup) -> Option<&'static str> {
    if !session.config().world.is_course() {
        return Some("world: own");
    }
    plant(session.system())?;
    let asked = setup.iter().any(depends_on_the_world);
    asked.then_some("world: waits")
}

/// The state of a run that is going well.
fn so_far(system: &dyn System) -> String {
    match system.verdicts().first() {
        Some(well) if **well != VerdictKind::COMPLETED => {
            format!("{} so far", well.name.replace('_', " ").to_uppercase())
        }
        _ => "RUNNING".to_owned(),
    }
}

/// Age of the sensing behind a message at its publication (s).
fn age(head: &Head) -> Option<f64> {
    let sensed = head.origin?.as_secs_f64();
    Some(head.at.as_secs_f64() - sensed)
}

fn node_data(
    session: &impl RunSource,
    node: &NodeAccount,
    figures: NodeFigures,
    (hangs, now): (&[Hang], Time),
) -> NodeData {
    let place = session.place(&node.name);
    let gone = place.as_ref().is_some_and(|place| place.absent.is_some());
    NodeData {
        name: node.name.clone(),
        caption: session.system().about().caption(&node.name),
        hz: node.hz,
        triggered: !node.triggers.is_empty(),
        ticks: node.ticks,
        overruns: node.overruns,
        lit: false,
        health: match gone {
            true => Health::Gone,
            false => health(node, hangs, now),
        },
        place: place.map(|place| place.text),
        lateness: figures.lateness,
        tick_time: figures.tick_time,
    }
}

fn topic_data(topic: &TopicAccount, age: Quantiles, now: Time) -> TopicData {
    TopicData {
        name: topic.name.clone(),
        depth: topic.depth.get(),
        published: topic.published,
        per_second: topic.per_second(now),
        average: topic.average(now),
        dropped: topic.dropped(),
        dropped_lately: topic.dropped_lately(now),
        lost: topic.lost,
        lost_lately: topic.lost_lately(now),
        overtaken: topic.overtaken,
        dots: dots(&topic.flights, now),
        publishers: topic.publishers.clone(),
        readers: topic.readers.iter().map(|s| s.node).collect(),
        age,
        held: topic.newest.map(|newest| now.since(newest)),
    }
}
