//! A run of the real clock comes back to the bit from its log: every message, tick, drop,
//! event, figure and verdict, whatever was changed while it ran.
//!
//! `RATELAB_CASES=200` tries more runs, and `RATELAB_LOAD=4` keeps cores busy meanwhile.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use crossbeam_channel::Sender;
use ratelab::{
    Clock, ClockExit, ClockKind, Command, Event, EventKind, GO_ON, Graph, Inbox, Node, NodeRecord,
    RealClock, Shared, Sink, Speed, Tick, Time, TimedCommand, Topic, TopicRecord, Topology, run,
};
use ratelab_account::{Distribution, Observer, RowTap, Rows, Tap, TapHandle, TickRecord};
use ratelab_effects::{Callback, Effects, Executors};
use ratelab_replay::{Log, LogError, Rerun, RunLog};
use ratelab_study::{
    experiment::{Config, Experiment, Summary},
    system::WorldKind,
};

use crate::{
    load::Load,
    support::{self, cart_pole, config, secs},
};

/// Random numbers (SplitMix64).
struct Dice(u64);

impl Dice {
    fn below(&mut self, sides: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) % sides as u64) as usize
    }

    fn pick<T: Clone>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())].clone()
    }
}

fn number(name: &str, usual: usize) -> usize {
    let set = std::env::var(name).ok().and_then(|text| text.parse().ok());
    set.unwrap_or(usual)
}

/// Everything that must come back.
#[derive(PartialEq)]
struct Transcript {
    topics: Vec<Rows>,
    ticks: Vec<Vec<TickRecord>>,
    figures: Vec<String>,
    events: Vec<String>,
}

impl Transcript {
    /// The first difference from `other`.
    fn difference(&self, other: &Self) -> Option<String> {
        for (topic, (one, other)) in self.topics.iter().zip(&other.topics).enumerate() {
            for index in 0..one.len().max(other.len()) {
                let [one, other] =
                    [one, other].map(|rows| (rows.heads().get(index), rows.row(index)));
                let bits = |row: &[f64]| row.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
                if one.0 != other.0 || bits(one.1) != bits(other.1) {
                    return Some(format!("topic {topic} message {index}: {one:?}, {other:?}"));
                }
            }
        }
        for (node, (one, other)) in self.ticks.iter().zip(&other.ticks).enumerate() {
            for index in 0..one.len().max(other.len()) {
                let (mut one, other) = (one.get(index).copied(), other.get(index).copied());
                // Under the virtual clock the wall gives the duration of most ticks.
                if let Some((one, TickRecord { took: None, .. })) = one.as_mut().zip(other) {
                    one.took = None;
                }
                if one != other {
                    return Some(format!("node {node} tick {index}: {one:?}, {other:?}"));
                }
            }
        }
        for (one, other) in [
            (&self.events, &other.events),
            (&self.figures, &other.figures),
        ] {
            for index in 0..one.len().max(other.len()) {
                let (one, other) = (one.get(index), other.get(index));
                if one != other {
                    return Some(format!("{one:?}, {other:?}"));
                }
            }
        }
        None
    }
}

struct Taps {
    topics: Vec<RowTap>,
    ticks: Vec<Tap<TickRecord>>,
    observer: Observer,
}

const BACKLOG: usize = 1 << 15;

impl Taps {
    fn new(experiment: &Experiment) -> Self {
        let taps = experiment.taps();
        let names = taps.topics().iter().map(|topic| topic.name().to_owned());
        let names: Vec<_> = names.collect();
        Self {
            topics: names
                .iter()
                .filter_map(|name| taps.rows(name, BACKLOG))
                .collect(),
            ticks: taps.ticks(BACKLOG),
            observer: experiment.observer(),
        }
    }

    fn transcript(self, end: Result<&Summary, String>) -> Transcript {
        let topics = self.topics.iter().map(|tap| {
            let mut rows = tap.rows();
            tap.take(&mut rows);
            assert_eq!(tap.lost(), 0);
            rows
        });
        let ticks = self
            .ticks
            .iter()
            .map(|tap| tap.items().try_iter().collect());
        let (topics, ticks) = (topics.collect(), ticks.collect());
        let events = self.observer.events(0);
        let events = events.iter().filter(|event| !paces(event));
        Transcript {
            topics,
            ticks,
            figures: figures(&self.observer, end),
            events: events.map(|event| format!("{event:?}")).collect(),
        }
    }
}

/// Whether it merely changes how run time passes.
fn paces(event: &Event) -> bool {
    match &event.what {
        EventKind::Applied { command, .. } | EventKind::Refused { command, .. } => {
            use Command::{Pause, Resume, Step};
            matches!(command, Pause | Resume | Command::Speed(_) | Step)
        }
        _ => false,
    }
}

fn figures(observer: &Observer, end: Result<&Summary, String>) -> Vec<String> {
    let snapshot = observer.snapshot();
    let of = |d: &Distribution| {
        let quantiles = [0.5, 0.99].map(|q| d.quantile(q));
        format!("{} {:?} {quantiles:?}", d.count(), d.mean_s())
    };
    let mut all = vec![match end {
        Ok(summary) => format!(
            "{:?} {} {:?} {:?} {:?} {}",
            summary.verdict,
            summary.steps,
            summary.sim_time,
            summary.state,
            summary.cost,
            of(&summary.latency)
        ),
        Err(fault) => fault,
    }];
    all.push(format!("{:?} {}", snapshot.now, snapshot.status.clock));
    for node in &snapshot.nodes {
        all.push(format!(
            "{} {} {} {} {} {} {:?}",
            node.name,
            node.hz,
            node.ticks,
            node.overruns,
            node.crashed,
            of(&node.lateness),
            node.push_age
        ));
    }
    for topic in &snapshot.topics {
        let read = topic.readers.iter();
        let read: Vec<_> = read
            .map(|s| (s.dropped, s.dropped_lately(snapshot.now), of(&s.ages)))
            .collect();
        all.push(format!(
            "{} {} {} {} {} {} {} {} {:?} {:?} {read:?}",
            topic.name,
            topic.depth,
            topic.published,
            topic.lost,
            topic.overtaken,
            topic.in_flight(),
            topic.lost_lately(snapshot.now),
            topic.per_second(snapshot.now),
            topic.newest,
            topic.flights,
        ));
    }
    all
}

/// A run that was under the real clock.
struct Run {
    config: Config,
    log: Log,
    events: Vec<Event>,
    topology: Topology,
    transcript: Transcript,
}

impl Run {
    /// Runs `config` while `person` gives commands.
    fn record(
        config: &Config,
        person: impl FnOnce(&Sender<Command>, &Observer, &AtomicBool) + Send,
    ) -> Self {
        let experiment = Experiment::new(cart_pole(), config).expect("experiment");
        let (taps, commander) = (Taps::new(&experiment), experiment.commands());
        let observer = experiment.observer();
        let topology = observer.topology();
        let over = AtomicBool::new(false);
        let end = thread::scope(|scope| {
            let (observer, over) = (&observer, &over);
            // The sender goes with the last command: nobody else can end a pause.
            scope.spawn(move || person(&commander, observer, over));
            let end = experiment.run().map_err(|fault| fault.to_string());
            over.store(true, Ordering::Relaxed);
            end
        });
        Self {
            config: config.clone(),
            log: RunLog::of(&observer).log(),
            events: observer.events(0),
            topology,
            transcript: taps.transcript(end.as_ref().map_err(Clone::clone)),
        }
    }

    fn rerun(&self) -> Rerun {
        Rerun::new(&self.log, &self.events, &self.topology).expect("a log")
    }

    /// Executes it again with `rerun`.
    fn again(&self, rerun: &mut Rerun) -> Transcript {
        self.run_again(rerun).transcript
    }

    /// The same as a run of its own, with a log.
    fn run_again(&self, rerun: &mut Rerun) -> Self {
        let config = Config {
            speed: Speed::Unlimited,
            knobs: Vec::new(),
            ..self.config.clone()
        };
        let mut experiment = Experiment::new(cart_pole(), &config).expect("experiment");
        experiment.schedule(self.given(rerun));
        let taps = Taps::new(&experiment);
        let observer = experiment.observer();
        let end = experiment
            .run_with(rerun)
            .map_err(|fault| fault.to_string());
        Self {
            config,
            log: RunLog::of(&observer).log(),
            events: observer.events(0),
            topology: self.topology.clone(),
            transcript: taps.transcript(end.as_ref().map_err(Clone::clone)),
        }
    }

    /// The commands under the virtual clock.
    fn given(&self, rerun: &Rerun) -> Vec<TimedCommand> {
        let events = self.events.iter().enumerate();
        let others = events.filter(|(index, event)| !rerun.knows(*index) && !paces(event));
        let commands = others.filter_map(|(_, event)| match &event.what {
            EventKind::Applied { command, .. } | EventKind::Refused { command, .. } => {
                Some(TimedCommand {
                    at: event.at,
                    command: command.clone(),
                })
            }
            _ => None,
        });
        commands.collect()
    }

    #[track_caller]
    fn check(&self) -> (usize, usize) {
        let mut rerun = self.rerun();
        let entries = rerun.entries();
        let again = self.again(&mut rerun);
        assert_eq!(rerun.difference(), None, "{:?}", self.config);
        if let Some(difference) = self.transcript.difference(&again) {
            panic!("{difference}\n{:?}\n{:#?}", self.config, self.events);
        }
        entries
    }
}

fn random_config(dice: &mut Dice) -> Config {
    let rates = [50.0, 50.0, 33.3, 100.0, 200.0, 500.0, 1000.0, 2000.0];
    let mut setup = vec![
        format!("rate sensor {}", dice.pick(&rates)),
        format!("rate policy {}", dice.pick(&rates)),
        format!("depth /obs {}", dice.pick(&[1, 1, 2, 3, 10, 100])),
        format!("send policy {}", dice.pick(&["scripted", "lqr", "random"])),
    ];
    let sometimes = [
        "takes policy 3",
        "takes policy 30..50",
        "takes policy busy 1",
        "takes sensor 0.2",
        "link /obs delay:5..25,loss:0.1",
        "link /action delay:lognormal:4,9",
        "read /obs oldest",
        "offset policy 3",
    ];
    for knob in sometimes {
        if dice.below(6) == 0 {
            setup.push(knob.to_owned());
        }
    }
    let own = dice.below(3) == 0;
    if own && dice.below(2) == 0 {
        setup.push("rate actuator 200".to_owned());
    }
    let mut config = config("");
    for knob in setup {
        config.setup.set(knob.parse().expect("a knob"));
    }
    Config {
        seed: dice.below(1_000) as u64,
        clock: dice.pick(&[ClockKind::Real, ClockKind::Real, ClockKind::Virtual]),
        speed: Speed::REAL_TIME,
        end: secs(0.4),
        world: if own {
            WorldKind::OWN
        } else {
            WorldKind::Course
        },
        ..config
    }
}

/// Commands with the run times after which they are given.
fn random_commands(dice: &mut Dice, first: ClockKind) -> Vec<(f64, Command)> {
    let knobs = [
        "rate policy 100",
        "rate policy 20",
        "rate sensor 333.3",
        "rate nobody 10",
        "depth /obs 1",
        "depth /obs 5",
        "depth /action 7",
        "depth /nowhere 7",
        "send policy lqr",
        "send policy nonsense",
        "send actuator zero:20",
        "takes policy 8",
        "takes policy 0",
        "offset sensor 2",
        "link /action delay:20,loss:0.2",
        "link /action none",
        "link /obs delay:1..30,in-order",
        "read /obs newest",
        "read /obs oldest",
        "crash policy",
        "restart policy",
        "hang policy 25",
        "clock sensor 3 1000",
        "lose /obs 60",
    ];
    let mut commands = Vec::new();
    if first == ClockKind::Virtual {
        commands.push((0.05, Command::HandOver(ClockKind::Real)));
    }
    let mut at = 0.02;
    for _ in 0..dice.below(14) {
        at += dice.below(60) as f64 / 1e3;
        let knob = |dice: &mut Dice| Command::Set(dice.pick(&knobs).parse().expect("a knob"));
        match dice.below(12) {
            0 => commands.extend([
                (at, Command::Pause),
                (at, knob(dice)),
                (at, knob(dice)),
                (at, Command::Resume),
            ]),
            1 => commands.push((at, Command::HandOver(ClockKind::Virtual))),
            2 => commands.push((at, Command::HandOver(ClockKind::Real))),
            3 => commands.push((at, Command::Speed(Speed::REAL_TIME))),
            _ => commands.push((at, knob(dice))),
        }
    }
    if dice.below(6) == 0 {
        commands.push((at + 0.05, Command::Stop));
    }
    commands
}

/// Gives `commands`, each as soon as run time is there.
fn person(commands: Vec<(f64, Command)>) -> impl FnOnce(&Sender<Command>, &Observer, &AtomicBool) {
    move |commander, observer, over| {
        for (at, command) in commands {
            while observer.now() < secs(at) && !over.load(Ordering::Relaxed) {
                thread::sleep(Duration::from_millis(1));
            }
            // The run may be over by now.
            let _ = commander.send(command);
        }
    }
}

#[test]
fn any_run_comes_back_to_the_bit() {
    let _load = Load::new(number("RATELAB_LOAD", 0));
    let mut dice = Dice(number("RATELAB_SEED", 1) as u64);
    let (mut all, mut knotted) = (0, 0);
    for _ in 0..number("RATELAB_CASES", 12) {
        let config = random_config(&mut dice);
        let commands = random_commands(&mut dice, config.clock);
        let run = Run::record(&config, person(commands));
        let (entries, in_knots) = run.check();
        all += entries;
        knotted += in_knots;
    }
    println!("{all} entries, {knotted} in knots");
}

#[test]
fn a_run_comes_back_however_its_threads_are_scheduled() {
    let mut dice = Dice(7);
    for _ in 0..number("RATELAB_CASES", 3) {
        let config = random_config(&mut dice);
        let run = Run::record(&config, person(random_commands(&mut dice, config.clock)));
        let mut rerun = run.rerun();
        rerun.perturb();
        let again = run.again(&mut rerun);
        assert_eq!(rerun.difference(), None);
        assert_eq!(run.transcript.difference(&again), None);
    }
}

/// One thread of a log, with one byte changed.
fn altered(log: &Log, dice: &mut Dice) -> Log {
    let mut threads: Vec<Vec<u8>> = log.threads().to_vec();
    let thread = dice.below(threads.len());
    let bytes = &mut threads[thread];
    let at = dice.below(bytes.len());
    match dice.below(4) {
        0 => bytes[at] ^= 1 << dice.below(8),
        1 => drop(bytes.remove(at)),
        2 => bytes.insert(at, dice.below(256) as u8),
        _ => bytes.swap(at, 0),
    }
    threads.into_iter().enumerate().collect()
}

#[test]
fn an_altered_log_is_refused_or_makes_another_run_and_never_hangs() {
    let mut dice = Dice(3);
    let config = Config {
        clock: ClockKind::Real,
        end: secs(0.2),
        ..config("rate sensor 500, rate policy 200")
    };
    let run = Run::record(
        &config,
        person(vec![(0.1, support::set_rate("policy", 100.0))]),
    );
    let (mut refused, mut other, mut same) = (0, 0, 0);
    for _ in 0..number("RATELAB_CASES", 150) {
        let log = altered(&run.log, &mut dice);
        let Ok(mut rerun) = Rerun::new(&log, &run.events, &run.topology) else {
            refused += 1;
            continue;
        };
        let again = run.again(&mut rerun);
        match rerun.difference().or(run.transcript.difference(&again)) {
            Some(_) => other += 1,
            None => same += 1,
        }
    }
    // A change may commute: what is the same then is the run.
    println!("{refused} refused, {other} differ, {same} are the same run");
    assert!(refused > 0 && other > 0);
}

#[test]
fn a_log_that_is_cut_off_is_executed_up_to_there() {
    let config = Config {
        clock: ClockKind::Real,
        end: secs(0.2),
        ..config("rate sensor 500, takes policy 5")
    };
    let mut cuts = Vec::new();
    let run = Run::record(&config, |_, observer, over| {
        while !over.load(Ordering::Relaxed) {
            // Events after the log: it mentions no later ones.
            let log = RunLog::of(observer).log();
            cuts.push((log, observer.events(0)));
            thread::sleep(Duration::from_millis(5));
        }
    });
    let mut longest = 0;
    for (log, events) in cuts {
        let rerun = Rerun::of_torn(&log, &events, &run.topology);
        let mut rerun = rerun.expect("a part of a log");
        let again = run.again(&mut rerun);
        assert_eq!(rerun.difference(), None);
        for (one, other) in run.transcript.topics.iter().zip(&again.topics) {
            assert_eq!(&one.heads()[..other.len()], other.heads());
            longest = longest.max(other.len());
        }
    }
    assert!(longest > 0);
}

/// A number for [`adders`], and the topic for their sums.
fn total_and_topic() -> (Arc<Shared<u64>>, Topic<u64>) {
    let total = Arc::new(Shared::new("total", 0));
    (total, Topic::new("/sum", support::depth(1)))
}

/// Two nodes that add to one number and publish it.
fn adders(total: &Arc<Shared<u64>>, topic: &Topic<u64>) -> Graph {
    let mut graph = Graph::with(Effects);
    for name in ["one", "other"] {
        let total = total.clone();
        let added = graph.node(name, support::hz(1_000.0), 0, |wiring| {
            let topic = wiring.publisher(topic);
            move |now| {
                let sum = {
                    let mut total = total.lock();
                    *total += 1;
                    *total
                };
                topic.publish(sum, now, None);
                GO_ON
            }
        });
        added.expect("node");
    }
    graph
}

fn sums(graph: &mut Graph, clock: &mut dyn Clock, topic: &Topic<u64>) -> Vec<(u64, Time)> {
    let tap = TapHandle::of(graph).topic(topic, BACKLOG);
    RunLog::of(&graph.state());
    let end = clock.run(graph, &mut Inbox::default(), secs(0.2));
    end.expect("no fault");
    let messages = tap.items().try_iter();
    messages
        .map(|tapped| (tapped.message.data, tapped.head.at))
        .collect()
}

#[test]
fn state_that_nodes_share_comes_back_in_the_same_order() {
    let (total, topic) = total_and_topic();
    let mut graph = adders(&total, &topic);
    let recorded = sums(&mut graph, &mut RealClock::default(), &topic);
    let observer = Observer::of(&graph);
    for perturbed in [false, true] {
        let mut rerun = Rerun::new(
            &RunLog::of(&observer).log(),
            &observer.events(0),
            &observer.topology(),
        );
        let rerun = rerun.as_mut().expect("a log");
        if perturbed {
            rerun.perturb();
        }
        let (total, topic) = total_and_topic();
        let mut graph = adders(&total, &topic);
        let again = sums(&mut graph, rerun, &topic);
        assert_eq!(rerun.difference(), None);
        assert_eq!(recorded, again);
        assert_eq!(
            RunLog::of(&graph.state()).log(),
            RunLog::of(&observer).log(),
            "its log is another one"
        );
    }
}

/// Runs graphs of `build` until ticks overlap in one; its observer.
fn with_a_knot(build: impl Fn() -> Graph) -> Observer {
    loop {
        let mut graph = build();
        RunLog::of(&graph.state());
        let run = RealClock::default().run(&mut graph, &mut Inbox::default(), secs(0.1));
        run.expect("no fault");
        let observer = Observer::of(&graph);
        if !rerun_of(&observer).knots().is_empty() {
            return observer;
        }
    }
}

fn rerun_of(observer: &Observer) -> Rerun {
    let rerun = Rerun::new(
        &RunLog::of(observer).log(),
        &observer.events(0),
        &observer.topology(),
    );
    rerun.expect("a log")
}

/// Executes `graph` with `rerun`, held after each operation of knot number `knot` in turn:
/// `look` sees how many are done.
fn held_in(mut graph: Graph, mut rerun: Rerun, knot: usize, mut look: impl FnMut(usize)) {
    let all = rerun.knots()[knot].operations.len();
    rerun.hold(knot, 0);
    let watch = rerun.watch();
    thread::scope(|scope| {
        scope.spawn(|| {
            let end = rerun.run(&mut graph, &mut Inbox::default(), secs(0.1));
            end.expect("no fault");
        });
        for operations in 0..=all {
            watch.allow(operations);
            let done = loop {
                assert_eq!(watch.difference(), None);
                match watch.held() {
                    Some(done) if done >= operations => break done,
                    _ => thread::yield_now(),
                }
            };
            look(done);
        }
        watch.end();
    });
}

#[test]
fn a_run_is_held_between_any_two_operations_of_ticks_that_overlap() {
    let build = || {
        let (total, topic) = total_and_topic();
        adders(&total, &topic)
    };
    let observer = with_a_knot(build);
    let knots = rerun_of(&observer).knots();
    for (number, knot) in knots.iter().enumerate().take(5) {
        assert!(knot.from <= knot.to);
        let (total, topic) = total_and_topic();
        let graph = adders(&total, &topic);
        let turn = |name: &str, done: usize| {
            let here = |at: &usize| &*knot.operations[*at].takes == name;
            let before = (0..done).rev().find(here);
            let next = (done..knot.operations.len()).find(here);
            let before = before.map(|at| knot.operations[at].turn + 1);
            before
                .or(next.map(|at| knot.operations[at].turn))
                .expect("one")
        };
        held_in(graph, rerun_of(&observer), number, |done| {
            assert_eq!(*total.aside(), turn("total", done), "after {done}");
            assert_eq!(topic.published(), turn("/sum", done), "after {done}");
        });
    }
}

#[test]
fn a_lock_within_another_one_does_not_hang_a_run_that_is_held() {
    let build = || {
        let (one, other) = (
            Arc::new(Shared::new("one", 0)),
            Arc::new(Shared::new("other", 0)),
        );
        let mut graph = Graph::with(Effects);
        let (first, second) = (one.clone(), other.clone());
        let both = move |_: Time| {
            let mut first = first.lock();
            *first += 1;
            *second.lock() += *first;
            GO_ON
        };
        let by_turns = move |_: Time| {
            *other.lock() += 1;
            *one.lock() += 1;
            GO_ON
        };
        graph
            .node("both", support::hz(2_000.0), 0, |_| both.clone())
            .expect("node");
        graph
            .node("by turns", support::hz(2_000.0), 0, |_| by_turns.clone())
            .expect("node");
        graph
    };
    let observer = with_a_knot(build);
    let knots = rerun_of(&observer).knots();
    for (number, knot) in knots.iter().enumerate().take(20) {
        let mut last = 0;
        held_in(build(), rerun_of(&observer), number, |done| last = done);
        assert_eq!(last, knot.operations.len());
    }
}

#[test]
fn a_run_that_another_thread_wrote_into_is_refused_by_name_and_notices_it_at_once() {
    let (total, topic) = total_and_topic();
    let mut graph = adders(&total, &topic);
    let observer = Observer::of(&graph);
    let noticed = AtomicBool::new(false);
    thread::scope(|scope| {
        let (observer, total, noticed) = (observer.clone(), total.clone(), &noticed);
        scope.spawn(move || {
            while observer.now() < secs(0.1) {
                thread::yield_now();
            }
            for _ in 0..2 {
                *total.lock() += 1;
                let ticks = || observer.snapshot().nodes[0].ticks;
                let then = ticks();
                while ticks() < then + 3 && observer.now() < secs(0.19) {
                    thread::yield_now();
                }
            }
            let names = RunLog::of(&observer).written_from_outside();
            let once = names.iter().map(|name| &**name).eq(["total"]);
            noticed.store(once, Ordering::Relaxed);
        });
        sums(&mut graph, &mut RealClock::default(), &topic);
    });
    assert!(noticed.load(Ordering::Relaxed));
    let rerun = Rerun::new(
        &RunLog::of(&observer).log(),
        &observer.events(0),
        &observer.topology(),
    );
    let error = rerun.expect_err("it cannot come back").to_string();
    assert!(
        error.contains("total was written to from outside of the graph"),
        "{error}"
    );
}

#[test]
fn a_node_that_does_something_else_is_named() {
    let (total, topic) = total_and_topic();
    let mut graph = adders(&total, &topic);
    sums(&mut graph, &mut RealClock::default(), &topic);
    let observer = Observer::of(&graph);
    let mut rerun = Rerun::new(
        &RunLog::of(&observer).log(),
        &observer.events(0),
        &observer.topology(),
    );
    let rerun = rerun.as_mut().expect("a log");
    let (_, topic) = total_and_topic();
    // Another name for what the nodes share is another lock.
    let mut graph = adders(&Arc::new(Shared::new("sum", 0)), &topic);
    sums(&mut graph, rerun, &topic);
    let difference = rerun.difference().expect("another run");
    assert!(
        difference.contains("took sum where the recorded run took total"),
        "{difference}"
    );
}

#[test]
fn a_node_that_waits_in_vain_is_named_by_the_watch() {
    let graph = |input: crossbeam_channel::Receiver<()>| {
        let mut graph = Graph::with(Effects);
        let waits = move |_: Time| {
            let _ = input.recv();
            GO_ON
        };
        graph
            .node("waits", support::hz(100.0), 0, |_| waits)
            .expect("node");
        graph
    };
    let (sender, input) = crossbeam_channel::unbounded();
    (0..1_000).for_each(|_| sender.send(()).expect("open"));
    let mut first = graph(input);
    RunLog::of(&first.state());
    let run = RealClock::default().run(&mut first, &mut Inbox::default(), secs(0.05));
    run.expect("no fault");
    let state = first.state();
    let mut rerun = Rerun::new(
        &RunLog::of(&state).log(),
        &state.events(0),
        &first.topology(),
    );
    let rerun = rerun.as_mut().expect("a log");
    let (sender, input) = crossbeam_channel::unbounded();
    let (mut again, watch) = (graph(input), rerun.watch());
    thread::scope(|scope| {
        scope.spawn(move || {
            let node = loop {
                if let Some(node) = watch.doing().node {
                    break node;
                }
                thread::yield_now();
            };
            assert_eq!(&*node.name, "waits");
            assert!(!node.took.is_zero(), "a long tick may be long again");
            drop(sender);
        });
        rerun
            .run(&mut again, &mut Inbox::default(), secs(0.05))
            .expect("no fault");
    });
    assert_eq!(rerun.difference(), None);
}

#[test]
fn a_branch_leaves_the_run_at_the_last_rest_and_is_the_same_every_time() {
    let config = Config {
        clock: ClockKind::Real,
        end: secs(2.0),
        ..config("takes policy 230")
    };
    let run = Run::record(&config, person(Vec::new()));
    assert!(
        run.transcript.figures[0].contains("pole_fell"),
        "{}",
        run.transcript.figures[0]
    );
    let branch = || {
        let mut rerun = run.rerun();
        let rest = rerun.rest_before(secs(0.2), ClockKind::Real).expect("real");
        assert!(rest <= secs(0.2) && rerun.rests().contains(&rest));
        let knob = "takes policy 0".parse().expect("a knob");
        rerun.branch(secs(0.2), vec![Command::Set(knob)]);
        let again = run.run_again(&mut rerun);
        assert_eq!(rerun.difference(), None);
        // It has the log of the part that it shares with the run, and comes back, too.
        again.check();
        again.transcript
    };
    let (one, other) = (branch(), branch());
    assert_eq!(one.difference(&other), None);
    assert!(one.figures[0].contains("balanced"), "{}", one.figures[0]);
    let before = one.topics[0]
        .heads()
        .partition_point(|head| head.at < secs(0.15));
    assert_eq!(
        one.topics[0].heads()[..before],
        run.transcript.topics[0].heads()[..before]
    );
}

#[test]
fn a_log_of_an_earlier_release_is_named_as_such() {
    let mut graph = Graph::new();
    let added = graph.node("a", 50.0, 0, |_| |_: Time| GO_ON);
    added.expect("a node");
    // A tick as it was logged then, without operations.
    let tick = [1, 0, 2, 0, 5, 0];
    let log: Log = [(0, vec![1, 0]), (1, tick.to_vec())].into_iter().collect();
    let error = Rerun::new(&log, &[], &graph.topology()).expect_err("an earlier log");
    assert_eq!(error, LogError::Earlier);
}

/// Counts the ticks of nodes that began, and those that were recorded.
#[derive(Default)]
struct TickCount([AtomicUsize; 2]);

impl Sink for TickCount {
    fn node(&self, _: usize, record: &NodeRecord) {
        let count = match record {
            NodeRecord::Began { .. } => &self.0[0],
            NodeRecord::Ticked(_) => &self.0[1],
            _ => return,
        };
        count.fetch_add(1, Ordering::Relaxed);
    }

    fn topic(&self, _: usize, _: &TopicRecord<'_>) {}
}

/// Two nodes of an executor with two threads; the first one's ticks take 60 ms.
fn shared_threads() -> Graph {
    let mut graph = Graph::with(Effects);
    for (name, rate) in [("slow", 10.0), ("fast", 100.0)] {
        graph
            .node(name, rate, 0, |_| |_: Time| GO_ON)
            .expect("a node");
    }
    let takes = "takes slow 60".parse().expect("a knob");
    graph.turn(&takes).expect("a node");
    let callbacks = ["slow", "fast"].map(Callback::of);
    let executor = "multi:2".parse().expect("an executor");
    graph.executor(executor, callbacks).expect("nodes");
    graph
}

#[test]
fn a_branch_leaves_no_tick_of_an_executor_half_done() {
    let (mut first, end) = (shared_threads(), secs(0.45));
    let log = RunLog::of(&first.state());
    let exit = RealClock::default().run(&mut first, &mut Inbox::default(), end);
    exit.expect("a run");
    let mut rerun = Rerun::new(&log.log(), &[], &first.topology()).expect("a log");
    for rest in rerun.rests() {
        let mut again = shared_threads();
        let count = Arc::new(TickCount::default());
        let sink = count.clone();
        again.sink_or(move || sink);
        rerun = Rerun::new(&log.log(), &[], &first.topology()).expect("a log");
        rerun.branch(rest, Vec::new());
        let exit = run(
            &mut again,
            &mut Inbox::default(),
            end,
            ClockKind::Real,
            &mut rerun,
        );
        exit.expect("a run");
        let [began, recorded] = count
            .0
            .each_ref()
            .map(|count| count.load(Ordering::Relaxed));
        assert_eq!(began, recorded, "left at {rest}");
    }
}

#[test]
fn a_command_that_is_refused_comes_back_where_threads_share_nodes() {
    let (mut first, end) = (shared_threads(), secs(0.2));
    let command = Command::Set("send fast hello".parse().expect("a knob"));
    let at = secs(0.1);
    let (_, mut inbox) = Inbox::new(vec![TimedCommand { at, command }]);
    let log = RunLog::of(&first.state());
    let exit = RealClock::default().run(&mut first, &mut inbox, end);
    exit.expect("a run");
    let events = first.state().events(0);
    let mut rerun = Rerun::new(&log.log(), &events, &first.topology()).expect("a log");
    rerun.expect_refusals(|_| true);
    let mut again = shared_threads();
    let exit = rerun.run(&mut again, &mut Inbox::default(), end);
    exit.expect("a run");
    assert_eq!(rerun.difference(), None);
    assert_eq!(again.state().events(0), events);
}

/// Doubles a shared number, and says so after it was told to.
struct Doubler {
    number: Arc<Shared<u64>>,
    told: bool,
    done: Arc<AtomicBool>,
}

impl Node for Doubler {
    fn tick(&mut self, _: Time) -> Tick {
        *self.number.lock() *= 2;
        if self.told {
            self.done.store(true, Ordering::SeqCst);
        }
        GO_ON
    }

    fn on_message(&mut self, _: &str) -> Result<String, String> {
        self.told = true;
        Ok(String::new())
    }
}

#[test]
fn a_command_for_a_node_beside_one_in_a_tick_does_not_hang_the_run_that_comes_back() {
    // In the first run the first node waits in its tick until the second one has obeyed and ticked.
    let graph = |mut commander: Option<Sender<Command>>| {
        let (number, done) = (
            Arc::new(Shared::new("number", 1)),
            Arc::<AtomicBool>::default(),
        );
        let mut graph = Graph::new();
        let (shared, is_done) = (number.clone(), done.clone());
        let adder = graph.node("adder", 10.0, 0, |_| {
            move |_: Time| {
                if let Some(commander) = commander.take() {
                    commander.send(Command::Set("send doubler now".parse()?))?;
                    let patience = Instant::now() + Duration::from_secs(20);
                    while !is_done.load(Ordering::SeqCst) && Instant::now() < patience {
                        thread::yield_now();
                    }
                }
                *shared.lock() += 1;
                GO_ON
            }
        });
        adder.expect("a node");
        let told = false;
        let doubler = Doubler { number, told, done };
        graph.node("doubler", 20.0, 0, |_| doubler).expect("a node");
        let callbacks = ["adder", "doubler"].map(Callback::of);
        let executor = "multi:2".parse().expect("an executor");
        graph.executor(executor, callbacks).expect("nodes");
        graph
    };
    let (commander, mut inbox) = Inbox::new(Vec::new());
    let (mut first, end) = (graph(Some(commander)), secs(0.4));
    let log = RunLog::of(&first.state());
    let exit = RealClock::default().run(&mut first, &mut inbox, end);
    exit.expect("a run");
    let events = first.state().events(0);
    for _ in 0..5 {
        let mut rerun = Rerun::new(&log.log(), &events, &first.topology()).expect("a log");
        let (sender, ended) = crossbeam_channel::bounded(1);
        let mut again = graph(None);
        thread::spawn(move || {
            let exit = rerun.run(&mut again, &mut Inbox::default(), end);
            sender.send(exit.map(|_| rerun.difference()))
        });
        let difference = ended.recv_timeout(Duration::from_secs(60));
        assert_eq!(difference.expect("it hangs").expect("a run"), None);
    }
}

#[test]
fn a_log_with_messages_for_inputs_that_no_node_has_harms_nobody() {
    let (graph, mut again) = (shared_threads(), shared_threads());
    let mut bytes = vec![1, 0];
    // A message for input 7 of node 1, and one for node 9; then a look at 100 ms.
    bytes.extend([16, 0, 1, 7, 0, 16, 0, 9, 0, 0]);
    bytes.extend([17, 0x80, 0x84, 0xaf, 0x5f, 0]);
    let threads = [(0, vec![1, 0]), (1, bytes), (2, vec![1, 0])];
    let log: Log = threads.into_iter().collect();
    if let Ok(mut rerun) = Rerun::of_torn(&log, &[], &graph.topology()) {
        let exit = rerun.run(&mut again, &mut Inbox::default(), secs(1.0));
        assert_eq!(exit.expect("no panic"), ClockExit::Stopped);
    }
}
