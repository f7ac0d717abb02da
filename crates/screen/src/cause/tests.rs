//! Ways to lose the pole: each has its cause named, and the named cure works.

use std::{sync::Arc, time::Duration};

use ratelab::{Head, Knob, KnobKind, MessageId, TickId, TickTiming, Time, TimeSpan, TimedKnob};
use ratelab_cart_pole::CartPole;
use ratelab_experiment::{
    Config, Experiment, Summary,
    cause::{AgeData, AgeOwner, Facts, Hang, Strain, Trial, Tried, latest},
};
use ratelab_metrics::{Lineage, Snapshot, TickCauses, TickRecord, TopicRead, mean_parts};
use ratelab_system::{AgeLimits, Setup, System, acting_node};

use super::told;
use crate::{
    knobs::RATE_KEYS,
    lineage_taps::LineageTaps,
    tests::{
        kit::{config, rows},
        sample::{self, head},
    },
};

/// Ways to lose the pole, and the owners of the age.
const WAYS: &str = "\
rate policy 5 | Rate policy
rate policy 5; depth /obs 100; depth /action 100 | Rate policy
own; rate policy 5 | Rate policy
rate sensor 5 | Rate sensor
own; rate sensor 4; depth /obs 100 | Rate sensor
own; rate sensor 5; rate policy 5 | Rate sensor; Rate policy
own; rate actuator 5 | Rate actuator
own; takes policy 70 | Cost policy
own; takes policy 60..110 | Cost policy
own; takes sensor 90 | Cost sensor
own; takes actuator 80 | Cost actuator
own; wakes policy 190 | Late policy
own; rate policy 8; offset policy 100; rate sensor 8 | Phase policy
own; link /obs delay:100 | Link /obs
own; link /action delay:100 | Link /action
own; link /action delay:0..250 | Link /action
own; link /action loss:0.9 | Link /action
own; link /obs loss:0.92 | Link /obs
own; link /obs burst:0.05,30 | Link /obs
own; link /action loss:0.3,reliable:150 | Link /action
rate policy 45; read /obs oldest; depth /obs 10 | Queue /obs
own; rate policy 10; clock policy 0 -500000 | Clock policy
own; 1.0 crash policy | Crash policy
own; 1.0 crash sensor | Crash sensor
own; 0.1 hang policy 900 | Hang policy
own; 0.1 hang sensor 900 | Hang sensor
own; 0.0 crash policy | Crash policy
own; 0.0 crash sensor | Crash sensor
own; hang policy 900 | Hang policy
own; link /obs loss:1 | Link /obs
own; 0.1 rate policy 4; 0.6 rate policy 50 | Rate policy";

/// Returns a run of twelve seconds.
fn way(run: &str) -> Config {
    config(&format!("until 12; {run}"))
}

fn knob(text: &str) -> Knob {
    text.parse().expect(text)
}

/// Returns the summary of a run, and the lines about its loss with the owners that they name.
fn lost(config: &Config) -> (Summary, Vec<String>, Vec<String>) {
    let played = Played::play(config);
    let (cause, named) = cause(&played.graph, &played.lineage, &played.setup());
    (played.summary, cause, named)
}

/// Returns the lines about a loss at the moment of `graph`, and its owners, such as `Rate policy`.
fn cause(graph: &Snapshot, lineage: &Lineage, setup: &Setup) -> (Vec<String>, Vec<String>) {
    with_facts(graph, lineage, (setup, &[]), |facts| {
        let acts = acting_node(facts.system, lineage.topology())
            .filter(|_| facts.system.judge().lost_anyway(setup).is_none());
        let owners = acts.map(|acts| facts.main_owners(acts)).unwrap_or_default();
        let name = |owner: AgeOwner| {
            let text = format!("{owner:?}");
            let names = text.split('(').map(|name| name.trim_end_matches(')'));
            let kind = names.rev().find(|name| name.parse::<usize>().is_err());
            format!("{} {}", kind.expect("a name"), facts.name(owner))
        };
        (
            said(&facts, None, false),
            owners.into_iter().map(name).collect(),
        )
    })
}

/// Returns the lines about a loss, once its cures were `tried`.
fn said(facts: &Facts<'_>, tried: Option<&Tried>, live: bool) -> Vec<String> {
    let lines = facts.cause(tried).into_iter();
    lines.map(|line| told(line, live)).collect()
}

/// Returns what `read` reads from the facts about a loss at the moment of `graph`, with a setup in
/// force and knobs that were turned.
fn with_facts<R>(
    graph: &Snapshot,
    lineage: &Lineage,
    (setup, commands): (&Setup, &[TimedKnob]),
    read: impl FnOnce(Facts<'_>) -> R,
) -> R {
    let system = CartPole::default();
    let acts = acting_node(&system, lineage.topology()).expect("an actuator");
    let late = latest(graph, lineage, acts);
    read(Facts {
        system: &system,
        setup,
        commands,
        lost: true,
        graph,
        lineage,
        age: age(lineage, acts, late, system.judge().age_limits(setup)),
        late,
        hangs: &Hang::at_the_start(setup),
        plan: None,
        stepped_rates: RATE_KEYS.len(),
    })
}

/// A run that is over, with its chains and all knobs, those of the start first.
struct Played {
    summary: Summary,
    graph: Snapshot,
    lineage: Lineage,
    knobs: Vec<TimedKnob>,
}

impl Played {
    fn play(config: &Config) -> Self {
        let system: Arc<dyn System> = Arc::new(CartPole::default());
        let experiment = Experiment::new(system, config).expect("a graph");
        let (observer, mut taps) = (experiment.observer(), LineageTaps::new(&experiment));
        let summary = experiment.run().expect("no fault");
        let at = Time::ZERO;
        let start = config
            .setup
            .iter()
            .cloned()
            .map(|knob| TimedKnob { at, knob });
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

    /// Returns whether the push age ever warned before its end.
    fn warned(&self) -> bool {
        const STEP: Duration = Duration::from_millis(20);
        let system = CartPole::default();
        let acts = acting_node(&system, self.lineage.topology()).expect("an actuator");
        let (mut now, mut setup) = (Time::ZERO + STEP, None);
        let mut limits = AgeLimits::default();
        while now < self.summary.verdict.at {
            let so_far = self.knobs.iter().filter(|timed| timed.at <= now);
            let in_force: Setup = so_far.map(|timed| timed.knob.clone()).collect();
            if setup.as_ref() != Some(&in_force) {
                limits = system.judge().age_limits(&in_force);
                setup = Some(in_force);
            }
            let graph = Snapshot {
                now,
                ..self.graph.clone()
            };
            let late = latest(&graph, &self.lineage, acts);
            let age = age(&self.lineage, acts, late, limits);
            if age.is_some_and(|age| !matches!(age.strain(), Strain::Unknown | Strain::Borne)) {
                return true;
            }
            now = now + STEP;
        }
        false
    }
}

/// Returns the push age over run time `late`.
fn age(lineage: &Lineage, acts: usize, late: TimeSpan, limits: AgeLimits) -> Option<AgeData> {
    let parts = mean_parts(lineage, acts, late);
    let mean: f64 = parts.iter().map(|(_, ns)| ns).sum();
    let greatest = lineage.greatest_age(acts, late);
    (!parts.is_empty()).then(|| AgeData {
        mean: Duration::from_nanos(mean as u64),
        greatest,
        stretch: late,
        predicted: None,
        limits,
        hidden: false,
    })
}

/// The knobs that bring an owner about.
const CAUSED_BY: [(&str, &[KnobKind]); 9] = [
    ("Rate", &[KnobKind::Rate]),
    ("Cost", &[KnobKind::Takes]),
    ("Hang", &[KnobKind::Hang]),
    ("Late", &[KnobKind::Wakes]),
    ("Crash", &[KnobKind::Crash]),
    ("Clock", &[KnobKind::Clock]),
    ("Phase", &[KnobKind::Offset]),
    (
        "Link",
        &[KnobKind::Link, KnobKind::Lose, KnobKind::Postpone],
    ),
    ("Queue", &[KnobKind::Read]),
];

/// Returns whether one of the `named` owners is what `knob` brings about.
fn is_named(named: &[String], knob: &Knob) -> bool {
    CAUSED_BY.iter().any(|(owner, kinds)| {
        let name = format!("{owner} {}", knob.target());
        kinds.contains(&knob.kind()) && named.contains(&name)
    })
}

#[test]
fn whatever_sets_the_time_of_a_tick_is_a_cause() {
    let timings = [TickTiming::Due, TickTiming::Start, TickTiming::Duration];
    for kind in KnobKind::ALL {
        let sets_time = timings.iter().any(|timing| kind.sets(*timing));
        let known = CAUSED_BY.iter().any(|(_, kinds)| kinds.contains(&kind));
        assert!(known || !sets_time, "{kind:?}");
    }
}

#[test]
fn the_cause_that_is_named_is_the_one_whose_removal_mends_it() {
    for [run, owners] in rows(WAYS) {
        let mut config = way(&run);
        let (summary, cause, named) = lost(&config);
        assert!(summary.verdict.is_lost(), "{run} stands");
        assert_eq!(named.join("; "), owners, "{run}: {cause:?}");
        let stays = |knob: &&Knob| !is_named(&named, knob);
        config.setup = config.setup.iter().filter(stays).cloned().collect();
        config.knobs.retain(|timed| stays(&&timed.knob));
        let verdict = lost(&config).0.verdict;
        assert!(!verdict.is_lost(), "{run} without {named:?}: {verdict}");
    }
}

#[test]
fn where_age_is_not_to_blame_no_node_is() {
    for policy in ["zero", "random"] {
        let (summary, cause, named) = lost(&way(&format!("send policy {policy}")));
        assert!(summary.verdict.is_lost(), "{policy}");
        assert!(named.is_empty(), "{policy}: {named:?}");
        let why = format!("the {policy} policy");
        assert!(cause[0].contains(&why), "{cause:?}");
    }
}

/// `patient` learned with pushes that are held. Half of each push is cut off here, so that
/// the motor is weaker than any that it met. Linear feedback bears that.
fn with_weak_motor(policy: &str) -> String {
    format!("own; rate actuator 500; send actuator zero:5; send policy {policy}")
}

#[test]
fn a_network_outside_of_its_training_is_to_blame_and_its_age_is_not() {
    let with = |policy: &str| lost(&way(&with_weak_motor(policy)));
    let (summary, cause, named) = with(&network());
    assert!(summary.verdict.is_lost());
    assert!(named.is_empty(), "{named:?}");
    let text = "age is not to blame (10 ms of 96–106): policy patient.safetensors does not hold it";
    assert_eq!(cause, [text]);
    for linear in ["scripted", "lqr"] {
        assert!(!with(linear).0.verdict.is_lost(), "{linear}");
    }
}

/// Returns the shipped network `patient` with the digest of its content.
fn network() -> String {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../policies/patient.safetensors"
    );
    let setup = Setup::default();
    let pinned = CartPole::default()
        .knobs()
        .resolve(0, &setup, "policy", path);
    pinned.expect("weights")
}

/// Returns a policy at 50 Hz whose ticks take 85 ms, as the real clock measures it: a tick acts at
/// its start, and four of five periods are overruns.
fn overrunning() -> (Snapshot, Lineage) {
    let system: Arc<dyn System> = Arc::new(CartPole::default());
    let experiment = Experiment::new(system, &Config::default()).expect("a graph");
    let observer = experiment.observer();
    let (mut graph, topology) = (observer.snapshot(), observer.topology());
    let mut lineage = Lineage::new(topology, &[]);
    let [sensor, policy, actuator] = [0, 1, 2];
    let [observations, actions] = [0, 1];
    let by = |node, number| Some(TickId { node, number });
    let read = |topic, seq| TickCauses {
        reads: [TopicRead {
            message: MessageId { topic, seq },
            reader: 0,
            newest: seq,
        }]
        .into_iter()
        .collect(),
        completed: None,
    };
    for number in 0..150 {
        let at = sample::ms(20 * number);
        lineage.tick(sensor, tick(number, at, 0));
        let reading = head(number, at, None);
        lineage.message(
            observations,
            &Head {
                by: by(sensor, number),
                ..reading
            },
        );
        let decision = number / 5;
        if number % 5 == 0 {
            let decides = at + Time::RESOLUTION;
            let causes = read(observations, number);
            let decided = tick(decision, decides, 85);
            lineage.tick(policy, TickRecord { causes, ..decided });
            let by = by(policy, decision);
            let action = head(decision, decides, Some(at));
            lineage.message(actions, &Head { by, ..action });
        }
        let causes = read(actions, decision);
        let acted = tick(number, at + 2 * Time::RESOLUTION, 0);
        lineage.tick(actuator, TickRecord { causes, ..acted });
    }
    lineage.settle();
    graph.nodes[policy].overruns = 120;
    graph.now = sample::ms(3_000);
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
        causes: TickCauses::default(),
    }
}

#[test]
fn overruns_under_the_real_clock_are_blamed_on_the_long_ticks() {
    let (graph, lineage) = overrunning();
    let (by_itself, named) = cause(&graph, &lineage, &Setup::default());
    assert_eq!(named, ["Cost policy"]);
    let text = "age comes from the policy: its ticks take 85 % of the time and come every 100 \
                ms. try a faster one";
    assert_eq!(by_itself[0], text);
    let setup: Setup = [knob("takes policy 85")].into_iter().collect();
    let (by_knob, _) = cause(&graph, &lineage, &setup);
    let line = &by_knob[0];
    assert!(line.ends_with("try takes policy none"), "{line}");
}

#[test]
fn a_run_is_warned_before_it_falls_if_and_only_if_age_is_to_blame() {
    let weak = with_weak_motor(&network());
    let others = ["own; send policy zero", "own; send policy random", &weak]
        .map(|run| [run, ""].map(str::to_owned));
    for [run, owners] in rows(WAYS).chain(others) {
        let played = Played::play(&way(&run));
        let old = !owners.is_empty() && played.summary.push_age().is_some();
        assert!(played.summary.verdict.is_lost(), "{run}");
        assert_eq!(played.warned(), old, "{run}");
    }
}

#[test]
fn a_healthy_run_is_never_warned() {
    for policy in ["scripted", "lqr", &network()] {
        for world in ["", "own"] {
            let run = format!("{world}; seed 1; send policy {policy}");
            assert!(!Played::play(&way(&run)).warned(), "{run}");
        }
    }
}

#[test]
fn a_run_that_was_rescued_was_warned() {
    // As in recordings/rescued.rrd.
    let run = "0.995434574 control-hz 5; 2.116662647 control-hz 25";
    let played = Played::play(&way(run));
    assert!(!played.summary.verdict.is_lost());
    assert!(played.warned());
}

#[test]
fn a_slow_lqr_leaves_the_rail_with_the_pole_up_and_its_rate_is_named() {
    let (summary, _, named) = lost(&way("seed 1; send policy lqr; rate policy 0.5"));
    assert_eq!(summary.verdict.name(), "cart_left_rail");
    assert_eq!(named, ["Rate policy"]);
}

/// Expected to lose the pole, and does not.
#[test]
fn these_troubles_it_bears() {
    for [knobs] in rows(
        "clock policy 5 40
         takes policy 30
         link /obs loss:0.5
         link /action delay:0..60
         rate policy 49; depth /obs 10
         rate actuator 12",
    ) {
        let (summary, ..) = lost(&way(&format!("own; {knobs}")));
        assert!(!summary.verdict.is_lost(), "{knobs}: {}", summary.verdict);
    }
}

#[test]
fn a_knob_that_was_turned_too_late_is_no_advice() {
    for [setup, later, cure] in rows(
        "takes policy 230 | takes policy 0 | takes policy none came too late
         link /action delay:200 | link /action none | link /action none came too late
         rate policy 4 | rate policy 50 | control-hz was raised too late",
    ) {
        let mut config = way(&format!("own; {setup}"));
        let fell = Played::play(&config).summary.verdict.at;
        // As it falls: nothing is saved any more.
        config.knobs = vec![TimedKnob {
            at: Time::ZERO + fell.since(Time::ZERO + Duration::from_millis(20)),
            knob: knob(&later),
        }];
        let played = Played::play(&config);
        assert!(played.summary.verdict.is_lost(), "{setup}");
        let knobs = (&played.setup(), &config.knobs[..]);
        let lines = with_facts(&played.graph, &played.lineage, knobs, |facts| {
            said(&facts, None, false)
        });
        assert!(lines[0].ends_with(&cure), "{setup}: {lines:?}");
    }
}

#[test]
fn a_rate_that_came_back_in_time_is_told_as_it_is_now_and_not_as_too_late() {
    for [run, told] in rows(
        "until 2.42; 1.4 rate policy 5; 2.4 rate policy 50 | /action: the policy decides every \
             20 ms, only since 2.400 s. control-hz was raised: the age falls now
         until 1.9; 1.4 rate policy 5 | /action: the policy decides every 200 ms, since 1.400 s. \
             raise control-hz",
    ) {
        let config = config(&run);
        let played = Played::play(&config);
        assert!(!played.summary.verdict.is_lost(), "{run}");
        let knobs = (&played.setup(), &config.knobs[..]);
        let lines = with_facts(&played.graph, &played.lineage, knobs, |facts| {
            let facts = Facts {
                lost: false,
                ..facts
            };
            said(&facts, None, false)
        });
        assert_eq!(lines[0], format!("age comes from {told}"), "{run}");
    }
}

/// Returns the lines about a run that begins with `setup`, once its cures were tried.
fn proven(setup: &str) -> Vec<String> {
    let config = way(&format!("own; {setup}"));
    let played = Played::play(&config);
    assert!(played.summary.verdict.is_lost(), "{setup}");
    let system: Arc<dyn System> = Arc::new(CartPole::default());
    let trial = Trial::new(system, &config, config.setup.clone(), played.graph.now);
    let knobs = (&config.setup, &[][..]);
    with_facts(&played.graph, &played.lineage, knobs, |facts| {
        let untried = said(&facts, None, true);
        assert!(!untried.join(" ").contains("fixes"), "{untried:?}");
        said(&facts, trial.run(&facts.cures()).as_ref(), true)
    })
}

#[test]
fn only_what_was_tried_is_said_to_mend_it_and_what_is_not_enough_is_named_with_its_share() {
    for [setup, told] in rows(
        "hang policy 3000 | one tick took 3000 ms. :hang policy 0 fixes it
         crash policy | :restart policy fixes it
         takes policy 85 | :takes policy none fixes it
         link /obs loss:1 | lost 31 of 31. :link /obs none fixes it
         link /obs delay:120; link /action delay:120 | takes 120 of ; and from /; , too, fixes it
         crash sensor; crash policy | :restart sensor alone is not enough; policy crashed; , too, \
             fixes it",
    ) {
        let lines = proven(&setup).join("\n");
        for part in told.split("; ") {
            assert!(lines.contains(part), "{setup}: {part:?} in\n{lines}");
        }
    }
}
