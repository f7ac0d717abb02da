//! Ways to lose the pole: each has its cause named, and the named cure works.

use std::{path::Path, sync::Arc};

use ratelab::{Head, Knob, Time, TimedKnob};
use ratelab_account::{Snapshot, TickRecord};
use ratelab_cart_pole::CartPole;
use ratelab_effects::checked;
use ratelab_study::{
    experiment::{Config, Experiment, Summary},
    system::{AgeLimits, Setup, System, WorldKind},
};

use super::*;
use crate::{dashboard::lineage_taps::LineageTaps, recording::Recording};

/// A way to lose the pole: the world, knobs from the start, timed knobs, and the owner of
/// the age, such as `Rate policy`; none if age is not the cause.
struct Way {
    world: WorldKind,
    setup: &'static [&'static str],
    later: &'static [(f64, &'static str)],
    owners: &'static [&'static str],
}

const fn way(
    world: WorldKind,
    setup: &'static [&'static str],
    owners: &'static [&'static str],
) -> Way {
    Way {
        world,
        setup,
        later: &[],
        owners,
    }
}

const fn fault(later: &'static [(f64, &'static str)], owners: &'static [&'static str]) -> Way {
    Way {
        world: OWN,
        setup: &[],
        later,
        owners,
    }
}

const COURSE: WorldKind = WorldKind::Course;
const OWN: WorldKind = WorldKind::OWN;

/// Ways to lose the pole.
const WAYS: [Way; 31] = [
    way(COURSE, &["rate policy 5"], &["Rate policy"]),
    way(
        COURSE,
        &["rate policy 5", "depth /obs 100", "depth /action 100"],
        &["Rate policy"],
    ),
    way(OWN, &["rate policy 5"], &["Rate policy"]),
    way(COURSE, &["rate sensor 5"], &["Rate sensor"]),
    way(OWN, &["rate sensor 4", "depth /obs 100"], &["Rate sensor"]),
    way(
        OWN,
        &["rate sensor 5", "rate policy 5"],
        &["Rate sensor", "Rate policy"],
    ),
    way(OWN, &["rate actuator 5"], &["Rate actuator"]),
    way(OWN, &["takes policy 70"], &["Cost policy"]),
    way(OWN, &["takes policy 60..110"], &["Cost policy"]),
    way(OWN, &["takes sensor 90"], &["Cost sensor"]),
    way(OWN, &["takes actuator 80"], &["Cost actuator"]),
    way(OWN, &["wakes policy 190"], &["Late policy"]),
    way(
        OWN,
        &["rate policy 8", "offset policy 100", "rate sensor 8"],
        &["Phase policy"],
    ),
    way(OWN, &["link /obs delay:100"], &["Link /obs"]),
    way(OWN, &["link /action delay:100"], &["Link /action"]),
    way(OWN, &["link /action delay:0..250"], &["Link /action"]),
    way(OWN, &["link /action loss:0.9"], &["Link /action"]),
    way(OWN, &["link /obs loss:0.92"], &["Link /obs"]),
    way(OWN, &["link /obs burst:0.05,30"], &["Link /obs"]),
    way(
        OWN,
        &["link /action loss:0.3,reliable:150"],
        &["Link /action"],
    ),
    way(
        COURSE,
        &["rate policy 45", "read /obs oldest", "depth /obs 10"],
        &["Order /obs"],
    ),
    way(
        OWN,
        &["rate policy 10", "clock policy 0 -500000"],
        &["Clock policy"],
    ),
    fault(&[(1.0, "crash policy")], &["Crash policy"]),
    fault(&[(1.0, "crash sensor")], &["Crash sensor"]),
    fault(&[(0.1, "hang policy 900")], &["Hang policy"]),
    fault(&[(0.1, "hang sensor 900")], &["Hang sensor"]),
    // Without any message.
    fault(&[(0.0, "crash policy")], &["Crash policy"]),
    fault(&[(0.0, "crash sensor")], &["Crash sensor"]),
    way(OWN, &["hang policy 900"], &["Hang policy"]),
    way(OWN, &["link /obs loss:1"], &["Link /obs"]),
    // Restored, but too late.
    fault(
        &[(0.1, "rate policy 4"), (0.6, "rate policy 50")],
        &["Rate policy"],
    ),
];

fn knob(text: &str) -> Knob {
    checked(text.parse().expect(text)).expect(text)
}

impl Way {
    fn config(&self, seed: u64) -> Config {
        let later = self.later.iter().map(|(at, text)| TimedKnob {
            at: Time::from_secs_f64(*at).expect("a time"),
            knob: knob(text),
        });
        Config {
            seed,
            world: self.world,
            end: Time::from_secs_f64(12.0).expect("a time"),
            setup: self.setup.iter().map(|text| knob(text)).collect(),
            knobs: later.collect(),
            ..Config::default()
        }
    }
}

/// The summary of a run, its graph at the end, and the cause if it was lost.
fn run(config: &Config) -> (Summary, Snapshot, Cause) {
    let played = Played::of(config);
    let cause = cause(&played.graph, &played.lineage, &played.setup());
    (played.summary, played.graph, cause)
}

/// The cause of a loss at the moment of `graph`.
fn cause(graph: &Snapshot, lineage: &Lineage, setup: &Setup) -> Cause {
    cause_after(graph, lineage, setup, &Setup::default())
}

/// The same after some knobs were `turned`.
fn cause_after(graph: &Snapshot, lineage: &Lineage, setup: &Setup, turned: &Setup) -> Cause {
    let system = CartPole::default();
    let acts = acting(&system, graph).expect("an actuator");
    let late = latest(graph, lineage, acts);
    let facts = Facts {
        system: &system,
        setup,
        turned,
        graph,
        lineage,
        age: age(lineage, acts, late, system.age_limits(setup)),
        late,
        hangs: &Hang::at_the_start(setup),
        live: false,
    };
    facts.cause(None)
}

/// A run that is over, with its chains and all knobs, those of the start first.
struct Played {
    summary: Summary,
    graph: Snapshot,
    lineage: Lineage,
    knobs: Vec<TimedKnob>,
}

impl Played {
    fn of(config: &Config) -> Self {
        let system: Arc<dyn System> = Arc::new(CartPole::default());
        let experiment = Experiment::new(system, config).expect("a graph");
        let (observer, mut taps) = (experiment.observer(), LineageTaps::new(&experiment));
        let summary = experiment.run().expect("no fault");
        let at = Time::ZERO;
        let start = config.setup.iter().cloned();
        let start = start.map(|knob| TimedKnob { at, knob });
        Self {
            knobs: start.chain(summary.knobs()).collect(),
            lineage: taps.update().clone(),
            graph: observer.snapshot(),
            summary,
        }
    }

    fn setup(&self) -> Setup {
        self.knobs.iter().map(|timed| timed.knob.clone()).collect()
    }
}

/// The push age over run time `late`.
fn age(
    lineage: &Lineage,
    acts: usize,
    (from, to): (Time, Time),
    limits: AgeLimits,
) -> Option<AgeData> {
    let parts = lineage.mean_parts(acts, from, to);
    let mean: f64 = parts.iter().map(|(_, ns)| ns).sum();
    let greatest = lineage.greatest_age(acts, from, to);
    (!parts.is_empty()).then(|| AgeData {
        mean: Duration::from_nanos(mean as u64),
        greatest,
        stretch: (from, to),
        limits,
    })
}

/// Whether undoing `knob` is the cure.
fn is_mended_by(owner: Owner, knob: &Knob, graph: &Snapshot) -> bool {
    let node = |index: usize| *graph.nodes[index].name == *knob.target();
    let topic = |index: usize| *graph.topics[index].name == *knob.target();
    match owner {
        Owner::Rate(index) => node(index) && matches!(knob, Knob::Rate { .. }),
        Owner::Cost(index) => node(index) && matches!(knob, Knob::Takes { .. }),
        Owner::Hang(index) => node(index) && matches!(knob, Knob::Hang { .. }),
        Owner::Late(index) => node(index) && matches!(knob, Knob::Wakes { .. }),
        Owner::Crash(index) => node(index) && matches!(knob, Knob::Crash { .. }),
        Owner::Clock(index) => node(index) && matches!(knob, Knob::Clock { .. }),
        Owner::Phase(index) => node(index) && matches!(knob, Knob::Offset { .. }),
        Owner::Link(index) => {
            topic(index)
                && matches!(
                    knob,
                    Knob::Link { .. } | Knob::Lose { .. } | Knob::Postpone { .. }
                )
        }
        Owner::Order(index) => topic(index) && matches!(knob, Knob::Read { .. }),
        Owner::Match(..) => false,
    }
}

fn names(owners: &[Owner], graph: &Snapshot) -> Vec<String> {
    let node = |what: &str, index: usize| format!("{what} {}", graph.nodes[index].name);
    let topic = |what: &str, index: usize| format!("{what} {}", graph.topics[index].name);
    let name = |owner: &Owner| match *owner {
        Owner::Rate(index) => node("Rate", index),
        Owner::Cost(index) => node("Cost", index),
        Owner::Hang(index) => node("Hang", index),
        Owner::Late(index) => node("Late", index),
        Owner::Crash(index) => node("Crash", index),
        Owner::Clock(index) => node("Clock", index),
        Owner::Phase(index) => node("Phase", index),
        Owner::Link(index) => topic("Link", index),
        Owner::Order(index) => topic("Order", index),
        Owner::Match(index, _) => topic("Match", index),
    };
    owners.iter().map(name).collect()
}

#[test]
fn the_cause_that_is_named_is_the_one_whose_removal_mends_it() {
    let mut wrong = Vec::new();
    for way in &WAYS {
        let config = way.config(0);
        let (summary, graph, cause) = run(&config);
        let what = (way.setup, way.later);
        if !summary.verdict.is_lost() {
            wrong.push(format!("{what:?} stands"));
            continue;
        }
        let named = names(&cause.owners, &graph);
        if named != way.owners {
            wrong.push(format!("{what:?}: {named:?}, {:?}", cause.lines));
            continue;
        }
        let stays = |knob: &&Knob| {
            let mut owners = cause.owners.iter();
            !owners.any(|owner| is_mended_by(*owner, knob, &graph))
        };
        let mended = Config {
            setup: config.setup.iter().filter(stays).cloned().collect(),
            knobs: config
                .knobs
                .iter()
                .filter(|timed| stays(&&timed.knob))
                .cloned()
                .collect(),
            ..config
        };
        let (summary, ..) = run(&mended);
        if summary.verdict.is_lost() {
            wrong.push(format!("{what:?} without {named:?}: {}", summary.verdict));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn where_age_is_not_to_blame_no_node_is() {
    for (setup, why) in [
        ("send policy zero", "the zero policy"),
        ("send policy random", "the random policy"),
    ] {
        let way = Way {
            world: COURSE,
            setup: &[],
            later: &[],
            owners: &[],
        };
        let mut config = way.config(0);
        config.setup.set(knob(setup));
        let (summary, _, cause) = run(&config);
        assert!(summary.verdict.is_lost(), "{setup}");
        assert_eq!(cause.owners, [], "{setup}");
        assert!(cause.lines[0].contains(why), "{:?}", cause.lines);
    }
}

/// `patient` learned with pushes that are held. Half of each push is cut off here, so that
/// the motor is weaker than any that it met. Linear feedback bears that.
const WEAK_MOTOR: [&str; 2] = ["rate actuator 500", "send actuator zero:5"];

#[test]
fn a_network_outside_of_its_training_is_to_blame_and_its_age_is_not() {
    let with = |policy: &str| {
        let mut config = way(OWN, &WEAK_MOTOR, &[]).config(0);
        config.setup.set(knob(&format!("send policy {policy}")));
        run(&config)
    };
    let (summary, _, cause) = with(&network());
    assert!(summary.verdict.is_lost());
    assert_eq!(cause.owners, []);
    let text = "age is not to blame (10 ms of 104): policy patient.safetensors does not balance it";
    assert_eq!(cause.lines, [text]);
    for linear in ["scripted", "lqr"] {
        assert!(!with(linear).0.verdict.is_lost(), "{linear}");
    }
}

/// The shipped network `patient` with the digest of its content.
fn network() -> String {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../policies/patient.safetensors"
    );
    let setup = Setup::default();
    let pinned = CartPole::default().resolve(0, &setup, "policy", path);
    pinned.expect("weights")
}

/// A policy at 50 Hz whose ticks take 85 ms, as the real clock measures it: a tick acts at
/// its start, and four of five periods are overruns.
fn overrunning() -> (Snapshot, Lineage) {
    let system: Arc<dyn System> = Arc::new(CartPole::default());
    let experiment = Experiment::new(system, &Config::default()).expect("a graph");
    let observer = experiment.observer();
    let (mut graph, mut lineage) = (observer.snapshot(), Lineage::new(observer.topology()));
    let [sensor, policy, actuator] = [0, 1, 2];
    let [observations, actions] = [0, 1];
    let ms = |ms: u64| Time::from_nanos(ms * 1_000_000);
    for number in 0..150 {
        let at = ms(20 * number);
        lineage.tick(sensor, tick(number, at, 0));
        lineage.message(observations, &head(number, at, None));
        if number % 5 == 0 {
            let decides = at + Time::RESOLUTION;
            lineage.tick(policy, tick(number / 5, decides, 85));
            lineage.message(actions, &head(number / 5, decides, Some(at)));
        }
        lineage.tick(actuator, tick(number, at + 2 * Time::RESOLUTION, 0));
    }
    lineage.settle();
    graph.nodes[policy].overruns = 120;
    graph.now = ms(3_000);
    (graph, lineage)
}

fn tick(number: u64, at: Time, took_ms: u64) -> TickRecord {
    TickRecord {
        number,
        at,
        ends: Some(at),
        lateness: Some(Duration::ZERO),
        took: Some(Duration::from_millis(took_ms)),
        overruns: 0,
        push: None,
    }
}

fn head(seq: u64, at: Time, origin: Option<Time>) -> Head {
    Head {
        at,
        stamp: at,
        seq,
        origin,
        arrives: Some(at),
        dropped: 0,
    }
}

#[test]
fn overruns_under_the_real_clock_are_blamed_on_the_long_ticks() {
    let (graph, lineage) = overrunning();
    let by_itself = cause(&graph, &lineage, &Setup::default());
    assert_eq!(names(&by_itself.owners, &graph), ["Cost policy"]);
    let text = "the age arose in the policy: its ticks take 85 % of the time and come every 100 \
                ms. try a faster one";
    assert_eq!(by_itself.lines[0], text);
    let by_knob = cause(
        &graph,
        &lineage,
        &[knob("takes policy 85")].into_iter().collect(),
    );
    assert!(
        by_knob.lines[0].ends_with("try takes policy none"),
        "{:?}",
        by_knob.lines
    );
}

/// Whether the push age ever warned before the end of a run.
fn warned(lineage: &Lineage, graph: &Snapshot, knobs: &[TimedKnob], end: Time) -> bool {
    const STEP: Duration = Duration::from_millis(20);
    let system = CartPole::default();
    let acts = acting(&system, graph).expect("an actuator");
    let (mut now, mut setup) = (Time::ZERO + STEP, None);
    let mut limits = AgeLimits::default();
    while now < end {
        let so_far = knobs.iter().filter(|timed| timed.at <= now);
        let in_force: Setup = so_far.map(|timed| timed.knob.clone()).collect();
        if setup.as_ref() != Some(&in_force) {
            limits = system.age_limits(&in_force);
            setup = Some(in_force);
        }
        let graph = Snapshot {
            now,
            ..graph.clone()
        };
        let late = latest(&graph, lineage, acts);
        let age = age(lineage, acts, late, limits);
        if age.is_some_and(|age| matches!(age.strain(), Strain::Swings | Strain::Falls)) {
            return true;
        }
        now = now + STEP;
    }
    false
}

#[test]
fn a_run_is_warned_before_it_falls_if_and_only_if_age_is_to_blame() {
    let not_age = [
        &["send policy zero"][..],
        &["send policy random"],
        &[WEAK_MOTOR[0], WEAK_MOTOR[1], "send policy PATIENT"],
    ];
    let others = not_age.map(|setup| way(OWN, setup, &[]));
    let mut wrong = Vec::new();
    for way in WAYS.iter().chain(&others) {
        let mut config = way.config(0);
        for text in way.setup {
            config.setup.set(knob(&text.replace("PATIENT", &network())));
        }
        let played = Played::of(&config);
        let end = played.summary.verdict.at;
        let warned = warned(&played.lineage, &played.graph, &played.knobs, end);
        let old = !way.owners.is_empty() && played.summary.push_age().is_some();
        if !played.summary.verdict.is_lost() || warned != old {
            wrong.push(format!("{:?} {:?}: warned {warned}", way.setup, way.later));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_healthy_run_is_never_warned() {
    for policy in ["scripted", "lqr", &network()] {
        for world in [COURSE, OWN] {
            let mut config = way(world, &[], &[]).config(1);
            config.setup.set(knob(&format!("send policy {policy}")));
            let played = Played::of(&config);
            let end = played.summary.verdict.at;
            let warned = warned(&played.lineage, &played.graph, &played.knobs, end);
            assert!(!warned, "{policy}");
        }
    }
}

#[test]
fn the_shipped_recordings_are_warned_where_age_felled_or_endangered_the_pole() {
    for (name, expected) in [
        ("balanced-50hz", false),
        ("fall-5hz", true),
        ("rescued", true),
    ] {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../recordings");
        let recording = Recording::read(&root.join(format!("{name}.rrd"))).expect("a recording");
        let system: Arc<dyn System> = Arc::new(CartPole::default());
        let experiment = Experiment::new(system, &recording.origin.config).expect("a graph");
        let graph = experiment.observer().snapshot();
        let (lineage, knobs) = (recording.lineage(), recording.knobs());
        let warned = warned(&lineage, &graph, &knobs, recording.until);
        assert_eq!(warned, expected, "{name}");
    }
}

#[test]
fn a_slow_lqr_leaves_the_rail_with_the_pole_up_and_its_rate_is_named() {
    let mut config = WAYS[0].config(1);
    config.setup = CartPole::config("policy lqr, control-hz 0.5")
        .expect("knobs")
        .setup;
    let (summary, graph, cause) = run(&config);
    assert_eq!(summary.verdict.name(), "cart_left_rail");
    assert_eq!(names(&cause.owners, &graph), ["Rate policy"]);
}

/// Expected to lose the pole, and does not.
#[test]
fn these_troubles_it_bears() {
    for setup in [
        &["clock policy 5 40"][..],
        &["takes policy 30"],
        &["link /obs loss:0.5"],
        &["link /action delay:0..60"],
        &["rate policy 49", "depth /obs 10"],
        &["rate actuator 12"],
    ] {
        let mut config = way(OWN, &[], &[]).config(0);
        config.setup = setup.iter().map(|text| knob(text)).collect();
        let (summary, _, _) = run(&config);
        assert!(!summary.verdict.is_lost(), "{setup:?}: {}", summary.verdict);
    }
}

#[test]
fn a_knob_that_was_turned_too_late_is_no_advice() {
    for (setup, later, cure) in [
        (
            "takes policy 230",
            "takes policy 0",
            "takes policy none came too late",
        ),
        (
            "link /action delay:200",
            "link /action none",
            "link /action none came too late",
        ),
        (
            "rate policy 4",
            "rate policy 50",
            "control-hz was raised too late",
        ),
    ] {
        let mut config = way(OWN, &[], &[]).config(0);
        config.setup.set(knob(setup));
        let played = Played::of(&config);
        let fell = played.summary.verdict.at;
        // As it falls: nothing is saved any more.
        config.knobs = vec![TimedKnob {
            at: Time::ZERO + fell.since(Time::ZERO + Duration::from_millis(20)),
            knob: knob(later),
        }];
        let played = Played::of(&config);
        assert!(played.summary.verdict.is_lost(), "{setup}");
        let turned: Setup = config
            .knobs
            .iter()
            .map(|timed| timed.knob.clone())
            .collect();
        let cause = cause_after(&played.graph, &played.lineage, &played.setup(), &turned);
        assert!(cause.lines[0].ends_with(cure), "{:?}", cause.lines);
    }
}

/// The lines about a run that `config` begins, once its cures were tried.
fn proven(setup: &[&str]) -> Vec<String> {
    let mut config = way(OWN, &[], &[]).config(0);
    config.setup = setup.iter().map(|text| knob(text)).collect();
    let played = Played::of(&config);
    assert!(played.summary.verdict.is_lost(), "{setup:?}");
    let system: Arc<dyn System> = Arc::new(CartPole::default());
    let acts = acting(&*system, &played.graph).expect("an actuator");
    let late = latest(&played.graph, &played.lineage, acts);
    let facts = Facts {
        system: &*system,
        setup: &config.setup,
        turned: &Setup::default(),
        graph: &played.graph,
        lineage: &played.lineage,
        age: age(
            &played.lineage,
            acts,
            late,
            system.age_limits(&config.setup),
        ),
        late,
        hangs: &Hang::at_the_start(&config.setup),
        live: true,
    };
    let now = played.graph.now;
    let trial = Trial::new(system.clone(), &config, config.setup.clone(), now);
    let untried = facts.cause(None).lines;
    assert!(!untried.join(" ").contains("mends"), "{untried:?}");
    facts.cause(trial.run(&facts.cures()).as_ref()).lines
}

#[test]
fn only_what_was_tried_is_said_to_mend_it_and_what_is_not_enough_is_named_with_its_share() {
    for (setup, told) in [
        (
            &["hang policy 3000"][..],
            &["one tick took 3000 ms. :hang policy 0 mends it"][..],
        ),
        (&["crash policy"], &[":restart policy mends it"]),
        (&["takes policy 85"], &[":takes policy none mends it"]),
        (
            &["link /obs loss:1"],
            &["lost 31 of 31. :link /obs none mends it"],
        ),
        (
            &["link /obs delay:120", "link /action delay:120"],
            &[" takes 120 of ", "and on /", ", too, mends it"],
        ),
        (
            &["crash sensor", "crash policy"],
            &[
                ":restart sensor alone is not enough",
                "policy crashed",
                ", too, mends it",
            ],
        ),
    ] {
        let lines = proven(setup).join("\n");
        for part in told {
            assert!(lines.contains(part), "{setup:?}: {part:?} in\n{lines}");
        }
    }
}
