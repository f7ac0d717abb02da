//! Policies that answer with chunks: `tests/golden/chunks.txt` holds runs of `chunks.py`, a second
//! implementation of every rule in `docs/slow-policies.md`.

use std::collections::HashMap;

use ratelab_cart_pole::chunk::{CHUNK, Chunk};
use ratelab_study::{
    experiment::{Experiment, Summary},
    system::FigureValue,
};

use crate::support::*;

/// The words of a command line, with blanks where they are quoted.
fn words(line: &str) -> Vec<&str> {
    let pieces = line.split('\'').enumerate();
    let words = pieces.flat_map(|(number, piece)| match number % 2 {
        0 => piece.split_whitespace().collect(),
        _ => vec![piece],
    });
    words.collect()
}

/// The configuration of a run as the command line has it.
fn asked(options: &str) -> Config {
    let (mut config, mut world, mut step_ms) = (Config::default(), "course", None);
    for option in words(options).chunks_exact(2) {
        let value = option[1];
        match option[0] {
            "--seed" => config.seed = value.parse().expect("a seed"),
            "--duration-s" => config.end = secs(value.parse().expect("seconds")),
            "--world" => world = value,
            "--world-step-ms" => step_ms = value.parse().ok(),
            "--knob" => config
                .setup
                .extend(CartPole::KNOBS.parse(value).expect(value)),
            alias => {
                let knob = format!("{} {value}", &alias[2..]);
                config
                    .setup
                    .extend(CartPole::KNOBS.parse(&knob).expect(&knob));
            }
        }
    }
    config.world = WorldKind::parse(world, step_ms).expect("a world");
    config
}

/// The figures of a topic: published, dropped, lost, overtaken, in flight.
fn of_topic(summary: &Summary, name: &str) -> String {
    let topic = summary.topic(name).expect(name);
    let figures = [
        topic.published,
        topic.dropped(),
        topic.lost,
        topic.overtaken,
        topic.in_flight(),
    ];
    figures.map(|figure| figure.to_string()).join(",")
}

/// All figures of a run by their names in the file.
fn figures(summary: &Summary) -> HashMap<&'static str, String> {
    let of_nodes = |kind| of_nodes(summary, kind, &["sensor", "policy", "player", "actuator"]);
    let own = summary.figures.iter().map(|figure| {
        let text = match figure.value {
            FigureValue::Count(count) => count.to_string(),
            FigureValue::Number(number) => number.map_or("none".to_owned(), |n| format!("{n:?}")),
        };
        (figure.name, text)
    });
    let counts = [
        ("verdict", golden_verdict(summary)),
        ("sim_time_ns", figure(summary, "end_ns")),
        ("steps", figure(summary, "steps")),
        ("obs", of_topic(summary, "/obs")),
        ("chunk", of_topic(summary, "/chunk")),
        ("action", of_topic(summary, "/action")),
        ("ticks", of_nodes("ticks")),
        ("overruns", of_nodes("overruns")),
    ];
    counts.into_iter().chain(own).collect()
}

/// The figures and the hash of a run.
fn run_chunks(config: &Config) -> (HashMap<&'static str, String>, String) {
    let experiment = experiment(config);
    let chunks = experiment.taps().messages::<Chunk>(CHUNK, 4_096);
    let chunks = chunks.expect("chunks");
    let (run, chunks) = std::thread::scope(|scope| {
        let chunks = scope.spawn(|| messages_of(&chunks));
        (collect(experiment), chunks.join().expect("collected"))
    });
    let chunks = chunks.iter().flat_map(|message| {
        let actions = message.data.actions.iter();
        let payload: Vec<u8> = actions.flat_map(|action| action.to_le_bytes()).collect();
        stamped(message, &payload)
    });
    let bytes: Vec<u8> = message_bytes(&run.observations, &[], &[])
        .into_iter()
        .chain(chunks)
        .chain(message_bytes(&[], &run.actions, &run.steps))
        .collect();
    (figures(&run.summary), format!("{:016x}", fnv1a64(&bytes)))
}

#[test]
fn every_reference_run_with_chunks_is_reproduced_to_the_bit() {
    let mut runs = 0;
    for block in &golden_blocks(include_str!("../golden/chunks.txt"), "RATELAB_CHUNKS") {
        let line = |kind: &str| {
            let mut lines = block.lines();
            lines.find_map(|line| line.strip_prefix(kind)).expect(kind)
        };
        let mut config = asked(line("run "));
        if config.setup.parameter("policy", "chunk").is_none() {
            continue; // Runs without chunks are in `golden.rs`.
        }
        let knobs = block.lines().filter_map(|line| line.strip_prefix("knob "));
        let knobs: Vec<&str> = knobs.collect();
        config.knobs = CartPole::KNOBS.parse_list(&knobs.join("\n")).expect(block);
        let (found, hash) = run_chunks(&config);
        let expected = [line("got "), line("chunks ")];
        for word in expected.iter().flat_map(|line| line.split_whitespace()) {
            let (key, value) = word.split_once('=').expect("a figure");
            if let Some(found) = found.get(key) {
                assert_eq!(found, value, "{key} of\n{block}");
            }
        }
        assert_eq!(hash, line("fnv1a64="), "{block}");
        runs += 1;
    }
    assert!(runs >= 60, "only {runs} reference runs were found");
}

/// Answers with a chunk of its own, and with another action if it is asked for one.
struct OwnChunks;

impl Policy for OwnChunks {
    fn name(&self) -> &str {
        "own chunks"
    }

    fn act(&mut self, _: &Observation) -> Action {
        Action(-0.5)
    }

    fn chunk_from(&mut self, _: &Observation) -> Option<Vec<f32>> {
        Some(vec![0.25, 0.5, 0.75, 1.0])
    }
}

#[test]
fn a_chunk_of_the_policys_own_begins_when_its_answer_is_expected() {
    let cases = [
        ("hold", [-0.5; 4]),
        ("rollout", [0.25, 0.5, 0.75, 1.0]),
        ("committed", [0.0, 0.0, 0.25, 0.5]),
    ];
    for (plan, actions) in cases {
        let system = Arc::new(CartPole::with_policy(|_| Box::new(OwnChunks)));
        let config = config(&format!("chunk 4; plan {plan}; expect-delay 40"));
        let experiment = Experiment::new(system, &config).expect("experiment");
        let chunks = experiment.taps().messages::<Chunk>(CHUNK, 4_096);
        let chunks = chunks.expect("chunks");
        let first = std::thread::scope(|scope| {
            let chunks = scope.spawn(|| messages_of(&chunks));
            experiment.run().expect("run");
            chunks.join().expect("collected").swap_remove(0)
        });
        assert_eq!(*first.data.actions, actions, "{plan}");
    }
}
