//! A sweep is nothing but its runs: whatever the number of threads, each cell
//! is the run that it would be alone.

mod support;

use std::{collections::HashSet, num::NonZeroUsize, ops::ControlFlow, sync::LazyLock};

use proptest::prelude::*;
use ratelab::{
    experiment::{
        Config, Experiment, Verdict,
        sweep::{
            Axis, AxisError, Cell, CellResult, MAX_CELLS, Quantity, Sweep, SweepError, Swept,
            all_cores,
        },
    },
    policy::PolicyKind,
    runtime::{ClockKind, Depth, Hz, Time},
};
use support::{depth, hz, secs};

/// 30 rates × 200 seeds, by all cores.
static CLIFF: LazyLock<Swept> = LazyLock::new(|| run(&cliff(), all_cores()));

fn cliff() -> Sweep {
    Sweep {
        control_hz: axis("1..30"),
        seeds: axis("0..199"),
        ..Sweep::of(Config::default())
    }
}

fn axis<T: Quantity>(text: &str) -> Vec<T> {
    text.parse::<Axis<T>>().expect(text).into()
}

fn threads(count: usize) -> NonZeroUsize {
    NonZeroUsize::new(count).expect("not zero")
}

fn run(sweep: &Sweep, threads: NonZeroUsize) -> Swept {
    let swept = sweep.run(threads, |_, _| ControlFlow::Continue(()));
    swept.expect("a sweep")
}

/// The bits of everything a cell came to.
fn bits(outcome: &CellResult) -> (Verdict, u64, Time, Option<u64>, u64, u64, u64) {
    (
        outcome.verdict,
        outcome.steps,
        outcome.sim_time,
        outcome.mean_latency_s.map(f64::to_bits),
        outcome.obs_dropped,
        outcome.action_dropped,
        outcome.final_pole_angle.to_bits(),
    )
}

fn all_bits(swept: &Swept) -> Vec<(Cell, impl PartialEq + use<>)> {
    let cells = swept.finished();
    cells.map(|(cell, outcome)| (cell, bits(outcome))).collect()
}

#[test]
fn survival_over_200_seeds_is_that_of_an_independent_count() {
    let expected = |hz: f64| match hz as u32 {
        ..=5 => 0,
        6 => 1,
        7 => 15,
        8 => 198,
        _ => 200,
    };
    let mut rates = 0;
    for survival in CLIFF.survival() {
        let rate = survival.cell.control_hz.get();
        assert_eq!(survival.runs, 200);
        assert_eq!(survival.balanced, expected(rate), "{rate} Hz");
        assert_eq!(survival.share(), Some(expected(rate) as f64 / 200.0));
        rates += 1;
    }
    assert_eq!(rates, 30);
}

#[test]
fn survival_is_not_monotone_between_whole_rates() {
    let between = Sweep {
        control_hz: axis("7.5,7.75"),
        ..cliff()
    };
    let swept = run(&between, all_cores());
    let balanced: Vec<usize> = swept.survival().map(|rate| rate.balanced).collect();
    assert_eq!(balanced, [199, 58]);
}

#[test]
fn a_cell_is_the_run_that_it_would_be_alone_to_the_bit() {
    let mut compared = 0;
    for (cell, outcome) in CLIFF.finished().step_by(37) {
        let config = Config {
            seed: cell.seed,
            control_hz: cell.control_hz,
            ..Config::default()
        };
        let experiment = Experiment::new(&config).expect("experiment");
        let alone = experiment.run().expect("run");
        assert_eq!(bits(outcome), bits(&CellResult::from(&alone)), "{cell:?}");
        compared += 1;
    }
    assert!(compared > 150);
}

/// Every list has several values, and the policies differ in what they need.
fn small() -> Sweep {
    let config = Config {
        end: secs(2.0),
        knobs: vec!["1 control-hz 12".parse().expect("knob")],
        ..Config::default()
    };
    Sweep {
        policies: vec![PolicyKind::Scripted.into(), PolicyKind::Random.into()],
        sensor_hz: axis("30,50"),
        queue_depths: axis("1,5"),
        control_hz: axis("5..10:2.5"),
        seeds: axis("3..6"),
        ..Sweep::of(config)
    }
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let alone = run(&small(), threads(1));
    assert_eq!(alone.finished().count(), 2 * 2 * 2 * 3 * 4);
    for count in [2, 3, 16, 1_000] {
        let together = run(&small(), threads(count));
        assert!(
            all_bits(&alone) == all_bits(&together),
            "differs on {count} threads"
        );
    }
}

#[test]
fn every_cell_is_run_and_told_of_once() {
    let sweep = small();
    let mut told = Vec::new();
    let swept = sweep.run(threads(2), |cell, outcome| {
        told.push((cell.clone(), *outcome));
        ControlFlow::Continue(())
    });
    let swept = swept.expect("a sweep");
    assert!(swept.is_complete());
    assert_eq!(told.len(), sweep.cells().expect("cells"));
    for (cell, outcome) in swept.finished() {
        let same = told
            .iter()
            .filter(|told| **told == (cell.clone(), *outcome));
        assert_eq!(same.count(), 1, "{cell:?}");
    }
}

#[test]
fn the_seed_changes_fastest_and_the_policy_slowest() {
    let sweep = small();
    let cells: Vec<Cell> = (0..).map_while(|index| sweep.cell(index)).collect();
    assert_eq!(cells.len(), sweep.cells().expect("cells"));
    let seeds: Vec<u64> = cells.iter().take(5).map(|cell| cell.seed).collect();
    assert_eq!(seeds, [3, 4, 5, 6, 3]);
    assert_eq!(cells[4].control_hz, hz(7.5));
    assert_eq!(cells[12].queue_depth, depth(5));
    assert_eq!(cells[24].sensor_hz, hz(50.0));
    assert_eq!(cells[48].policy, PolicyKind::Random.into());
    assert_eq!(sweep.cell(96), None);
}

#[test]
fn a_sweep_that_is_cut_short_keeps_what_is_done() {
    let mut told = 0;
    let swept = cliff().run(threads(2), |_, _| {
        told += 1;
        if told < 50 {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        }
    });
    let swept = swept.expect("a sweep");
    assert_eq!(told, 50);
    assert!(!swept.is_complete());
    let done = swept.finished().count();
    assert!((50..6_000).contains(&done), "{done}");
    let whole: Vec<_> = CLIFF.finished().collect();
    assert!(swept.finished().all(|cell| whole.contains(&cell)));
    let counted: usize = swept.survival().map(|survival| survival.runs).sum();
    assert_eq!(counted, done);
}

#[test]
fn a_sweep_runs_on_the_virtual_clock_whatever_its_base_says() {
    let sweep = Sweep::of(Config {
        clock: ClockKind::Real,
        think: std::time::Duration::from_secs(3_600),
        ..Config::default()
    });
    let swept = run(&sweep, threads(1));
    let (_, outcome) = swept.finished().next().expect("a cell");
    assert_eq!((outcome.steps, outcome.obs_dropped), (501, 0));
}

#[test]
fn what_cannot_be_swept_is_refused() {
    let sweep = Sweep::of(Config::default());
    let refused = |sweep: Sweep| sweep.cells().expect_err("refused").to_string();
    let none = Sweep {
        seeds: Vec::new(),
        ..sweep.clone()
    };
    let said = "a sweep without seeds has no runs: list at least one";
    assert_eq!(refused(none), said);
    let many = Sweep {
        control_hz: vec![hz(5.0); 3_000],
        seeds: (0..3_000).collect(),
        ..sweep.clone()
    };
    let said = "9000000 runs are too many for a sweep: list fewer values, 2000000 runs at most";
    assert_eq!(refused(many), said);
    let endless = Sweep::of(Config {
        end: Time::MAX,
        ..Config::default()
    });
    let run = endless.run(threads(1), |_, _| ControlFlow::Continue(()));
    assert!(matches!(run, Err(SweepError::Endless)));
}

#[test]
fn lists_and_ranges_have_both_their_ends_and_exact_steps() {
    let rates = |text| -> Vec<f64> { axis::<Hz>(text).iter().map(|hz| hz.get()).collect() };
    assert_eq!(rates("7"), [7.0]);
    assert_eq!(rates("1..3"), [1.0, 2.0, 3.0]);
    assert_eq!(rates(" 50, 25 ,0.5 "), [50.0, 25.0, 0.5]);
    assert_eq!(rates("1 .. 2 : 0.25"), [1.0, 1.25, 1.5, 1.75, 2.0]);
    assert_eq!(rates("1..30:4").last(), Some(&29.0));
    assert_eq!(
        rates("0.1..1:0.1"),
        [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0]
    );
    assert_eq!(rates("5..5"), [5.0]);
    assert_eq!(axis::<u64>("0..199"), (0..200).collect::<Vec<_>>());
    assert_eq!(axis::<u64>("0..10:5,7"), [0, 5, 10, 7]);
    assert_eq!(axis::<u64>(&format!("{0}..{0}", u64::MAX)), [u64::MAX]);
    assert_eq!(axis::<Depth>("1..3"), [depth(1), depth(2), depth(3)]);
}

#[test]
fn what_is_no_list_is_refused_with_its_value_and_what_to_write() {
    let rate = "is not a rate: expected 0.001 to 10000 ticks per second; lists and ranges are \
                written like 5,10,25 and 1..30 and 1..30:2";
    let seed = "is not a seed: expected a whole number from 0; lists and ranges are written like \
                5,10,25 and 1..30 and 1..30:2";
    let error = |text: &str| text.parse::<Axis<Hz>>().expect_err(text).to_string();
    assert_eq!(error("5,fast"), format!("\"fast\" {rate}"));
    assert_eq!(error(""), format!("\"\" {rate}"));
    assert_eq!(error("5,,6"), format!("\"\" {rate}"));
    assert_eq!(error("0..5"), format!("\"0\" {rate}"));
    assert_eq!(error("1..5:0"), format!("\"0\" {rate}"));
    assert_eq!(error("1..2..3"), format!("\"2..3\" {rate}"));
    assert_eq!(
        error("30..1"),
        "\"30..1\" goes down: write the smaller end first"
    );
    assert_eq!(
        error("1..3,2"),
        "\"2\" has a value that the list has before it: give each value once"
    );
    let error = |text: &str| text.parse::<Axis<u64>>().expect_err(text);
    assert_eq!(error("-1").to_string(), format!("\"-1\" {seed}"));
    assert_eq!(error("0..5:0"), AxisError::NoStep("0..5:0".to_owned()));
    let endless = format!("0..{}", u64::MAX);
    assert_eq!(error(&endless), AxisError::TooMany(endless));
    let most = format!("1..{MAX_CELLS}");
    assert_eq!(axis::<u64>(&most).len(), MAX_CELLS);
}

proptest! {
    #[test]
    fn any_text_is_read_as_an_axis_without_doubles_or_refused(text in "[0-9.,: e-]{0,12}") {
        if let Ok(axis) = text.parse::<Axis<Hz>>() {
            let distinct: HashSet<_> = axis.values().iter().collect();
            prop_assert_eq!(distinct.len(), axis.values().len());
            prop_assert!(!axis.values().is_empty());
        }
    }
}
