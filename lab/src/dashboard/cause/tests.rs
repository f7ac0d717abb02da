//! Ways to lose the pole: each has its cause named, and the named cure works.

use std::sync::Arc;

use ratelab::{
    cartpole::CartPole,
    experiment::{Config, Experiment, Summary},
    runtime::{Knob, Snapshot, Time, TimedKnob},
    system::{AgeLimits, Setup, System, WorldKind},
};

use super::*;
use crate::dashboard::lineage_taps::LineageTaps;

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
const WAYS: [Way; 25] = [
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
    fault(&[(0.1, "hang policy 900")], &["Cost policy"]),
];

fn knob(text: &str) -> Knob {
    text.parse().expect(text)
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
    let system: Arc<dyn System> = Arc::new(CartPole::default());
    let experiment = Experiment::new(system.clone(), config).expect("a graph");
    let (observer, mut taps) = (experiment.observer(), LineageTaps::new(&experiment));
    let summary = experiment.run().expect("no fault");
    let (graph, lineage) = (observer.snapshot(), taps.update());
    let mut setup: Setup = config.setup.clone();
    setup.extend(summary.knobs().into_iter().map(|timed| timed.knob));
    let acts = acting(&*system, &graph).expect("an actuator");
    let late = latest(&graph, lineage, acts);
    let facts = Facts {
        system: &*system,
        setup: &setup,
        graph: &graph,
        lineage,
        age: age(lineage, acts, late, system.age_limits(&setup)),
        late,
        live: false,
    };
    let cause = facts.cause();
    (summary, graph, cause)
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
        limits,
    })
}

/// Whether undoing `knob` is the cure.
fn is_mended_by(owner: Owner, knob: &Knob, graph: &Snapshot) -> bool {
    let node = |index: usize| *graph.nodes[index].name == *knob.target();
    let topic = |index: usize| *graph.topics[index].name == *knob.target();
    match owner {
        Owner::Rate(index) => node(index) && matches!(knob, Knob::Rate { .. }),
        Owner::Cost(index) => node(index) && matches!(knob, Knob::Takes { .. } | Knob::Hang { .. }),
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
    }
}

fn names(owners: &[Owner], graph: &Snapshot) -> Vec<String> {
    let node = |what: &str, index: usize| format!("{what} {}", graph.nodes[index].name);
    let topic = |what: &str, index: usize| format!("{what} {}", graph.topics[index].name);
    let name = |owner: &Owner| match *owner {
        Owner::Rate(index) => node("Rate", index),
        Owner::Cost(index) => node("Cost", index),
        Owner::Late(index) => node("Late", index),
        Owner::Crash(index) => node("Crash", index),
        Owner::Clock(index) => node("Clock", index),
        Owner::Phase(index) => node("Phase", index),
        Owner::Link(index) => topic("Link", index),
        Owner::Order(index) => topic("Order", index),
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
