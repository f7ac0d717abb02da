//! Runs of the real clock with any configuration, while all cores are busy: each is recorded,
//! and comes again to the bit.

use std::{fs, thread};

use rand::Rng;
use tempfile::tempdir;

use crate::{
    cases::{RandomSource, chance, pick_from, run},
    load::Load,
    program::does,
};

/// Rates of nodes (Hz).
const RATES: &str = "5|20|33.3|50|50|100|333|1000";

/// Options that a run may have.
const OPTIONS: &str = "--world own|--takes policy=3|--takes policy=30..60|\
    --takes 'policy=busy 4' --takes sensor=1|--think-ms 120|--offset policy=7|\
    --queue-depth 10|--knob 'read /obs oldest'|\
    --knob 'link /obs delay:5..25,loss:0.1'|--knob 'link /action delay:lognormal:4,9'|\
    --knob 'clock sensor 3 1000'|--on-stale zero:60";

/// Knobs that may be turned while it runs.
const KNOBS: &str = "control-hz 12.5|control-hz 200|sensor-hz 8|queue-depth 7|policy random|policy lqr|\
    takes policy 15|crash policy|restart policy|hang policy 45";

/// A run that is recorded to `run.rrd`.
fn line(random: &mut RandomSource) -> String {
    let seconds = random.random_range(0.2..1.2_f64);
    let seed = random.random_range(0..1_000);
    let policy = pick_from(random, "scripted|lqr|random|zero");
    let [control, sensor] = [(), ()].map(|()| pick_from(random, RATES));
    let options = OPTIONS.split('|').filter(|_| chance(random, 15));
    let options: Vec<_> = options.collect();
    format!(
        "run --clock real --record run.rrd --knobs run.knobs --duration-s {seconds} \
         --seed {seed} --policy {policy} --control-hz {control} --sensor-hz {sensor} {}",
        options.join(" ")
    )
}

/// Lines of timed knobs.
fn knobs(random: &mut RandomSource) -> String {
    let count = random.random_range(0..6);
    let lines = (0..count).map(|_| {
        let at = random.random_range(0.0..0.8_f64);
        format!("{at:.3} {}\n", pick_from(random, KNOBS))
    });
    lines.collect()
}

#[test]
fn under_load() {
    let cores = thread::available_parallelism().map_or(2, usize::from);
    let _load = Load::new(2 * cores);
    run("under_load", 6, |random, note| {
        let folder = tempdir().expect("a folder");
        let (line, knobs) = (line(random), knobs(random));
        *note = format!("{line} with {knobs:?}");
        fs::write(folder.path().join("run.knobs"), knobs).expect("written");
        for line in [&*line, "verify run.rrd", "verify --perturb run.rrd"] {
            let output = does(line, folder.path());
            assert!(output.status.success(), "{line}: {output:?}");
        }
    });
}
