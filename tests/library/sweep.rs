//! A sweep equals its single runs: with any number of threads, each cell gives the result
//! of a separate run.

use std::{collections::HashSet, num::NonZeroUsize, ops::ControlFlow, sync::LazyLock};

use proptest::prelude::*;
use ratelab_experiment::sweep::{
    Axis, AxisError, Cell, CellResult, MAX_CELLS, Sweep, SweepAxis, Swept, all_cores,
};

use crate::{support::*, table::rows};

/// 32 rates × 200 seeds, on all cores.
static CLIFF: LazyLock<Swept> = LazyLock::new(|| run(&cliff(), all_cores()));

fn cliff() -> Sweep {
    Sweep {
        axes: axes(&[("control-hz", "1..30,7.5,7.75")]),
        seeds: seeds("0..199"),
        ..of(Config::default())
    }
}

/// A sweep with the single run `config`.
fn of(config: Config) -> Sweep {
    Sweep::new(cart_pole(), config)
}

/// Knobs of the cart-pole with their values.
fn axes(axes: &[(&str, &str)]) -> Vec<SweepAxis> {
    let axes = axes.iter();
    let axes = axes.map(|(name, list)| SweepAxis::parse(CartPole::KNOBS, name, list));
    axes.collect::<Result<_, _>>().expect("axes")
}

fn seeds(text: &str) -> Vec<u64> {
    text.parse::<Axis<u64>>().expect(text).into()
}

fn threads(count: usize) -> NonZeroUsize {
    NonZeroUsize::new(count).expect("not zero")
}

fn run(sweep: &Sweep, threads: NonZeroUsize) -> Swept {
    let swept = sweep.run(threads, |_, _| ControlFlow::Continue(()));
    swept.expect("a sweep")
}

/// A cell's whole result, exact to the bit.
fn bits(outcome: &CellResult) -> String {
    format!("{outcome:?}")
}

fn all_bits<'a>(cells: impl Iterator<Item = (Cell, &'a CellResult)>) -> Vec<(Cell, String)> {
    cells.map(|(cell, outcome)| (cell, bits(outcome))).collect()
}

#[test]
fn survival_over_200_seeds_matches_an_independent_count_and_is_not_monotone() {
    let mut rates = 0;
    for survival in CLIFF.survival() {
        let rate = survival.cell.value("control-hz").expect("an axis");
        let held = match rate {
            "1" | "2" | "3" | "4" | "5" => 0,
            "6" => 1,
            "7" => 15,
            "7.5" => 199,
            "7.75" => 58,
            "8" => 198,
            _ => 200,
        };
        assert_eq!((survival.runs, survival.held), (200, held), "{rate} Hz");
        assert_eq!(survival.share(), Some(held as f64 / 200.0));
        rates += 1;
    }
    assert_eq!(rates, 32);
}

#[test]
fn a_cell_of_any_knob_is_the_run_that_it_would_be_alone_to_the_bit() {
    const AXES: [(&str, &str); 4] = [
        ("link /action delay:{}", "0..90:30"),
        ("takes policy", "0..30:15,5..20"),
        ("on-stale zero:{}", "50,100"),
        ("offset sensor", "0..10:10"),
    ];
    let short = |setup: &str| own(0, &format!("until 3; {setup}"));
    let sweep = Sweep {
        axes: axes(&AXES),
        seeds: seeds("0..1"),
        ..of(short(""))
    };
    let (swept, mut compared) = (run(&sweep, all_cores()), 0);
    for (cell, outcome) in swept.finished().step_by(5) {
        let knobs = AXES.map(|(axis, _)| {
            let value = cell.value(axis).expect("an axis");
            if axis.contains("{}") {
                axis.replace("{}", value)
            } else {
                format!("{axis} {value}")
            }
        });
        let seed = cell.seed;
        let alone = short(&knobs.join("; "));
        let alone = crate::support::run(&Config { seed, ..alone });
        let alone = CellResult::new(&*cart_pole(), &alone);
        assert_eq!(bits(outcome), bits(&alone), "{cell:?}");
        compared += 1;
    }
    assert_eq!(
        (swept.finished().count(), compared),
        (4 * 4 * 2 * 2 * 2, 26)
    );
}

/// The values on the axis called `name`, or on that of the seeds, or why it is none.
fn values(name: &str, list: &str) -> Result<Vec<String>, AxisError> {
    if name == "seeds" {
        let seeds: Axis<u64> = list.parse()?;
        return Ok(seeds.values().iter().map(u64::to_string).collect());
    }
    let axis = SweepAxis::parse(CartPole::KNOBS, name, list)?;
    Ok(axis.values.iter().map(|value| value.text.clone()).collect())
}

#[test]
fn lists_and_ranges_have_both_their_ends_exact_steps_and_other_texts() {
    for [name, list, expected] in rows(
        r"
        control-hz           | 7              | 7
        control-hz           | 1..3           | 1 2 3
        control-hz           | 50, 25 ,0.5    | 50 25 0.5
        control-hz           | 1 .. 2 : 0.25  | 1 1.25 1.5 1.75 2
        control-hz           | 1..30:4        | 1 5 9 13 17 21 25 29
        control-hz           | 0.1..1:0.1     | 0.1 0.2 0.3 0.4 0.5 0.6 0.7 0.8 0.9 1
        control-hz           | 5..5           | 5
        queue-depth          | 1..3           | 1 2 3
        seeds                | 0..10:5,7      | 0 5 10 7
        seeds                | 18446744073709551615..18446744073709551615 | 18446744073709551615
        link /obs loss:{}    | 0.1..0.3:0.1   | 0.1 0.2 0.3
        clock sensor {} 40   | -1..0:0.5,3    | -1 -0.5 0 3
        link /obs            | none,delay:3\,loss:0.1,delay:5..9 | none delay:3,loss:0.1 delay:5..9
        takes policy         | 60..110        | 60..110
        takes policy         | 6..8:1         | 6 7 8
        hang policy          | 6..8           | 6 7 8
        ",
    ) {
        let found = values(&name, &list).expect(&list);
        assert_eq!(found.join(" "), expected, "{name} {list}");
    }
    assert_eq!(
        values("seeds", "1..2000000").map(|all| all.len()),
        Ok(MAX_CELLS)
    );
}

#[test]
fn an_invalid_list_is_refused_with_its_value_and_the_expected_form() {
    const LISTS: &str = "lists and ranges are written like 5,10,25 and 1..30 and 1..30:2";
    const RATE: &str = "is not a rate: expected 0.001 to 10000 ticks per second";
    // After dots a part of what is said.
    for [name, list, said] in rows(
        r#"
        control-hz         | 5,fast         | "fast" RATE; LISTS
        control-hz         |                | "" RATE; LISTS
        control-hz         | 5,,6           | "" RATE; LISTS
        control-hz         | 0..5           | "0" RATE; LISTS
        control-hz         | 1..5:0         | "0" RATE; LISTS
        control-hz         | 1..2..3        | "2..3" RATE; LISTS
        control-hz         | 30..1          | "30..1" goes down: write the smaller end first
        control-hz         | 1..3,2         | "2" has a value that the list has before it: give each value once
        seeds              | -1             | "-1" is not a seed: expected a whole number from 0; LISTS
        seeds              | 0..5:0         | "0..5:0" has no step upwards: leave the step out for steps of one
        seeds              | 0..18446744073709551615 | "0..18446744073709551615" has more than 2000000 values: make the range smaller or its step larger
        link /obs delay:{} | 5..1           | ...goes down
        link /obs delay:{} | 1..5:0         | ...no step upwards
        link /obs delay:{} | 1..5:-1        | ...no step upwards
        link /obs delay:{} | 1..5:x         | ..."x" is not a number
        link /obs delay:{} | 1..5:0.0000000001 | ...to 9 places
        link /obs delay:{} | -5..5          | ...is not a delay
        link /obs delay:{} | 1,1.0          | ...give each value once
        link /obs loss:{}  | 0.5..1.5:0.5   | ...expected 0 to 1
        link /obs delay:{} |                | ...is not a delay
        lag /obs {}        | 1              | ..."lag" is not a knob
        link /obs delay:{} | 0..9999999     | ...more than 2000000 values
        "#,
    ) {
        let error = values(&name, &list).expect_err(&list).to_string();
        let said = said.replace("RATE", RATE).replace("LISTS", LISTS);
        match said.strip_prefix("...") {
            Some(part) => assert!(error.contains(part), "{name} {list}: {error}"),
            None => assert_eq!(error, said, "{name} {list}"),
        }
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}

/// A sweep with several values in every list, and policies with different needs.
fn small() -> Sweep {
    let config = config("until 2; 1 control-hz 12");
    Sweep {
        axes: axes(&[
            ("policy", "scripted,random"),
            ("rate sensor", "30,50"),
            ("queue-depth", "1,5"),
            ("control-hz", "5..10:2.5"),
        ]),
        seeds: seeds("3..6"),
        ..of(config)
    }
}

#[test]
fn every_cell_is_run_and_reported_once_alike_on_any_number_of_threads() {
    let alone = all_bits(run(&small(), threads(1)).finished());
    assert_eq!(alone.len(), 2 * 2 * 2 * 3 * 4);
    for count in [2, 3, 16, 1_000] {
        let mut told = Vec::new();
        let together = small().run(threads(count), |cell, outcome| {
            told.push((cell.clone(), outcome.clone()));
            ControlFlow::Continue(())
        });
        let together = together.expect("a sweep");
        assert!(together.is_complete());
        assert!(all_bits(together.finished()) == alone, "{count} threads");
        let told = all_bits(told.iter().map(|(cell, outcome)| (cell.clone(), outcome)));
        assert_eq!(told.len(), alone.len());
        assert!(
            alone.iter().all(|cell| told.contains(cell)),
            "{count} threads"
        );
    }
}

#[test]
fn the_seed_changes_fastest_and_the_first_axis_slowest() {
    let sweep = small();
    let cells: Vec<Cell> = (0..).map_while(|index| sweep.cell(index)).collect();
    assert_eq!(cells.len(), sweep.cells().expect("cells"));
    let seeds: Vec<u64> = cells.iter().take(5).map(|cell| cell.seed).collect();
    assert_eq!(seeds, [3, 4, 5, 6, 3]);
    let first = "policy scripted, rate sensor 30, queue-depth 1, control-hz 5, seed 3";
    assert_eq!(cells[0].to_string(), first);
    assert_eq!(cells[4].value("control-hz"), Some("7.5"));
    assert_eq!(cells[12].value("queue-depth"), Some("5"));
    assert_eq!(cells[24].value("rate sensor"), Some("50"));
    assert_eq!(cells[48].value("policy"), Some("random"));
    assert_eq!(sweep.cell(96), None);
}

#[test]
fn an_interrupted_sweep_keeps_its_finished_cells() {
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
    assert!((50..6_400).contains(&done), "{done}");
    let whole: Vec<_> = CLIFF.finished().collect();
    assert!(swept.finished().all(|cell| whole.contains(&cell)));
    let counted: usize = swept.survival().map(|survival| survival.runs).sum();
    assert_eq!(counted, done);
}

#[test]
fn an_interrupt_ends_a_sweep_within_its_runs() {
    let year = of(config("until 31536000"));
    let interrupt = Interrupt::default();
    let swept = std::thread::scope(|scope| {
        scope.spawn(|| interrupt.ask());
        year.run_until(&interrupt, threads(2), |_, _| ControlFlow::Continue(()))
    });
    assert_eq!(swept.expect("a sweep").finished().count(), 0);
}

#[test]
fn a_sweep_runs_on_the_virtual_clock_whatever_its_base_says() {
    let sweep = of(config("real"));
    let swept = run(&sweep, threads(1));
    let (_, outcome) = swept.finished().next().expect("a cell");
    assert_eq!((outcome.steps, &outcome.dropped[..]), (501, &[0, 0][..]));
}

#[test]
fn an_invalid_sweep_is_refused() {
    let base = of(Config::default());
    let none = Sweep {
        seeds: Vec::new(),
        ..base.clone()
    };
    let many = Sweep {
        axes: axes(&[("control-hz", "1..3000")]),
        seeds: (0..3_000).collect(),
        ..base.clone()
    };
    let unknown = Sweep {
        axes: axes(&[("rate planner", "5")]),
        ..base
    };
    let endless = of(config("until ever"));
    for (sweep, said) in [
        (none, "a sweep without seeds has no runs: list at least one"),
        (
            many,
            "9000000 runs are too many for a sweep: list fewer values, 2000000 runs at most",
        ),
        (
            unknown,
            "rate planner 5, seed 0: rate planner 5: there is no node \"planner\": expected one \
             of sensor, policy, actuator",
        ),
        (
            endless,
            "the runs of a sweep must end: give them a duration",
        ),
    ] {
        let refused = sweep.run(threads(1), |_, _| ControlFlow::Continue(()));
        assert_eq!(
            refused.err().map(|error| error.to_string()).as_deref(),
            Some(said)
        );
    }
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

#[test]
fn a_rate_that_is_a_part_of_a_swept_one_follows_it_in_each_cell() {
    let graph = "name = \"parts\"\n[node.fast]\nrate = 250\npublishes = [\"/x\"]\n\n\
                 [node.part]\nrate = \"fast / 10\"\nreads = [\"/x\"]\n";
    let system = graph_system(graph).expect("a graph");
    let list = Config {
        end: secs(2.0),
        ..Config::default()
    };
    let by_hand = Config {
        setup: ["rate part 5".parse().expect("a knob")]
            .into_iter()
            .collect(),
        ..list.clone()
    };
    for (base, ticks) in [(list, [21, 201, 41]), (by_hand, [11, 11, 11])] {
        let axis = |rates: &str| {
            SweepAxis::parse(KnobText(system.knobs().aliases()), "rate fast", rates)
                .expect("an axis")
        };
        let sweep = Sweep {
            axes: vec![axis("100,1000,200")],
            ..Sweep::new(system.clone(), base.clone())
        };
        let swept = run(&sweep, threads(2));
        let alone = swept.finished().map(|(cell, outcome)| {
            let config = Config {
                seed: cell.seed,
                ..sweep.config(&cell)
            };
            let run = Experiment::new(system.clone(), &config).expect("a run");
            let run = run.run().expect("no fault");
            assert_eq!(bits(outcome), bits(&CellResult::new(&*system, &run)));
            run.node("part").expect("a node").ticks
        });
        assert_eq!(alone.collect::<Vec<_>>(), ticks);
    }
}
