//! The map against the runs that it names.

pub mod sample;

use ratelab_experiment::Experiment;

use self::sample::around;
use super::*;
use crate::tests::kit::{config, setup};

fn filled(config: &Config) -> CliffMap {
    let mut map = around(config);
    fill(&mut map);
    map
}

fn fill(map: &mut CliffMap) {
    while map.done() < map.runs() {
        map.fill.wait();
        map.follow().expect("no run fails");
    }
}

#[test]
fn every_cell_is_the_run_that_it_names() {
    let map = filled(&Config::default());
    let names = [("5", 0, 43), ("5", 1, 60), ("7", 2, 228), ("10", 0, 501)];
    for (hz, seed, steps) in names {
        let rate = map.columns.iter().position(|value| value.text == hz);
        let outcome = map.outcome(rate.expect("a rate of the map"), seed);
        assert_eq!(outcome.expect("made").steps, steps, "{hz} Hz, seed {seed}");
    }
    assert_eq!((map.survival(4).held, map.survival(4).finished), (0, 100));
    assert_eq!((map.survival(9).held, map.survival(9).finished), (100, 100));
}

#[test]
fn it_begins_where_the_session_is_and_the_last_seeds_of_all_have_a_map_too() {
    let map = around(&config("seed 250; control-hz 7"));
    assert_eq!(map.place(), ("7 Hz".to_owned(), "seed 250".to_owned()));
    assert_eq!(map.sweep.seeds[0], 200);
    let last = around(&config(&format!("seed {}", u64::MAX)));
    assert_eq!(last.chosen().1, u64::MAX);
}

#[test]
fn it_begins_at_the_rate_in_force_which_has_a_column() {
    for (hz, columns) in [(50.0, 31), (7.0, 30), (7.5, 31), (200.0, 31)] {
        let map = around(&config(&format!("control-hz {hz}")));
        assert_eq!(map.place().0, format!("{hz} Hz"));
        assert_eq!(map.columns.len(), columns, "{hz} Hz");
        assert!(map.columns.is_sorted_by(|a, b| number(a) < number(b)));
    }
    // The digits of a rate are rows of the map.
    let long = around(&config("control-hz 7.654321"));
    assert_eq!(long.place().0, "8 Hz");
}

#[test]
fn another_rate_is_on_the_same_map_and_other_seeds_and_another_depth_are_not() {
    let map = around(&config("seed 250; control-hz 7"));
    for (run, is_on_it) in [
        ("seed 250; control-hz 7", true),
        ("seed 250; control-hz 3", true),
        ("seed 300; control-hz 7", false),
        ("seed 250; queue-depth 3", false),
    ] {
        let is_of = map.is_of(&focus(), MapAxes::default(), &config(run));
        assert_eq!(is_of, is_on_it, "{run}");
    }
}

fn focus() -> KnobFocus {
    KnobFocus {
        node: "policy".to_owned(),
        topics: vec!["/action".to_owned()],
    }
}

#[test]
fn two_knobs_are_on_one_map_and_each_cell_is_the_run_of_both() {
    let config = config("seed 3");
    let axes = MapAxes { x: 1, y: Some(0) };
    let mut map = sample::over(axes, &config);
    assert_eq!(map.only_seed(), Some(3));
    assert_eq!(map.x.heading(), "/obs delay ms");
    assert_eq!(map.row_heading().as_deref(), Some("control Hz"));
    fill(&mut map);
    for (column, row) in [(0, 29), (10, 24), (25, 24), (5, 9)] {
        let mut alone = config.clone();
        map.at = (column, row);
        let (knobs, seed) = map.chosen();
        alone.setup.extend(knobs);
        assert_eq!(seed, 3);
        let system = setup().system;
        let alone = Experiment::new(system.clone(), &alone).expect("a run");
        let alone = CellResult::new(&*system, &alone.run().expect("no fault"));
        assert_eq!(map.outcome(column, row), Some(&alone));
    }
    assert!(!map.is_of(&focus(), MapAxes::default(), &config));
}

#[test]
fn the_edges_are_not_passed() {
    let mut map = sample::half_filled();
    for _ in 0..200 {
        map.move_rate(Direction::Up);
        map.move_seed(Direction::Down);
    }
    assert_eq!(map.at, (map.columns.len() - 1, 0));
}
