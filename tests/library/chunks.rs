//! Policies that answer with chunks: `tests/golden/chunks.txt` holds runs of `chunks.py`, a second
//! implementation of every rule in `docs/slow-policies.md` and in `tests/golden/README.md`.

use std::collections::HashMap;

use crate::support::*;
use ratelab_cart_pole::chunk::{CHUNK, Chunk};

/// The words of a command line, with blanks where they are quoted.
fn words(line: &str) -> Vec<&str> {
    let pieces = line.split('\'').enumerate();
    let words = pieces.flat_map(|(number, piece)| match number % 2 {
        0 => piece.split_whitespace().collect(),
        _ => vec![piece],
    });
    words.collect()
}

/// The configuration of a run as the command line has it, with these timed knobs.
fn asked(options: &str, timed: &str) -> Config {
    let (mut settings, mut world, mut step_ms) = (timed.to_owned(), "course", None);
    for option in words(options).chunks_exact(2) {
        let value = option[1];
        match option[0] {
            "--world" => world = value,
            "--world-step-ms" => step_ms = value.parse().ok(),
            "--duration-s" => settings += &format!("; until {value}"),
            "--knob" => settings += &format!("; {value}"),
            alias => settings += &format!("; {} {value}", &alias[2..]),
        }
    }
    let world = WorldKind::parse(world, step_ms).expect("a world");
    Config {
        world,
        ..config(&settings)
    }
}

/// Figures of a run by their names in the file.
const FIGURES: [(&str, &str); 8] = [
    ("verdict", "ending"),
    ("sim_time_ns", "end_ns"),
    ("steps", "steps"),
    ("obs", "fates /obs"),
    ("chunk", "fates /chunk"),
    ("action", "fates /action"),
    ("ticks", "ticks sensor,policy,player,actuator"),
    ("overruns", "overruns sensor,policy,player,actuator"),
];

/// All figures of a run by their names in the file.
fn figures(summary: &Summary) -> HashMap<&'static str, String> {
    let own = summary.figures.iter().map(|figure| {
        let text = match figure.value {
            FigureValue::Count(count) => count.to_string(),
            FigureValue::Number(number) => number.map_or("none".to_owned(), |n| format!("{n:?}")),
        };
        (figure.name, text)
    });
    let known = FIGURES.map(|(key, name)| (key, figure(summary, name)));
    known.into_iter().chain(own).collect()
}

/// The figures and the hash of a run.
fn run_chunks(config: &Config) -> (HashMap<&'static str, String>, String) {
    let experiment = experiment(config);
    let chunks = experiment.taps().messages::<Chunk>(CHUNK, ROOM);
    let run = collect(experiment);
    let chunks = tapped(&chunks.expect("chunks"));
    let chunks = chunks.iter().flat_map(|message| {
        let actions = message.data.actions.iter();
        let payload: Vec<u8> = actions.flat_map(|action| action.to_le_bytes()).collect();
        stamped(message, &payload)
    });
    let bytes = run.bytes_with(&chunks.collect::<Vec<_>>());
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
        let knobs = block.lines().filter_map(|line| line.strip_prefix("knob "));
        let config = asked(line("run "), &knobs.collect::<Vec<_>>().join("; "));
        if config.setup.parameter("policy", "chunk").is_none() {
            continue; // Runs without chunks are in `golden.rs`.
        }
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
        let chunks = experiment.taps().messages::<Chunk>(CHUNK, ROOM);
        experiment.run().expect("run");
        let first = tapped(&chunks.expect("chunks")).swap_remove(0);
        assert_eq!(*first.data.actions, actions, "{plan}");
    }
}
