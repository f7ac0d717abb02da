//! Runs in which ticks take time and the world does not wait, compared with an
//! independent reference, byte for byte: `tests/golden/honest.py` is a second
//! implementation of every rule in `docs/time.md`.

use std::{collections::HashMap, sync::Arc};

use ratelab::{Message, Payload, Time};
use ratelab_account::{PushAgeView, Tap, TapMessage};
use ratelab_cart_pole::{ACTION, Action, CartPole, ControlStep, OBS, Observation, STATE};
use ratelab_study::{
    experiment::{Config, Experiment, Summary},
    system::WorldKind,
};

use crate::support::traffic;

const RUNS: &str = include_str!("../golden/honest.txt");

/// More messages than any of these runs has.
const CAPACITY: usize = 20_000;

type Fields<'a> = HashMap<&'a str, &'a str>;

fn fields(words: &str) -> Fields<'_> {
    let words = words.split_whitespace();
    words.filter_map(|word| word.split_once('=')).collect()
}

/// A reference run: its configuration and its results.
#[derive(Default)]
struct Reference<'a> {
    config: Config,
    got: Fields<'a>,
    hash: &'a str,
}

impl<'a> Reference<'a> {
    fn read(block: &'a str) -> Self {
        let mut reference = Self::default();
        for line in block.lines() {
            let (kind, rest) = line.split_once([' ', '=']).expect("a line");
            let config = &mut reference.config;
            let knobs = CartPole::KNOBS;
            match kind {
                "run" => *config = run(&fields(rest)),
                "setup" => config.setup.extend(knobs.parse(rest).expect("a knob")),
                "knob" => config
                    .knobs
                    .extend(knobs.parse_timed(rest).expect("a knob")),
                "got" => reference.got = fields(rest),
                "fnv1a64" => reference.hash = rest,
                other => panic!("{other:?} begins no line"),
            }
        }
        reference
    }
}

fn run(fields: &Fields<'_>) -> Config {
    let step_ms = fields.get("step_ms").map(|ms| ms.parse().expect("number"));
    let depth = format!("queue-depth {}", fields["depth"]);
    let seconds = fields["duration_s"].parse().expect("number");
    Config {
        seed: fields["seed"].parse().expect("number"),
        world: WorldKind::parse(fields["world"], step_ms).expect("a world"),
        end: Time::from_secs_f64(seconds).expect("a time"),
        ..CartPole::config(&depth).expect("a depth")
    }
}

/// All messages of a run as bytes, and its summary.
struct Run {
    summary: Summary,
    bytes: Vec<u8>,
    push_age: Option<PushAgeView>,
    steps: Vec<Message<ControlStep>>,
}

impl Run {
    fn of(config: &Config) -> Self {
        let system = Arc::new(CartPole::default());
        let experiment = Experiment::new(system, config).expect("an experiment");
        let (taps, observer) = (experiment.taps(), experiment.observer());
        let observations = taps
            .messages::<Observation>(OBS, CAPACITY)
            .expect("a topic");
        let actions = taps.messages::<Action>(ACTION, CAPACITY).expect("a topic");
        let steps = taps
            .messages::<ControlStep>(STATE, CAPACITY)
            .expect("a topic");
        let summary = experiment.run().expect("a run");
        let mut bytes = Vec::new();
        for message in messages(&observations) {
            bytes.extend(head(&message));
            bytes.extend(message.data.to_array().map(f32::to_le_bytes).as_flattened());
        }
        for message in messages(&actions) {
            bytes.extend(head(&message));
            bytes.extend(message.data.0.to_le_bytes());
        }
        let steps = messages(&steps);
        for message in &steps {
            bytes.extend(head(message));
            bytes.extend(step_bytes(&message.data));
        }
        let node = observer.snapshot().node("actuator").cloned();
        Self {
            summary,
            bytes,
            push_age: node.expect("an actuator").push_age,
            steps,
        }
    }
}

fn messages<T: Payload>(tap: &Tap<TapMessage<T>>) -> Vec<Message<T>> {
    assert_eq!(tap.lost(), 0);
    tap.items()
        .try_iter()
        .map(|tapped| tapped.message)
        .collect()
}

fn head<T>(message: &Message<T>) -> Vec<u8> {
    let origin = message.origin.map_or(u64::MAX, Time::as_nanos);
    let head = [message.stamp.as_nanos(), message.seq, origin];
    head.map(u64::to_le_bytes).as_flattened().to_vec()
}

fn step_bytes(step: &ControlStep) -> Vec<u8> {
    let latency = step.latency.map_or(-1, |latency| latency.as_nanos() as i64);
    let mut bytes = step.step.to_le_bytes().to_vec();
    let observation = step.observation.to_array().map(f32::to_le_bytes);
    bytes.extend(observation.as_flattened());
    bytes.extend(step.action.0.to_le_bytes());
    bytes.extend(latency.to_le_bytes());
    bytes.extend(step.qpos.map(f64::to_le_bytes).as_flattened());
    bytes.extend(step.qvel.map(f64::to_le_bytes).as_flattened());
    bytes
}

fn fnv1a64(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

/// The results of a run, in the terms of the reference.
fn got(run: &Run) -> Vec<(&'static str, String)> {
    let Run {
        summary, push_age, ..
    } = run;
    let robot = ["sensor", "policy", "actuator"];
    let of_nodes = |figure: fn(&ratelab_account::NodeView) -> u64| {
        let nodes = robot.map(|name| figure(summary.node(name).expect("a node")).to_string());
        nodes.join(",")
    };
    let verdict = match summary.verdict.name() {
        "pole_fell" => "fell",
        other => other,
    };
    let first = push_age.map(|age| age.first.as_nanos().to_string());
    let own = [
        ("push_first_ns", first.unwrap_or_else(|| "none".to_owned())),
        ("ticks", of_nodes(|node| node.ticks)),
        ("overruns", of_nodes(|node| node.overruns)),
        (
            "spent_ns",
            of_nodes(|node| node.tick_time.sum().as_nanos() as u64),
        ),
        ("verdict", verdict.to_owned()),
        ("sim_time_ns", summary.sim_time.as_nanos().to_string()),
    ];
    traffic(summary).into_iter().chain(own).collect()
}

/// The effect of a link on the messages of a topic.
fn on_the_way(run: &Run, topic: &str) -> String {
    let topic = run.summary.topic(topic);
    format!("{},{},{}", topic.lost, topic.overtaken, topic.in_flight)
}

#[test]
fn every_reference_run_is_reproduced_to_the_bit() {
    let more = std::env::var_os("RATELAB_HONEST");
    let more = more.map(|path| std::fs::read_to_string(path).expect("more runs"));
    let mut runs = 0;
    let blocks = RUNS.trim().split("\n\n");
    for block in blocks.chain(more.iter().flat_map(|more| more.trim().split("\n\n"))) {
        let reference = Reference::read(block);
        let run = Run::of(&reference.config);
        for (key, value) in got(&run) {
            assert_eq!(value, reference.got[key], "{key} of\n{block}");
        }
        for (key, topic) in [("obs_way", OBS), ("action_way", ACTION)] {
            let way = reference.got.get(key).copied().unwrap_or("0,0,0");
            assert_eq!(on_the_way(&run, topic), way, "{key} of\n{block}");
        }
        let area = run.push_age.map_or(0.0, |age| age.area_s2);
        let twice: f64 = reference.got["push_area"].parse().expect("number");
        assert!((area * 2e18 - twice).abs() <= 1e-9 * twice, "{block}");
        let hash = format!("{:016x}", fnv1a64(&run.bytes));
        assert_eq!(hash, reference.hash, "{block}");
        runs += 1;
    }
    assert!(runs >= 90, "only {runs} reference runs were found");
}

#[test]
fn with_the_course_s_step_both_worlds_are_one_to_the_policy() {
    for (seed, control_hz, common) in [(0, 50, 500), (1, 25, 500), (2, 10, 500), (3, 5, 23)] {
        let config = CartPole::config(&format!("control-hz {control_hz}")).expect("a rate");
        let course = Run::of(&Config {
            seed,
            ..config.clone()
        });
        let own = Run::of(&Config {
            seed,
            world: WorldKind::parse("own", Some(10)).expect("a world"),
            ..config
        });
        let rows = |run: &Run| -> Vec<_> {
            let rows = run.steps.iter().map(|step| {
                let step = &step.data;
                (step.step, step.action.0, step.qpos, step.qvel)
            });
            rows.take(common).collect()
        };
        assert_eq!(own.steps.len(), common, "seed {seed}");
        assert_eq!(rows(&own), rows(&course), "seed {seed}");
    }
}
