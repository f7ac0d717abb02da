//! The virtual clock reproduces independent references, byte for byte.
//!
//! `tests/golden/` holds runs of Python implementations over the same MuJoCo: `runs.txt` by
//! `reference.py`, and `honest.txt` by `honest.py`, a second implementation of every rule in
//! `docs/time.md`, for runs in which ticks take time and the world does not wait. Every
//! observation, action, latency and plant state of each run goes into one hash; counters
//! and verdict are compared directly. The last bits of sine and cosine depend on the C
//! library, so the bytes are compared only on the platform that produced them.

use crate::support::*;

fn parsed<T: std::str::FromStr>(fields: &GoldenFields<'_>, key: &str) -> T {
    let number = fields[key].parse().ok();
    number.unwrap_or_else(|| panic!("{key}: {}", fields[key]))
}

/// Figures of a run, by their names in the reference data.
const FIGURES: [(&str, &str); 9] = [
    ("verdict", "ending"),
    ("steps", "steps"),
    ("obs_published", "published /obs"),
    ("obs_dropped", "dropped /obs"),
    ("action_published", "published /action"),
    ("action_dropped", "dropped /action"),
    ("latency_count", "latency count"),
    ("latency_sum_ns", "latency sum"),
    ("sim_time_ns", "end_ns"),
];

#[test]
fn every_reference_run_is_reproduced_to_the_bit() {
    let mut runs = 0;
    for block in include_str!("../golden/runs.txt").trim().split("\n\n") {
        let lines: Vec<&str> = block.lines().collect();
        let (asked, expected) = (fields(lines[0]), fields(lines[1]));
        let timed = asked.get("knobs").copied().unwrap_or_default();
        let config = config(&format!(
            "seed {}; until {}; sensor-hz {}; control-hz {}; queue-depth {}; policy {}; {}",
            asked["seed"],
            asked["duration_s"],
            asked["sensor_hz"],
            asked["control_hz"],
            asked["depth"],
            asked["policy"],
            timed.replace(',', ";").replace(':', " ")
        ));
        let run = run_bytes(&config);
        for (key, name) in FIGURES {
            let found = figure(&run.summary, name);
            assert_eq!(found, expected[key], "{key} of {}", lines[0]);
        }
        let steps: Vec<u8> = run.steps.iter().flat_map(step_bytes).collect();
        let hash = format!("fnv1a64={:016x}", fnv1a64(&steps));
        assert_eq!(hash, lines[2], "{}", lines[0]);
        runs += 1;
    }
    assert!(runs >= 20, "only {runs} reference runs were found");
}

/// A reference run of `honest.txt`: its configuration, its results and its hash.
fn honest(block: &str) -> (Config, GoldenFields<'_>, &str) {
    let (mut run, mut got, mut hash, mut knobs) =
        (GoldenFields::new(), GoldenFields::new(), "", Vec::new());
    for line in block.lines() {
        let (kind, rest) = line.split_once([' ', '=']).expect("a line");
        match kind {
            "run" => run = fields(rest),
            "setup" | "knob" => knobs.push(rest),
            "got" => got = fields(rest),
            "fnv1a64" => hash = rest,
            other => panic!("{other:?} begins no line"),
        }
    }
    let [seed, end, depth] = ["seed", "duration_s", "depth"].map(|key| run[key]);
    let knobs = knobs.join("; ");
    let config = config(&format!(
        "seed {seed}; until {end}; queue-depth {depth}; {knobs}"
    ));
    let step_ms = run.get("step_ms").map(|ms| ms.parse().expect("number"));
    let world = WorldKind::parse(run["world"], step_ms).expect("a world");
    (Config { world, ..config }, got, hash)
}

/// More figures of such a run, by their names there.
const MORE_FIGURES: [(&str, &str); 5] = [
    ("ticks", "ticks sensor,policy,actuator"),
    ("overruns", "overruns sensor,policy,actuator"),
    ("spent_ns", "spent_ns sensor,policy,actuator"),
    ("obs_way", "way /obs"),
    ("action_way", "way /action"),
];

#[test]
fn every_reference_run_with_costs_links_and_faults_is_reproduced_to_the_bit() {
    let mut runs = 0;
    for block in &golden_blocks(include_str!("../golden/honest.txt"), "RATELAB_HONEST") {
        let (config, got, hash) = honest(block);
        let experiment = experiment(&config);
        let observer = experiment.observer();
        let run = collect(experiment);
        let snapshot = observer.snapshot();
        for (key, name) in FIGURES.into_iter().chain(MORE_FIGURES) {
            let expected = got.get(key).copied();
            let expected = expected.or(key.ends_with("_way").then_some("0,0,0"));
            let found = figure(&run.summary, name);
            assert_eq!(Some(&*found), expected, "{key} of\n{block}");
        }
        let actuator = snapshot.node("actuator").expect("an actuator");
        let push_age = actuator.push_age.saw();
        let first = push_age.map(|age| age.first.as_nanos().to_string());
        let first = first.unwrap_or_else(|| "none".to_owned());
        assert_eq!(first, got["push_first_ns"], "{block}");
        let area = push_age.map_or(0.0, |age| age.area_s2(snapshot.now));
        let twice: f64 = parsed(&got, "push_area");
        assert!((area * 2e18 - twice).abs() <= 1e-9 * twice, "{block}");
        assert_eq!(format!("{:016x}", fnv1a64(&run.bytes())), hash, "{block}");
        runs += 1;
    }
    assert!(runs >= 90, "only {runs} reference runs were found");
}

#[test]
fn with_the_course_s_step_both_worlds_are_one_to_the_policy() {
    for (seed, control_hz, common) in [(0, 50, 500), (1, 25, 500), (2, 10, 500), (3, 5, 23)] {
        let [course, own] = [("course", None), ("own", Some(10))].map(|(world, step_ms)| {
            run_bytes(&Config {
                world: WorldKind::parse(world, step_ms).expect("a world"),
                ..config(&format!("seed {seed}; control-hz {control_hz}"))
            })
        });
        let rows = |run: &RunBytes| -> Vec<_> {
            let steps = run.steps.iter().map(|message: &Message<_>| &message.data);
            let rows = steps.map(|step| (step.step, step.action.0, step.qpos, step.qvel));
            rows.take(common).collect()
        };
        assert_eq!(own.steps.len(), common, "seed {seed}");
        assert_eq!(rows(&own), rows(&course), "seed {seed}");
    }
}
