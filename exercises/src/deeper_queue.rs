//! A deeper queue: no message loss, but the same fall.

use std::ops::ControlFlow;

use ratelab_cart_pole::{BROKEN_HZ, CartPole, pole_angle};
use ratelab_study::experiment::sweep::{Cell, CellResult, Sweep, all_cores};

use crate::{
    cliff::SEEDS,
    framework::{
        Answer, Brief, Exercise, ExerciseKind, Failure, Findings, Measurement, Range, Table,
        Tolerance, axis, cart_pole, push_age_ms,
    },
};

/// Queue depths to compare (messages).
const DEPTHS: [usize; 2] = [1, 100];

/// The knob that sets both queues.
const DEPTH: &str = "queue-depth";

/// See [the module](self).
pub struct DeeperQueue;

const BRIEF: Brief = Brief {
    number: 2,
    part: "",
    name: "deeper-queue",
    title: "A deeper queue",
    kind: ExerciseKind::Investigation,
    objective: "At 5 Hz the policy reads one reading in ten; the others are pushed out of a queue \
                of one message before anyone saw them, and counted as dropped. The obvious cure \
                is a queue that keeps them all. Both queues, 1 and 100 messages, run from three \
                starts; watch the drops, and the step at which the pole falls.",
    question: "With a queue of 100 messages, how many of the three runs stay up?",
    quantity: "runs up",
    unit: "",
    tolerance: Tolerance::Exact,
    range: Range {
        least: 0.0,
        most: SEEDS.len() as f64,
        whole: true,
    },
    choices: &[],
};

impl Exercise for DeeperQueue {
    fn brief(&self) -> &'static Brief {
        &BRIEF
    }

    fn measure(&self, _seed: u64) -> Result<Findings, Failure> {
        let broken = CartPole::config(&format!("control-hz {BROKEN_HZ}"))?;
        let sweep = Sweep {
            axes: vec![axis(DEPTH, &DEPTHS)?],
            seeds: SEEDS.to_vec(),
            ..Sweep::of(cart_pole(), broken)
        };
        let swept = sweep.run(all_cores(), |_, _| ControlFlow::Continue(()))?;
        let runs: Vec<Run<'_>> = swept.finished().collect();
        let (shallow, deep) = runs.split_at(SEEDS.len());
        let balanced = deep.iter().filter(|(_, o)| !o.verdict.is_lost()).count();
        Ok(Findings {
            table: table(&runs),
            refuted: Vec::new(),
            answer: Answer::Exactly(balanced as f64),
            meaning: meaning(shallow, deep),
            measurements: measurements(shallow, deep),
        })
    }
}

/// One run and its result.
type Run<'s> = (Cell, &'s CellResult);

fn depth(cell: &Cell) -> &str {
    cell.value(DEPTH).unwrap_or_default()
}

/// The first topic with a reader is `/obs`.
fn obs_dropped(outcome: &CellResult) -> u64 {
    outcome.dropped.first().copied().unwrap_or_default()
}

fn table(runs: &[Run<'_>]) -> Table {
    let mut table = Table::new([
        "depth",
        "seed",
        "/obs dropped",
        "verdict",
        "steps",
        "push age",
    ]);
    for (cell, outcome) in runs {
        table.row([
            depth(cell).to_owned(),
            cell.seed.to_string(),
            obs_dropped(outcome).to_string(),
            outcome.verdict.name().to_owned(),
            outcome.steps.to_string(),
            format!("{:.1} ms", push_age_ms([*outcome].into_iter())),
        ]);
    }
    table
}

fn drops(runs: &[Run<'_>]) -> u64 {
    runs.iter().map(|(_, outcome)| obs_dropped(outcome)).sum()
}

/// Number of starts with identical runs for both queue depths.
fn unchanged(shallow: &[Run<'_>], deep: &[Run<'_>]) -> usize {
    let course = |outcome: &CellResult| {
        let angle = pole_angle(&outcome.state).to_bits();
        (outcome.steps, outcome.verdict, angle)
    };
    let pairs = shallow.iter().zip(deep);
    let same = pairs.filter(|((_, one), (_, other))| course(one) == course(other));
    same.count()
}

fn meaning(shallow: &[Run<'_>], deep: &[Run<'_>]) -> String {
    format!(
        "The deeper queue took the drops from {} to {}, and in {} of {} runs it changed nothing \
         else: the same last step, the same angle to the last bit. The policy reads the newest \
         reading either way, and decides as rarely. Drops were the symptom; a delivery that loses \
         nothing is not a controller that is faster.",
        drops(shallow),
        drops(deep),
        unchanged(shallow, deep),
        deep.len(),
    )
}

fn measurements(shallow: &[Run<'_>], deep: &[Run<'_>]) -> Vec<Measurement> {
    let mut measured = Vec::new();
    for (cell, outcome) in shallow.iter().chain(deep) {
        let name = |what| format!("depth {}, seed {}: {what}", depth(cell), cell.seed);
        let balanced = u32::from(!outcome.verdict.is_lost());
        measured.extend([
            Measurement::new(name("/obs dropped"), obs_dropped(outcome) as f64),
            Measurement::new(name("balanced"), balanced),
            Measurement::new(name("steps"), outcome.steps as f64),
        ]);
    }
    let same = unchanged(shallow, deep) as f64;
    measured.push(Measurement::new("runs that the depth did not change", same));
    measured
}
