//! The phases of nodes: ties that keep data fresh are noted, and phases are drawn.

use ratelab_study::experiment::hunt::{Budget, Hunt, Hunted};

use crate::support::*;

const TIED: &str = r#"
    name = "tied"
    node.camera = { rate = 50, publishes = ["/image"] }
    node.control = { rate = 50, reads = ["/image"], publishes = ["/cmd"] }
    chain.see = { path = ["camera", "/image", "control", "/cmd"], age_ms = 25 }
"#;

fn tied(knobs: &str) -> Experiment {
    let system = graph_system(TIED).expect("a graph");
    Experiment::new(system, &config(knobs)).expect("a run")
}

#[test]
fn a_note_is_about_ties_that_keep_data_fresh_and_about_no_other_phase() {
    for (knobs, note) in [
        ("", "20.0 ms older"),
        ("offset camera 20", "20.0 ms older"),
        ("rate camera 25", "20.0 ms older"),
        ("offset camera 1", ""),
        ("takes camera 5", ""),
        ("rate camera 30", ""),
    ] {
        let notes = tied(knobs).tie_notes();
        assert_eq!(notes.len(), usize::from(!note.is_empty()), "{knobs}");
        assert!(notes.iter().all(|text| text.contains(note)), "{notes:?}");
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
