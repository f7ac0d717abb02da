//! A run of the real clock comes back to the bit from its log: every message, tick, drop,
//! event, figure and verdict, whatever was changed while it ran.
//!
//! `RATELAB_CASES=200` tries more runs, and `RATELAB_LOAD=4` keeps cores busy meanwhile.

use std::{
    fmt::Debug,
    sync::atomic::{AtomicBool, Ordering},
    thread,
};

use crossbeam_channel::Sender;
use rand_pcg::{Pcg64, rand_core::RngCore};

use crate::{load::Load, support::*};

/// Random numbers.
struct Dice(Pcg64);

impl Dice {
    fn below(&mut self, sides: usize) -> usize {
        (self.0.next_u64() % sides as u64) as usize
    }

    fn pick<T: Clone>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())].clone()
    }
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

/// All figures but those that the wall gives, and the events.
fn lines(observer: &Observer, end: Result<Summary, Fault>) -> Vec<String> {
    let mut snapshot = observer.snapshot();
    let none = Distribution::default();
    for node in &mut snapshot.nodes {
        (node.tick_time, node.response) = (none.clone(), none.clone());
    }
    let end = end.map(|end| {
        let (judged, plant) = ((end.verdict, end.steps), (end.sim_time, end.state));
        format!("{judged:?} {plant:?} {:?} {:?}", end.cost, end.latency)
    });
    let now = format!("{:?} {:?}", snapshot.now, snapshot.status.clock);
    let nodes = snapshot.nodes.iter().map(|node| format!("{node:?}"));
    let topics = snapshot.topics.iter().map(|topic| format!("{topic:?}"));
    let events = observer.events(0).into_iter().filter(|event| !paces(event));
    let all = [end.unwrap_or_else(|fault| fault.to_string()), now].into_iter();
    let all = all.chain(nodes).chain(topics);
    all.chain(events.map(|event| format!("{event:?}")))
        .collect()
}

const BACKLOG: usize = 1 << 15;

/// A run with a log, and all of it that must come back.
pub struct Run {
    system: Arc<dyn System>,
    config: Config,
    pub log: Log,
    events: Vec<Event>,
    topology: Topology,
    /// The messages of each topic with their run times, as text that is exact to the bit.
    topics: Vec<Vec<(Time, String)>>,
    pub ticks: Vec<Vec<TickRecord>>,
    /// The figures, then the events.
    lines: Vec<String>,
}

impl Run {
    /// What comes of `experiment` when `execute` runs it.
    fn of(
        system: &Arc<dyn System>,
        config: Config,
        experiment: Experiment,
        execute: impl FnOnce(Experiment) -> Result<Summary, Fault>,
    ) -> Self {
        let (taps, observer) = (experiment.taps(), experiment.observer());
        let rows = taps
            .topics()
            .iter()
            .map(|topic| taps.rows(topic.name(), BACKLOG));
        let rows: Vec<_> = rows.collect();
        let ticks = taps.ticks(BACKLOG);
        let end = execute(experiment);
        let topics = rows.iter().flatten().map(|tap| {
            let mut rows = tap.rows();
            tap.take(&mut rows);
            assert_eq!(tap.lost(), 0);
            let rows = rows.iter();
            let rows = rows.map(|(head, row)| (head.at, format!("{head:?} {row:?}")));
            rows.collect()
        });
        let ticks = ticks.iter();
        Self {
            system: system.clone(),
            config,
            log: RunLog::attach(&observer).log(),
            events: observer.events(0),
            topology: observer.topology(),
            topics: topics.collect(),
            ticks: ticks.map(|tap| tap.items().try_iter().collect()).collect(),
            lines: lines(&observer, end),
        }
    }

    /// Runs `system` with timed `commands`, while `person` gives others.
    pub fn record(
        system: &Arc<dyn System>,
        config: &Config,
        commands: Vec<TimedCommand>,
        person: impl FnOnce(&Sender<Command>, &Observer, &AtomicBool) + Send,
    ) -> Self {
        let mut experiment = Experiment::new(system.clone(), config).expect("experiment");
        experiment.schedule(commands);
        let (commander, observer) = (experiment.commands(), experiment.observer());
        let over = AtomicBool::new(false);
        Self::of(system, config.clone(), experiment, |experiment| {
            thread::scope(|scope| {
                let over = &over;
                // The sender goes with the last command: nobody else can end a pause.
                scope.spawn(move || person(&commander, &observer, over));
                let end = experiment.run();
                over.store(true, Ordering::Relaxed);
                end
            })
        })
    }

    pub fn re_execution(&self) -> ReExecution {
        ReExecution::new(&self.log, &self.events, &self.topology).expect("a log")
    }

    /// Executes it again with `re_execution`, as a run of its own with a log.
    fn again(&self, re_execution: &mut ReExecution) -> Self {
        let config = Config {
            speed: Speed::Unlimited,
            knobs: Vec::new(),
            ..self.config.clone()
        };
        let experiment = Experiment::new(self.system.clone(), &config);
        let mut experiment = experiment.expect("experiment");
        experiment.schedule(self.given(re_execution));
        let execute = |experiment: Experiment| experiment.run_with(re_execution);
        Self::of(&self.system, config, experiment, execute)
    }

    /// The commands under the virtual clock.
    fn given(&self, re_execution: &ReExecution) -> Vec<TimedCommand> {
        let events = self.events.iter().enumerate();
        let others = events.filter(|(index, event)| !re_execution.knows(*index) && !paces(event));
        let commands = others.filter_map(|(_, event)| match &event.what {
            EventKind::Applied { command, .. } | EventKind::Refused { command, .. } => {
                let (at, command) = (event.at, command.clone());
                Some(TimedCommand { at, command })
            }
            _ => None,
        });
        commands.collect()
    }

    /// The first difference of `other` from it.
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

    /// Checks that it comes back by `re_execution`; what came.
    #[track_caller]
    pub fn check(&self, mut re_execution: ReExecution) -> Self {
        let again = self.again(&mut re_execution);
        assert_eq!(re_execution.difference(), None, "{:?}", self.config);
        let difference = self.difference(&again);
        assert_eq!(difference, None, "{:?}\n{:#?}", self.config, self.events);
        again
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
    let world = dice.pick(&[WorldKind::OWN, WorldKind::Course, WorldKind::Course]);
    if !world.is_course() && dice.below(2) == 0 {
        setup.push("rate actuator 200".to_owned());
    }
    Config {
        seed: dice.below(1_000) as u64,
        clock: dice.pick(&[ClockKind::Real, ClockKind::Real, ClockKind::Virtual]),
        speed: Speed::REAL_TIME,
        end: secs(0.4),
        world,
        ..config(&setup.join("; "))
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
    let knobs: Vec<_> = knobs.split("; ").collect();
    let mut commands = Vec::new();
    if first == ClockKind::Virtual {
        commands.push((0.05, command("real")));
    }
    let mut at = 0.02;
    for _ in 0..dice.below(14) {
        at += dice.below(60) as f64 / 1e3;
        let texts = match dice.below(12) {
            0 => vec!["pause", dice.pick(&knobs), dice.pick(&knobs), "resume"],
            1 => vec!["virtual"],
            2 => vec!["real"],
            3 => vec!["speed 1"],
            _ => vec![dice.pick(&knobs)],
        };
        commands.extend(texts.into_iter().map(|text| (at, command(text))));
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
                thread::sleep(ms(1));
            }
            // The run may be over by now.
            let _ = commander.send(command);
        }
    }
}

/// Runs the cart-pole while `person` gives commands.
fn record(
    config: &Config,
    person: impl FnOnce(&Sender<Command>, &Observer, &AtomicBool) + Send,
) -> Run {
    let system: Arc<dyn System> = cart_pole();
    Run::record(&system, config, Vec::new(), person)
}

#[test]
fn any_run_comes_back_to_the_bit_however_its_threads_are_scheduled() {
    let _load = Load::new(number("RATELAB_LOAD", 0));
    let mut dice = Dice(generator(&[number("RATELAB_SEED", 1)]));
    for case in 0..number("RATELAB_CASES", 12) {
        let config = random_config(&mut dice);
        let commands = random_commands(&mut dice, config.clock);
        let run = record(&config, person(commands));
        run.check(run.re_execution());
        if case % 4 == 0 {
            let mut perturbed = run.re_execution();
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
    let mut dice = Dice(generator(&[3]));
    let config = config("real; until 0.2; rate sensor 500; rate policy 200");
    let slower = vec![(0.1, command("rate policy 100"))];
    let run = record(&config, person(slower));
    let (mut refused, mut other, mut same) = (0, 0, 0);
    for _ in 0..number("RATELAB_CASES", 150) {
        let log = altered(&run.log, &mut dice);
        let Ok(mut re_execution) = ReExecution::new(&log, &run.events, &run.topology) else {
            refused += 1;
            continue;
        };
        let again = run.again(&mut re_execution);
        match re_execution.difference().or(run.difference(&again)) {
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
    let config = config("real; until 0.2; rate sensor 500; takes policy 5");
    let mut cuts = Vec::new();
    let run = record(&config, |_, observer, over| {
        while !over.load(Ordering::Relaxed) {
            // Events after the log: it mentions no later ones.
            let log = RunLog::attach(observer).log();
            cuts.push((log, observer.events(0)));
            thread::sleep(ms(5));
        }
    });
    let mut longest = 0;
    for (log, events) in cuts {
        let re_execution = ReExecution::from_torn(&log, &events, &run.topology);
        let mut re_execution = re_execution.expect("a part of a log");
        let again = run.again(&mut re_execution);
        assert_eq!(re_execution.difference(), None);
        for (one, other) in run.topics.iter().zip(&again.topics) {
            assert_eq!(&one[..other.len()], other);
            longest = longest.max(other.len());
        }
    }
    assert!(longest > 0);
}

#[test]
fn a_branch_leaves_the_run_at_the_last_rest_and_is_the_same_every_time() {
    let config = config("real; until 2; takes policy 230");
    let run = record(&config, person(Vec::new()));
    let end = &run.lines[0];
    assert!(end.contains("pole_fell"), "{end}");
    let branch = || {
        let mut re_execution = run.re_execution();
        let rest = re_execution
            .rest_before(secs(0.2), ClockKind::Real)
            .expect("real");
        assert!(rest <= secs(0.2) && re_execution.rests().contains(&rest));
        re_execution.branch(secs(0.2), vec![command("takes policy 0")]);
        let again = run.again(&mut re_execution);
        assert_eq!(re_execution.difference(), None);
        // It has the log of the part that it shares with the run, and comes back, too.
        again.check(again.re_execution());
        (again, rest)
    };
    let ((one, rest), (other, _)) = (branch(), branch());
    assert_eq!(one.difference(&other), None);
    assert!(one.lines[0].contains("balanced"), "{}", one.lines[0]);
    let before = one.topics[0].partition_point(|(at, _)| *at < rest);
    assert!(before > 0);
    assert_eq!(one.topics[0][..before], run.topics[0][..before]);
}
