//! A run of the real clock comes back to the bit from its log: every message, tick, drop,
//! event, figure and verdict, whatever was changed while it ran.
//!
//! `RATELAB_CASES=200` tries more runs, and `RATELAB_LOAD=4` keeps cores busy meanwhile.

mod support;

use std::{
    hint::black_box,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::Duration,
};

use crossbeam_channel::Sender;
use ratelab::{
    experiment::{Config, Experiment, Summary},
    runtime::{
        ClockKind, Command, Log, Observer, Rerun, RowTap, Rows, Tap, TickRecord, TimedCommand,
        telemetry::{Distribution, Event, EventKind, Topology},
    },
    system::WorldKind,
};
use support::{cart_pole, config, secs};

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
    use Command::{Pause, Resume, Speed, Step};
    match &event.what {
        EventKind::Applied { command, .. } | EventKind::Refused { command, .. } => {
            matches!(command, Pause | Resume | Speed(_) | Step)
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
        let read = topic.subscriptions.iter();
        let read: Vec<_> = read
            .map(|s| (s.dropped, s.dropped_lately, of(&s.ages)))
            .collect();
        all.push(format!(
            "{} {} {} {} {} {} {} {} {:?} {:?} {read:?}",
            topic.name,
            topic.depth,
            topic.published,
            topic.lost,
            topic.overtaken,
            topic.in_flight,
            topic.lost_lately,
            topic.per_second,
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
            log: observer.log(),
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
        let config = Config {
            speed: ratelab::runtime::Speed::Unlimited,
            knobs: Vec::new(),
            ..self.config.clone()
        };
        let mut experiment = Experiment::new(cart_pole(), &config).expect("experiment");
        experiment.schedule(self.given(rerun));
        let taps = Taps::new(&experiment);
        let end = experiment
            .run_with(rerun)
            .map_err(|fault| fault.to_string());
        taps.transcript(end.as_ref().map_err(Clone::clone))
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

/// Threads that keep cores busy.
struct Load(Arc<AtomicBool>);

impl Load {
    fn new(threads: usize) -> Self {
        let over = Arc::new(AtomicBool::new(false));
        for _ in 0..threads {
            let over = over.clone();
            thread::spawn(move || {
                while !over.load(Ordering::Relaxed) {
                    black_box((0..1_000).fold(0_u64, |sum, n| sum ^ black_box(n)));
                }
            });
        }
        Self(over)
    }
}

impl Drop for Load {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
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
        speed: ratelab::runtime::Speed::REAL_TIME,
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
            3 => commands.push((at, Command::Speed(ratelab::runtime::Speed::REAL_TIME))),
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
