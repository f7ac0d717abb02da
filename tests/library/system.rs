//! A graph as a value: it is built according to its setup, or refused with the available
//! names, and a custom system runs and is swept like the cart-pole.

use std::{num::NonZeroUsize, ops::ControlFlow, thread};

use proptest::prelude::*;
use ratelab_study::experiment::sweep::{Axis, Sweep, SweepAxis, Swept};

use crate::{support::*, table::rows};

/// An oven after a step.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Step {
    /// Temperature (°C).
    temperature: f64,
    /// Share of full power.
    heat: f64,
}

impl Fields for Step {
    const FIELDS: &'static [&'static str] = &["temperature (°C)", "heat"];

    fn append_to(&self, row: &mut Vec<f64>) {
        row.extend([self.temperature, self.heat]);
    }

    fn from_row(row: &[f64]) -> Option<Self> {
        let &[temperature, heat] = row else {
            return None;
        };
        Some(Self { temperature, heat })
    }
}

/// Heats while the oven is colder than its target (°C).
struct Thermostat {
    steps: Subscription<Step>,
    heat: Publisher<f64>,
    target: f64,
}

impl Node for Thermostat {
    fn tick(&mut self, now: Time) -> Tick {
        if let Some(step) = self.steps.latest(now) {
            let heat = f64::from(u8::from(step.data.temperature < self.target));
            self.heat.publish(heat, now, Some(step.stamp));
        }
        GO_ON
    }

    fn on_message(&mut self, text: &str) -> Result<String, String> {
        let target = text.parse();
        let target = target.map_err(|_| format!("{text:?} is not a temperature"))?;
        Ok(std::mem::replace(&mut self.target, target).to_string())
    }
}

/// An oven that must stay below 100 °C. Its seed is the initial excess over 20 °C.
struct Oven;

const OVERHEATED: VerdictKind = VerdictKind {
    name: "overheated",
    lost: true,
    text: "OVERHEATED at {at}",
};

const fn alias(
    name: &'static str,
    knobs: &'static [(KnobKind, &'static str)],
    default: &'static str,
) -> Alias {
    let (choices, help): (&[_], _) = (&[], "");
    Alias {
        name,
        knobs,
        default,
        choices,
        help,
    }
}

const KNOBS: KnobText = KnobText(&[
    alias("thermostat-hz", &[(KnobKind::Rate, "thermostat")], "10"),
    alias("target", &[(KnobKind::Send, "thermostat")], "80"),
    alias(
        "queues",
        &[(KnobKind::Depth, "/step"), (KnobKind::Depth, "/heat")],
        "1",
    ),
]);

impl System for Oven {
    fn name(&self) -> &'static str {
        "oven"
    }

    fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
        let steps = builder.topic::<Step>("/step");
        let heat = builder.internal_topic::<f64>("/heat");
        let mut temperature = 20.0 + builder.seed() as f64;
        let (stepped, heated) = (steps.clone(), heat.clone());
        builder.node("oven", 20.0, 0, move |wiring| {
            let steps = wiring.publisher(&stepped);
            let mut heat = wiring.subscription(&heated);
            move |now| {
                let heat = heat.latest(now).map_or(0.0, |heat| heat.data);
                temperature += (60.0 * heat - (temperature - 20.0) / 5.0) / 20.0;
                steps.publish(Step { temperature, heat }, now, None);
                if temperature > 100.0 { END } else { GO_ON }
            }
        })?;
        builder.node("thermostat", 10.0, 1, move |wiring| Thermostat {
            steps: wiring.subscription(&steps),
            heat: wiring.publisher(&heat),
            target: 80.0,
        })
    }

    fn about(&self) -> About<'_> {
        About {
            aliases: KNOBS.0,
            ..About::default()
        }
    }

    fn state(&self) -> Option<&'static str> {
        Some("/step")
    }

    fn verdict(&self, exit: &ClockExit, at: Time, state: Option<&[f64]>) -> Verdict {
        match state.and_then(Step::from_row) {
            Some(step) if step.temperature > 100.0 => Verdict::new(&OVERHEATED, at),
            _ => Verdict::of_exit(exit, at),
        }
    }

    fn finals(&self, state: &[f64]) -> Vec<Final> {
        let (name, unit, value) = ("final_temperature", "°C", state[0]);
        vec![Final { name, unit, value }]
    }
}

/// Ten seconds of the oven with these knobs.
fn config(setup: &[&str]) -> Config {
    let knobs = setup.iter().map(|knob| KNOBS.parse(knob).expect(knob));
    Config {
        setup: knobs.flatten().collect(),
        ..Config::default()
    }
}

fn experiment(config: &Config) -> Experiment {
    Experiment::new(oven(), config).expect("experiment")
}

/// Runs the oven; returns its steps as well.
fn run(config: &Config) -> (Summary, Rows) {
    let experiment = experiment(config);
    let tap = experiment.taps().rows("/step", 4);
    let tap = tap.expect("a recorded topic");
    thread::scope(|scope| {
        let reader = scope.spawn(move || {
            let mut rows = tap.rows();
            while tap.wait(&mut rows) {}
            rows
        });
        let summary = experiment.run().expect("run");
        (summary, reader.join().expect("read"))
    })
}

fn oven() -> Arc<Oven> {
    Arc::new(Oven)
}

#[test]
fn a_custom_system_runs_and_gives_its_verdict() {
    let (summary, rows) = run(&Config::default());
    assert_eq!(summary.verdict.to_string(), "COMPLETED at 10.000 s");
    assert_eq!((summary.steps, rows.len()), (201, 201));
    assert_eq!(rows.last().map(|(_, row)| row), Some(&summary.state[..]));
    assert!((75.0..85.0).contains(&Oven.finals(&summary.state)[0].value));

    let (summary, rows) = run(&config(&["thermostat-hz 1"]));
    assert_eq!(*summary.verdict.kind, OVERHEATED);
    assert!(summary.verdict.is_lost() && summary.state[0] > 100.0);
    let (head, _) = rows.last().expect("steps");
    let last = (head.stamp, head.seq + 1);
    assert_eq!(last, (summary.sim_time, summary.steps));
}

#[test]
fn the_same_configuration_is_the_same_run_to_the_bit_and_another_seed_is_not() {
    let config = Config {
        knobs: KNOBS
            .parse_list("2 thermostat-hz 3\n4 target 60")
            .expect("knobs"),
        ..config(&["queues 3"])
    };
    let (_, rows) = run(&config);
    assert!(rows.len() > 100);
    assert_eq!(run(&config).1, rows);
    let other = Config { seed: 1, ..config };
    assert_ne!(run(&other).1, rows);
}

fn sweep(threads: usize) -> Swept {
    let axes = [("thermostat-hz", "1,2,10"), ("target", "60,80")];
    let axes = axes.map(|(name, list)| SweepAxis::parse(KNOBS, name, list).expect(name));
    let sweep = Sweep {
        axes: axes.into(),
        seeds: "0..4".parse::<Axis<u64>>().expect("seeds").into(),
        ..Sweep::of(oven(), Config::default())
    };
    let threads = NonZeroUsize::new(threads).expect("not zero");
    let swept = sweep.run(threads, |_, _| ControlFlow::Continue(()));
    swept.expect("a sweep")
}

#[test]
fn a_sweep_of_a_custom_system_equals_its_runs_on_any_number_of_threads() {
    let alone = sweep(1);
    assert!(alone.finished().eq(sweep(4).finished()));
    let mut lost = 0;
    for (cell, result) in alone.finished() {
        let (summary, _) = run(&alone.sweep().config(&cell));
        assert_eq!(result.verdict, summary.verdict, "{cell}");
        assert_eq!(*result.state, summary.state, "{cell}");
        lost += usize::from(result.verdict.is_lost());
    }
    assert_eq!(alone.finished().count(), 3 * 2 * 5);
    assert!((1..30).contains(&lost), "{lost}");
}

#[test]
fn a_graph_begins_with_its_setup_and_the_systems_defaults() {
    let setup = ["rate oven 40", "queues 7", "target 60"];
    let experiment = experiment(&config(&setup));
    let snapshot = experiment.observer().snapshot();
    let rates = snapshot.nodes.iter().map(|node| node.hz);
    assert_eq!(rates.collect::<Vec<_>>(), [hz(40.0), hz(10.0)]);
    let depths = snapshot.topics.iter().map(|topic| topic.depth.get());
    assert_eq!(depths.collect::<Vec<_>>(), [7, 7]);
    let summary = experiment.run().expect("run");
    let state = summary.state;
    assert!((55.0..65.0).contains(&state[0]), "{state:?}");
    assert_eq!(summary.events, [], "a setup is no event of the run");
}

#[test]
fn only_topics_with_fields_are_recorded() {
    let taps = experiment(&Config::default()).taps();
    let topics = taps.topics().iter().map(|topic| topic.name());
    assert_eq!(topics.collect::<Vec<_>>(), ["/step"]);
    assert!(taps.rows("/heat", 1).is_none());
    assert!(taps.messages::<Step>("/step", 1).is_some());
    assert!(taps.messages::<f64>("/step", 1).is_none());
}

#[test]
fn a_knob_that_the_graph_refuses_fails_the_build_with_the_reason() {
    for [knob, reason] in rows(
        "rate planner 5       | there is no node \"planner\": expected one of oven, thermostat
         depth /map 2         | there is no topic \"/map\": expected one of /step, /heat
         send planner stop    | there is no node \"planner\": expected one of oven, thermostat
         send thermostat hot  | \"hot\" is not a temperature
         send oven open       | this node takes no orders",
    ) {
        let expected = format!("{knob}: {reason}");
        assert_eq!(refusal_of(oven(), &config(&[&knob])), expected);
        if reason.starts_with("there is no") {
            let timed = Config {
                knobs: KNOBS.parse_list(&format!("3 {knob}")).expect(&knob),
                ..Config::default()
            };
            assert_eq!(refusal_of(oven(), &timed), expected);
        }
    }
}

#[test]
fn an_alias_has_its_set_value_or_its_default() {
    let value = |name: &str, setup: &[&str]| {
        let alias = KNOBS.alias(name).expect(name);
        alias.value(&config(setup).setup)
    };
    assert_eq!(value("thermostat-hz", &[]), "10");
    assert_eq!(value("thermostat_hz", &["rate thermostat 2.5"]), "2.5");
    assert_eq!(value("queues", &["depth /step 3", "depth /heat 4"]), "3");
    assert_eq!(value("target", &["target 60", "send thermostat 70"]), "70");
    assert_eq!(KNOBS.alias("planner-hz"), None);
}

fn any_knob() -> impl Strategy<Value = Knob> {
    let (name, value) = (prop::sample::select(vec!["a", "b", "c"]), 1..9u8);
    let kind = prop::sample::select(vec!["rate", "depth", "send"]);
    (kind, name, value).prop_map(|(kind, name, value)| knob(&format!("{kind} {name} {value}")))
}

proptest! {
    #[test]
    fn a_setup_has_the_last_setting_of_everything_in_the_order_of_the_first(
        knobs in proptest::collection::vec(any_knob(), 0..20),
    ) {
        let setup: Setup = knobs.iter().cloned().collect();
        let mut expected: Vec<Knob> = Vec::new();
        for knob in &knobs {
            if !expected.iter().any(|known| known.is_of(knob)) {
                let last = knobs.iter().rfind(|last| last.is_of(knob));
                expected.extend(last.cloned());
            }
        }
        prop_assert!(setup.iter().eq(&expected), "{:?}", setup);
        let one_by_one = knobs.into_iter().fold(Setup::default(), Setup::with);
        prop_assert_eq!(&one_by_one, &setup);
        for knob in &expected {
            let set = match knob {
                Knob::Rate { node, .. } => setup.rate(node).map(|hz| hz.get().to_string()),
                Knob::Depth { topic, .. } => setup.depth(topic).map(|depth| depth.to_string()),
                Knob::Send { node, .. } => setup.message(node).map(str::to_owned),
                _ => continue,
            };
            prop_assert_eq!(set, Some(knob.value()));
        }
        prop_assert_eq!(setup.rate("d"), None);
    }
}

#[test]
fn a_resolved_setup_keeps_its_order() {
    // A crash clears a hang that was set before it, and none that is set after it.
    let texts = ["crash actuator", "hang actuator 300", "rate policy 20"];
    let config = Config {
        setup: texts.map(knob).into_iter().collect(),
        ..Config::default()
    };
    let resolved = config.resolved(&*cart_pole()).expect("a config");
    let kept = resolved.setup.iter().map(Knob::to_string);
    let kept: Vec<String> = kept.filter(|knob| texts.contains(&&**knob)).collect();
    assert_eq!(kept, texts);
}

#[test]
fn a_message_used_to_build_a_node_is_not_sent_to_it() {
    // It takes none after it is built.
    let clock = || {
        system(|builder| {
            let alarm = builder.message("clock").unwrap_or("9").parse();
            let alarm = alarm.map_err(|_| BuildError::Setting("no time".to_owned()))?;
            builder.node("clock", 10.0, 0, move |_| {
                move |now| if now < secs(alarm) { GO_ON } else { END }
            })
        })
    };
    let summary = run_of(clock(), &config(&["send clock 2"]));
    assert_eq!(summary.verdict.to_string(), "ENDED at 2.000 s (by a node)");
    assert_eq!((summary.steps, &summary.state[..]), (0, &[][..]));
    let noon = config(&["send clock noon"]);
    assert_eq!(refusal_of(clock(), &noon), "no time");
}

#[test]
fn a_graph_of_the_library_runs_with_its_settings_and_is_recorded() {
    let wire = |builder: &mut Builder<'_>| {
        let steps = Topic::new("/step", depth(1));
        builder.record(&steps);
        let graph = builder.graph();
        talker(graph, "oven", 10.0, 0, &steps, |now| {
            let (temperature, heat) = (now.as_secs_f64(), 0.0);
            Some(Step { temperature, heat })
        });
        reader(graph, "thermostat", 1.0, 1, &steps);
        Ok(())
    };
    let library = system(wire);
    let config = config(&["rate thermostat 2", "depth /step 3", "takes oven 5"]);
    let experiment = Experiment::new(library.clone(), &config).expect("experiment");
    assert!(experiment.taps().rows("/step", 4).is_some());
    let summary = experiment.run().expect("run");
    // The message of the last tick would come after the end.
    check(
        "library",
        &summary,
        "published /step 100; ticks thermostat 21",
    );
    let oven = summary.node("oven").expect("a node");
    assert!(oven.tick_time.count() > 90);
    // Five messages between two ticks, three of which are kept.
    let dropped = summary.topic("/step").expect("a topic").dropped();
    assert!((30..50).contains(&dropped), "{dropped}");
    let part = Experiment::part(library, &config, &["oven".to_owned()]);
    let refused = part.err().expect("no experiment").to_string();
    assert!(refused.contains("one process"), "{refused}");
}
