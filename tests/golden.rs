//! The virtual clock reproduces an independent reference, byte for byte.
//!
//! `tests/golden/` holds runs of a Python implementation over the same MuJoCo.
//! Every observation, action, latency and plant state of each run goes into one
//! hash; counters and verdict are compared as they are. The last bits of sine
//! and cosine belong to the C library, so the bytes are compared where they
//! were made.
#![cfg(all(target_arch = "x86_64", target_os = "linux"))]

mod support;

use std::collections::HashMap;

use ratelab::{
    cartpole::Plant,
    experiment::{Config, Experiment, Verdict},
    runtime::{Depth, Time},
};
use support::{RunBytes, run_bytes, step_bytes};

const RUNS: &str = include_str!("golden/runs.txt");

type GoldenRow<'a> = HashMap<&'a str, &'a str>;

fn fields(line: &str) -> GoldenRow<'_> {
    line.split_whitespace()
        .map(|field| field.split_once('=').expect("key=value"))
        .collect()
}

fn config(fields: &GoldenRow<'_>) -> Config {
    let knobs = fields.get("knobs").map_or(Vec::new(), |knobs| {
        knobs
            .split(',')
            .map(|knob| knob.replace(':', " ").parse().expect("knob"))
            .collect()
    });
    Config {
        seed: fields["seed"].parse().expect("seed"),
        end: Time::from_secs_f64(fields["duration_s"].parse().expect("number")).expect("time"),
        sensor_hz: fields["sensor_hz"].parse().expect("rate"),
        control_hz: fields["control_hz"].parse().expect("rate"),
        queue_depth: fields["depth"].parse().expect("depth"),
        policy: fields["policy"].parse().expect("policy"),
        knobs,
        ..Config::default()
    }
}

fn fnv1a64(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

fn verdict(run: &RunBytes) -> &'static str {
    match run.summary.verdict {
        Verdict::Balanced => "balanced",
        Verdict::PoleFell { .. } => "fell",
        Verdict::CartLeftRail { .. } => "left_rail",
        Verdict::Stopped { .. } => "stopped",
    }
}

#[test]
fn every_reference_run_is_reproduced_to_the_bit() {
    let mut runs = 0;
    for block in RUNS.trim().split("\n\n") {
        let lines: Vec<&str> = block.lines().collect();
        let (config, expected, hash) = (config(&fields(lines[0])), fields(lines[1]), lines[2]);
        let run = run_bytes(&config);
        let summary = &run.summary;
        let got = [
            ("steps", summary.steps.to_string()),
            ("obs_published", summary.obs.published.to_string()),
            ("obs_dropped", summary.obs.dropped.to_string()),
            ("action_published", summary.action.published.to_string()),
            ("action_dropped", summary.action.dropped.to_string()),
            ("latency_count", summary.latency.count().to_string()),
            (
                "latency_sum_ns",
                summary.latency.sum().as_nanos().to_string(),
            ),
            ("verdict", verdict(&run).to_owned()),
            ("sim_time_ns", summary.sim_time.as_nanos().to_string()),
        ];
        for (key, value) in got {
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
fn starts_are_those_of_numpy_for_seeds_below_and_above_32_bits() {
    for line in include_str!("golden/seeds.txt").lines() {
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
    let shallow = Config {
        control_hz: "5".parse().expect("rate"),
        ..Config::default()
    };
    let deep = Config {
        queue_depth: Depth::new(100).expect("depth"),
        ..shallow.clone()
    };
    for seed in 0..3 {
        let run = |config: &Config| {
            run_bytes(&Config {
                seed,
                ..config.clone()
            })
        };
        let (shallow, deep) = (run(&shallow), run(&deep));
        assert!(shallow.summary.obs.dropped > 0);
        assert_eq!(deep.summary.obs.dropped, 0);
        assert!(shallow.steps == deep.steps, "seed {seed} fell differently");
    }
}

#[test]
fn a_run_without_taps_is_the_run_with_all_of_them() {
    let config = Config {
        control_hz: "15".parse().expect("rate"),
        ..Config::default()
    };
    let bare = Experiment::new(&config).expect("experiment");
    let bare = bare.run().expect("run");
    let tapped = run_bytes(&config).summary;
    assert_eq!(
        bare.final_pole_angle.to_bits(),
        tapped.final_pole_angle.to_bits()
    );
    assert_eq!(bare.latency.sum(), tapped.latency.sum());
    assert_eq!((bare.obs, bare.action), (tapped.obs, tapped.action));
}
