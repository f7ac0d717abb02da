//! A run of the real clock comes back to the bit from its log: every message, tick, drop,
//! event, figure and verdict, whatever was changed while it ran.
//!
//! `RATELAB_CASES=200` tries more runs, and `RATELAB_LOAD=4` keeps cores busy meanwhile.

use std::{
    fmt::Debug,
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
use ratelab_account::{Distribution, Observer, RowTap, Tap, TapHandle, TickRecord};
use ratelab_effects::{Callback, Effects, Executors};
use ratelab_replay::{Log, LogError, Rerun, RunLog};
use ratelab_study::{
    experiment::{Config, Experiment, Summary},
    system::WorldKind,
};

use crate::{
    load::Load,
    support::{self, config, knob, rerun_of, secs},
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
struct Transcript {
    /// The messages of each topic with their run times, as text that is exact to the bit.
    topics: Vec<Vec<(Time, String)>>,
    ticks: Vec<Vec<TickRecord>>,
    /// The figures, then the events.
    lines: Vec<String>,
}

/// The first place at which two lists differ.
fn difference<T: Debug + PartialEq>(of: &str, one: &[T], other: &[T]) -> Option<String> {
    let pairs = (0..one.len().max(other.len())).map(|at| (one.get(at), other.get(at)));
    let mut pairs = pairs.enumerate();
    let (at, pair) = pairs.find(|(_, (one, other))| one != other)?;
    Some(format!("{of} {at}: {pair:?}"))
}

/// The ticks of `one` without durations where `other` has none: under the virtual clock the wall
/// gives the duration of most ticks.
fn with_durations_of(one: &[TickRecord], other: &[TickRecord]) -> Vec<TickRecord> {
    let mut ticks = one.to_vec();
    for (tick, other) in ticks.iter_mut().zip(other) {
        tick.took = tick.took.filter(|_| other.took.is_some());
    }
    ticks
}

impl Transcript {
    /// The first difference from `other`.
    fn difference(&self, other: &Self) -> Option<String> {
        let mut topics = self.topics.iter().zip(&other.topics);
        let topic = topics.find_map(|(one, other)| difference("message", one, other));
        let ticks = || {
            let mut ticks = self.ticks.iter().zip(&other.ticks);
            ticks.find_map(|(one, other)| difference("tick", &with_durations_of(one, other), other))
        };
        let lines = || difference("line", &self.lines, &other.lines);
        topic.or_else(ticks).or_else(lines)
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
        let topics = taps.topics().iter();
        Self {
            topics: topics
                .filter_map(|topic| taps.rows(topic.name(), BACKLOG))
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
            let rows = rows.iter();
            rows.map(|(head, row)| (head.at, format!("{head:?} {row:?}")))
                .collect()
        });
        let ticks = self.ticks.iter();
        let ticks = ticks.map(|tap| tap.items().try_iter().collect());
        let events = self.observer.events(0);
        let events = events.iter().filter(|event| !paces(event));
        let events = events.map(|event| format!("{event:?}"));
        Transcript {
            topics: topics.collect(),
            ticks: ticks.collect(),
            lines: figures(&self.observer, end)
                .into_iter()
                .chain(events)
                .collect(),
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

/// All figures but those that the wall gives.
fn figures(observer: &Observer, end: Result<&Summary, String>) -> Vec<String> {
    let mut snapshot = observer.snapshot();
    let none = Distribution::default();
    for node in &mut snapshot.nodes {
        (node.tick_time, node.response) = (none.clone(), none.clone());
    }
    let end = end.map(|end| {
        let Summary {
            verdict,
            steps,
            sim_time,
            state,
            cost,
            latency,
            ..
        } = end;
        format!("{verdict:?} {steps} {sim_time:?} {state:?} {cost:?} {latency:?}")
    });
    let now = format!("{:?} {:?}", snapshot.now, snapshot.status.clock);
    let nodes = snapshot.nodes.iter().map(|node| format!("{node:?}"));
    let topics = snapshot.topics.iter().map(|topic| format!("{topic:?}"));
    let all = [end.unwrap_or_else(|fault| fault), now].into_iter();
    all.chain(nodes).chain(topics).collect()
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
        let experiment = support::experiment(config);
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

    /// Executes it again with `rerun`, as a run of its own with a log.
    fn again(&self, rerun: &mut Rerun) -> Self {
        let config = Config {
            speed: Speed::Unlimited,
            knobs: Vec::new(),
            ..self.config.clone()
        };
        let mut experiment = support::experiment(&config);
        experiment.schedule(self.given(rerun));
        let (taps, observer) = (Taps::new(&experiment), experiment.observer());
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

    /// Checks that it comes back by `rerun`.
    #[track_caller]
    fn check(&self, mut rerun: Rerun) {
        let again = self.again(&mut rerun).transcript;
        assert_eq!(rerun.difference(), None, "{:?}", self.config);
        let difference = self.transcript.difference(&again);
        assert_eq!(difference, None, "{:?}\n{:#?}", self.config, self.events);
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
    let sometimes = "takes policy 3; takes policy 30..50; takes policy busy 1; takes sensor 0.2; \
        link /obs delay:5..25,loss:0.1; link /action delay:lognormal:4,9; read /obs oldest; \
        offset policy 3";
    for knob in sometimes.split("; ") {
        if dice.below(6) == 0 {
            setup.push(knob.to_owned());
        }
    }
    let own = dice.below(3) == 0;
    if own && dice.below(2) == 0 {
        setup.push("rate actuator 200".to_owned());
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
        setup: setup.iter().map(|text| knob(text)).collect(),
        ..Config::default()
    }
}

/// Commands with the run times after which they are given.
fn random_commands(dice: &mut Dice, first: ClockKind) -> Vec<(f64, Command)> {
    let knobs = "rate policy 100; rate policy 20; rate sensor 333.3; rate nobody 10; depth /obs 1; \
        depth /obs 5; depth /action 7; depth /nowhere 7; send policy lqr; send policy nonsense; \
        send actuator zero:20; takes policy 8; takes policy 0; offset sensor 2; \
        link /action delay:20,loss:0.2; link /action none; link /obs delay:1..30,in-order; \
        read /obs newest; read /obs oldest; crash policy; restart policy; hang policy 25; \
        clock sensor 3 1000; lose /obs 60";
    let knobs: Vec<_> = knobs.split("; ").map(knob).collect();
    let mut commands = Vec::new();
    if first == ClockKind::Virtual {
        commands.push((0.05, Command::HandOver(ClockKind::Real)));
    }
    let mut at = 0.02;
    for _ in 0..dice.below(14) {
        at += dice.below(60) as f64 / 1e3;
        let knob = |dice: &mut Dice| Command::Set(dice.pick(&knobs));
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
fn any_run_comes_back_to_the_bit_however_its_threads_are_scheduled() {
    let _load = Load::new(number("RATELAB_LOAD", 0));
    let mut dice = Dice(number("RATELAB_SEED", 1) as u64);
    for case in 0..number("RATELAB_CASES", 12) {
        let config = random_config(&mut dice);
        let commands = random_commands(&mut dice, config.clock);
        let run = Run::record(&config, person(commands));
        run.check(run.rerun());
        if case % 4 == 0 {
            let mut perturbed = run.rerun();
            perturbed.perturb();
            run.check(perturbed);
        }
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
        let again = run.again(&mut rerun).transcript;
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
        let again = run.again(&mut rerun).transcript;
        assert_eq!(rerun.difference(), None);
        for (one, other) in run.transcript.topics.iter().zip(&again.topics) {
            assert_eq!(&one[..other.len()], other);
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
        support::talker(&mut graph, name, 1_000.0, 0, topic, move |_| {
            let mut total = total.lock();
            *total += 1;
            Some(*total)
        });
    }
    graph
}

/// Runs `graph` for so long with a log; its observer.
fn run_on(clock: &mut dyn Clock, graph: &mut Graph, seconds: f64) -> Observer {
    RunLog::of(&graph.state());
    let end = clock.run(graph, &mut Inbox::default(), secs(seconds));
    end.expect("no fault");
    Observer::of(graph)
}

fn run_really(graph: &mut Graph, seconds: f64) -> Observer {
    run_on(&mut RealClock::default(), graph, seconds)
}

#[test]
fn state_that_nodes_share_comes_back_in_the_same_order() {
    let sums = |clock: &mut dyn Clock| {
        let (total, topic) = total_and_topic();
        let mut graph = adders(&total, &topic);
        let tap = TapHandle::of(&graph).topic(&topic, BACKLOG);
        let observer = run_on(clock, &mut graph, 0.2);
        let sums = tap.items().try_iter();
        let sums = sums.map(|tapped| (tapped.message.data, tapped.head.at));
        (observer, sums.collect::<Vec<_>>())
    };
    let (observer, recorded) = sums(&mut RealClock::default());
    for perturbed in [false, true] {
        let mut rerun = rerun_of(&observer);
        if perturbed {
            rerun.perturb();
        }
        let (again, sums) = sums(&mut rerun);
        assert_eq!(rerun.difference(), None);
        assert_eq!(recorded, sums);
        let logs = [&again, &observer].map(|observer| RunLog::of(observer).log());
        assert_eq!(logs[0], logs[1], "its log is another one");
    }
}

/// Runs graphs of `build` until ticks overlap in one; its observer.
fn with_a_knot(build: impl Fn() -> Graph) -> Observer {
    let mut runs = (0..).map(|_| run_really(&mut build(), 0.1));
    let overlaps = |observer: &Observer| !rerun_of(observer).overlaps().is_empty();
    runs.find(overlaps).expect("one of them")
}

/// Executes `graph` with `rerun`, held after each operation of overlap number `overlap` in turn:
/// `look` sees how many are done.
fn held_in(mut graph: Graph, mut rerun: Rerun, overlap: usize, mut look: impl FnMut(usize)) {
    let all = rerun.overlaps()[overlap].operations.len();
    rerun.hold(overlap, 0);
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
    let overlaps = rerun_of(&observer).overlaps();
    for (number, overlap) in overlaps.iter().enumerate().take(5) {
        assert!(overlap.from <= overlap.to);
        let (total, topic) = total_and_topic();
        let graph = adders(&total, &topic);
        let turn = |name: &str, done: usize| {
            let here = |at: &usize| &*overlap.operations[*at].takes == name;
            let before = (0..done).rev().find(here);
            let next = (done..overlap.operations.len()).find(here);
            let before = before.map(|at| overlap.operations[at].turn + 1);
            before
                .or(next.map(|at| overlap.operations[at].turn))
                .expect("one")
        };
        held_in(graph, rerun_of(&observer), number, |done| {
            assert_eq!(*total.peek(), turn("total", done), "after {done}");
            assert_eq!(topic.published(), turn("/sum", done), "after {done}");
        });
    }
}

#[test]
fn a_lock_within_another_one_does_not_hang_a_run_that_is_held() {
    let build = || {
        let [one, other] = ["one", "other"].map(|name| Arc::new(Shared::new(name, 0)));
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
        let added = graph.node("both", 2_000.0, 0, |_| both);
        let other = graph.node("by turns", 2_000.0, 0, |_| by_turns);
        added.and(other).expect("nodes");
        graph
    };
    let observer = with_a_knot(build);
    for (number, overlap) in rerun_of(&observer).overlaps().iter().enumerate().take(20) {
        let mut last = 0;
        held_in(build(), rerun_of(&observer), number, |done| last = done);
        assert_eq!(last, overlap.operations.len());
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
        run_really(&mut graph, 0.2);
    });
    assert!(noticed.load(Ordering::Relaxed));
    let log = RunLog::of(&observer).log();
    let rerun = Rerun::new(&log, &observer.events(0), &observer.topology());
    let error = rerun.expect_err("it cannot come back").to_string();
    assert!(
        error.contains("total was written to from outside of the graph"),
        "{error}"
    );
}

#[test]
fn a_node_that_does_something_else_is_named() {
    let (total, topic) = total_and_topic();
    let mut rerun = rerun_of(&run_really(&mut adders(&total, &topic), 0.2));
    let (_, topic) = total_and_topic();
    // Another name for what the nodes share is another lock.
    let other = Arc::new(Shared::new("sum", 0));
    run_on(&mut rerun, &mut adders(&other, &topic), 0.2);
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
        graph.node("waits", 100.0, 0, |_| waits).expect("node");
        graph
    };
    let (sender, input) = crossbeam_channel::unbounded();
    (0..1_000).for_each(|_| sender.send(()).expect("open"));
    let mut rerun = rerun_of(&run_really(&mut graph(input), 0.05));
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
        run_on(&mut rerun, &mut again, 0.05);
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
    let end = &run.transcript.lines[0];
    assert!(end.contains("pole_fell"), "{end}");
    let branch = || {
        let mut rerun = run.rerun();
        let rest = rerun.rest_before(secs(0.2), ClockKind::Real).expect("real");
        assert!(rest <= secs(0.2) && rerun.rests().contains(&rest));
        rerun.branch(secs(0.2), vec![Command::Set(knob("takes policy 0"))]);
        let again = run.again(&mut rerun);
        assert_eq!(rerun.difference(), None);
        // It has the log of the part that it shares with the run, and comes back, too.
        again.check(again.rerun());
        again.transcript
    };
    let (one, other) = (branch(), branch());
    assert_eq!(one.difference(&other), None);
    assert!(one.lines[0].contains("balanced"), "{}", one.lines[0]);
    let before = one.topics[0].partition_point(|(at, _)| *at < secs(0.15));
    assert!(before > 0);
    assert_eq!(one.topics[0][..before], run.transcript.topics[0][..before]);
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

/// Counts the ticks that are recorded.
#[derive(Default)]
struct TickCount(AtomicUsize);

impl Sink for TickCount {
    fn node(&self, _: usize, record: &NodeRecord) {
        if let NodeRecord::Ticked(_) = record {
            self.0.fetch_add(1, Ordering::Relaxed);
        }
    }

    fn topic(&self, _: usize, _: &TopicRecord<'_>) {}
}

/// Two nodes of an executor with two threads; the first one's ticks take 60 ms.
fn shared_threads() -> Graph {
    counted_threads(&Arc::default())
}

/// Such a graph, whose ticks count how many of them began.
fn counted_threads(began: &Arc<AtomicUsize>) -> Graph {
    let mut graph = Graph::with(Effects);
    for (name, rate) in [("slow", 10.0), ("fast", 100.0)] {
        let began = began.clone();
        let tick = move |_: Time| {
            began.fetch_add(1, Ordering::Relaxed);
            GO_ON
        };
        let added = graph.node(name, rate, 0, |_| tick);
        added.expect("a node");
    }
    graph.turn(&knob("takes slow 60")).expect("a node");
    share_threads(&mut graph, ["slow", "fast"]);
    graph
}

/// Has two threads execute these nodes.
fn share_threads(graph: &mut Graph, nodes: [&str; 2]) {
    let executor = "multi:2".parse().expect("an executor");
    graph
        .executor(executor, nodes.map(Callback::of))
        .expect("nodes");
}

#[test]
fn a_branch_leaves_no_tick_of_an_executor_half_done() {
    let observer = run_really(&mut shared_threads(), 0.45);
    let rests = rerun_of(&observer).rests();
    assert!(!rests.is_empty());
    for rest in rests {
        let (began, count) = (Arc::default(), Arc::new(TickCount::default()));
        let (mut again, sink) = (counted_threads(&began), count.clone());
        again.sink_or(move || sink);
        let mut rerun = rerun_of(&observer);
        rerun.branch(rest, Vec::new());
        let inbox = &mut Inbox::default();
        let exit = run(&mut again, inbox, secs(0.45), ClockKind::Real, &mut rerun);
        exit.expect("a run");
        let [began, recorded] = [&*began, &count.0].map(|count| count.load(Ordering::Relaxed));
        assert_eq!(began, recorded, "left at {rest}");
    }
}

#[test]
fn a_command_that_is_refused_comes_back_where_threads_share_nodes() {
    let (mut first, end) = (shared_threads(), secs(0.2));
    let command = Command::Set(knob("send fast hello"));
    RunLog::of(&first.state());
    let timed = vec![support::at(0.1, command)];
    support::run_timed(&mut RealClock::default(), &mut first, timed, end);
    let observer = Observer::of(&first);
    let mut rerun = rerun_of(&observer);
    rerun.expect_refusals(|_| true);
    let mut again = shared_threads();
    let exit = rerun.run(&mut again, &mut Inbox::default(), end);
    exit.expect("a run");
    assert_eq!(rerun.difference(), None);
    assert_eq!(observer.events(0).len(), 1);
    assert_eq!(again.state().events(0), observer.events(0));
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
        share_threads(&mut graph, ["adder", "doubler"]);
        graph
    };
    let (commander, mut inbox) = Inbox::new(Vec::new());
    let (mut first, end) = (graph(Some(commander)), secs(0.4));
    RunLog::of(&first.state());
    let exit = RealClock::default().run(&mut first, &mut inbox, end);
    exit.expect("a run");
    let observer = Observer::of(&first);
    for _ in 0..5 {
        let mut rerun = rerun_of(&observer);
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
