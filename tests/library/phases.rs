//! The phases of nodes: ties that keep data fresh are noted, and phases are drawn.

use ratelab_experiment::hunt::{Budget, Hunt, Hunted};

use crate::support::*;

const TIED: &str = r#"
    name = "tied"
    node.camera = { rate = 50, publishes = ["/image"] }
    node.control = { rate = 50, reads = ["/image"], publishes = ["/cmd"] }
    chain.see = { path = ["camera", "/image", "control", "/cmd"], age_ms = 25 }
"#;

/// A node that ticks on scans reads what another sensor publishes at these moments.
const TRIGGERED: &str = r#"
    name = "triggered"
    node.odom = { rate = 50, publishes = ["/tf"] }
    node.laser = { rate = 50, publishes = ["/scan"] }
    node.slam = { trigger = ["/scan"], reads = ["/tf"], publishes = ["/map"] }
    chain.tf = { path = ["odom", "/tf", "slam", "/map"] }
"#;

/// Both nodes tick when a clock of 10 Hz does.
const CLOCKED: &str = r#"
    name = "clocked"
    clock.rate = 10
    node.imu = { rate = 100, publishes = ["/imu"] }
    node.ekf = { rate = 30, reads = ["/imu"], publishes = ["/odom"] }
    chain.imu = { path = ["imu", "/imu", "ekf", "/odom"] }
"#;

/// A node that ticks on one of two messages of the same tick, and reads the other one.
const TOGETHER: &str = r#"
    name = "together"
    node.camera = { rate = 10, publishes = ["/image", "/info"] }
    node.detector = { trigger = ["/image"], reads = ["/info"], publishes = ["/pose"] }
    chain.info = { path = ["camera", "/info", "detector", "/pose"] }
"#;

fn experiment_of(text: &str, knobs: &str) -> Experiment {
    let system = graph_system(text).expect("a graph");
    Experiment::new(system, &config(knobs)).expect("a run")
}

fn tied(knobs: &str) -> Experiment {
    experiment_of(TIED, knobs)
}

#[test]
fn a_note_is_about_reads_at_the_instant_of_a_delivery_that_keep_data_fresh() {
    let late = "control reads /image at the very instant of delivery; where";
    for (text, knobs, notes) in [
        (TIED, "", [late, "20.0 ms older", "\"wakes camera 0.2\""]),
        (TIED, "offset camera 20", [late, "20.0 ms older", ""]),
        (TIED, "rate camera 25", [late, "20.0 ms older", ""]),
        // A delay and a cost that come to a period.
        (TIED, "link /image delay:20", [late, "20.0 ms older", ""]),
        (
            TIED,
            "rate camera 25; takes camera 20",
            [late, "20.0 ms older", ""],
        ),
        (
            TRIGGERED,
            "",
            ["slam reads /tf", "20.0 ms older", "wakes odom"],
        ),
        (
            CLOCKED,
            "",
            ["ekf reads /imu", "100.0 ms older", "wakes imu"],
        ),
    ] {
        let told = experiment_of(text, knobs).tie_notes();
        let [note] = &told[..] else {
            panic!("{knobs}: {told:?}\n{text}")
        };
        assert!(notes.iter().all(|part| note.contains(part)), "{note}");
    }
    for (text, knobs) in [
        (TIED, "offset camera 1"),
        (TIED, "takes camera 5"),
        (TIED, "rate camera 30"),
        (TIED, "link /image delay:19.9"),
        (TIED, "link /image delay:5..20"),
        (TRIGGERED, "offset odom 5"),
        (TOGETHER, ""),
    ] {
        let told = experiment_of(text, knobs).tie_notes();
        assert!(told.is_empty(), "{knobs}: {told:?}\n{text}");
    }
}

#[test]
fn the_smallest_shift_that_loses_a_run_is_found_beside_its_offset() {
    let run = config("offset control 2");
    let hunt = Hunt::new(graph_system(TIED).expect("a graph"), run.clone());
    let found = |node: &str| {
        let budget = Budget {
            shift: Some((node.to_owned(), ms(20))),
            offset: run.setup.offset(node).unwrap_or_default(),
            ..Budget::default()
        };
        match hunt.run(&budget, &|| false).expect("a hunt") {
            Hunted::Lost(found) => found.knobs[0].knob.to_string(),
            Hunted::Held { runs, .. } => format!("held in {runs}"),
        }
    };
    assert_eq!(found("control"), "offset control 6");
    assert_eq!(found("camera"), "offset camera 3");
}

#[test]
fn phases_are_drawn_by_the_seed_and_within_the_periods() {
    let (one, again) = (tied("").phases(5), tied("").phases(5));
    assert_eq!(one, again);
    assert_ne!(one, tied("seed 1").phases(5));
    let knobs = one.values.iter().flat_map(|value| &value.knobs);
    let below = |knob: &Knob| matches!(knob, Knob::Offset { offset, .. } if *offset < ms(20));
    assert!(knobs.clone().count() == 10 && knobs.clone().all(below));
}
