//! The virtual clock reproduces an independent reference, byte for byte.
//!
//! `tests/golden/` holds runs of a Python implementation over the same MuJoCo. Every
//! observation, action, latency and plant state of each run goes into one hash; counters
//! and verdict are compared directly. The last bits of sine and cosine depend on the C
//! library, so the bytes are compared only on the platform that produced them.

use std::collections::HashMap;

use ratelab::Time;
use ratelab_cart_pole::{OBS, Plant, verdict};
use ratelab_study::{experiment::Config, system::VerdictKind};

use crate::support::{config, knobs, run, run_bytes, step_bytes, traffic};

const RUNS: &str = include_str!("../golden/runs.txt");

type GoldenRow<'a> = HashMap<&'a str, &'a str>;

fn fields(line: &str) -> GoldenRow<'_> {
    line.split_whitespace()
        .map(|field| field.split_once('=').expect("key=value"))
        .collect()
}

/// The configuration in a line of `runs.txt`.
fn golden_config(fields: &GoldenRow<'_>) -> Config {
    let timed = fields.get("knobs").copied().unwrap_or_default();
    let setup = format!(
        "sensor-hz {}, control-hz {}, queue-depth {}, policy {}",
        fields["sensor_hz"], fields["control_hz"], fields["depth"], fields["policy"]
    );
    Config {
        seed: fields["seed"].parse().expect("seed"),
        end: Time::from_secs_f64(fields["duration_s"].parse().expect("number")).expect("time"),
        knobs: knobs(&timed.replace(',', "\n").replace(':', " ")),
        ..config(&setup)
    }
}

fn fnv1a64(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

/// The name of the verdict in `runs.txt`.
fn reference_name(kind: &VerdictKind) -> &'static str {
    match kind {
        kind if *kind == verdict::POLE_FELL => "fell",
        kind if *kind == verdict::CART_LEFT_RAIL => "left_rail",
        kind => kind.name,
    }
}

#[test]
fn every_reference_run_is_reproduced_to_the_bit() {
    let mut runs = 0;
    for block in RUNS.trim().split("\n\n") {
        let lines: Vec<&str> = block.lines().collect();
        let (config, expected, hash) =
            (golden_config(&fields(lines[0])), fields(lines[1]), lines[2]);
        let run = run_bytes(&config);
        let summary = &run.summary;
        let own = [
            ("verdict", reference_name(summary.verdict.kind).to_owned()),
            ("sim_time_ns", summary.sim_time.as_nanos().to_string()),
        ];
        for (key, value) in traffic(summary).into_iter().chain(own) {
            assert_eq!(value, expected[key], "{key} of {}", lines[0]);
        }
        let steps: Vec<u8> = run.steps.iter().flat_map(step_bytes).collect();
        assert_eq!(
            format!("fnv1a64={:016x}", fnv1a64(&steps)),
            hash,
            "{}",
            lines[0]
        );
        runs += 1;
    }
    assert!(runs >= 20, "only {runs} reference runs were found");
}

#[test]
fn starts_match_numpy_for_seeds_below_and_above_32_bits() {
    for line in include_str!("../golden/seeds.txt").lines() {
        let fields = fields(line);
        let plant = Plant::new(fields["seed"].parse().expect("seed")).expect("plant");
        let ([x, angle], [x_velocity, angle_velocity]) = (plant.qpos(), plant.qvel());
        let drawn = [x, angle, x_velocity, angle_velocity];
        let drawn: Vec<String> = drawn
            .iter()
            .map(|v| format!("{:016x}", v.to_bits()))
            .collect();
        assert_eq!(
            drawn.join(","),
            fields["uniforms"],
            "seed {}",
            fields["seed"]
        );
    }
}

#[test]
fn a_deeper_queue_hides_the_drops_and_changes_nothing_else() {
    for seed in 0..3 {
        let run = |setup| {
            run_bytes(&Config {
                seed,
                ..config(setup)
            })
        };
        let (shallow, deep) = (run("control-hz 5"), run("control-hz 5, queue-depth 100"));
        assert!(shallow.summary.topic(OBS).dropped > 0);
        assert_eq!(deep.summary.topic(OBS).dropped, 0);
        assert!(shallow.steps == deep.steps, "seed {seed} fell differently");
    }
}

#[test]
fn a_run_without_taps_is_the_run_with_all_of_them() {
    let config = config("control-hz 15");
    let (bare, tapped) = (run(&config), run_bytes(&config).summary);
    assert_eq!(bare.state, tapped.state);
    assert_eq!(bare.latency.sum(), tapped.latency.sum());
    assert_eq!(bare.topics, tapped.topics);
}
