//! A deeper queue: no more losses, and the same fall.

use std::ops::ControlFlow;

use ratelab::{
    experiment::{
        BROKEN_HZ, Config,
        sweep::{Cell, CellResult, Sweep, all_cores},
    },
    runtime::Depth,
};

use crate::{
    cliff::SEEDS,
    framework::{
        Answer, Brief, Exercise, Failure, Findings, Kind, Measurement, Range, Table, hz, mean_ms,
    },
};

/// The queues to compare (messages).
const DEPTHS: [usize; 2] = [1, 100];

/// See [the module](self).
pub struct DeeperQueue;

const BRIEF: Brief = Brief {
    number: 2,
    name: "deeper-queue",
    title: "A deeper queue",
    kind: Kind::Investigation,
    objective: "At 5 Hz the policy reads one reading in ten; the others are pushed out of a queue \
                of one message before anyone saw them, and counted as dropped. The obvious cure \
                is a queue that keeps them all. Both queues, 1 and 100 messages, run from three \
                starts; watch the drops, and the step at which the pole falls.",
    question: "With a queue of 100 messages, how many of the three runs stay up?",
    unit: "",
    range: Range {
        least: 0.0,
        most: SEEDS.len() as f64,
        whole: true,
    },
};

impl Exercise for DeeperQueue {
    fn brief(&self) -> &'static Brief {
        &BRIEF
    }

    fn run(&self) -> Result<Findings, Failure> {
        let depths = DEPTHS.into_iter().map(Depth::new);
        let sweep = Sweep {
            control_hz: hz(&[BROKEN_HZ])?,
            queue_depths: depths.collect::<Result<_, _>>()?,
            seeds: SEEDS.to_vec(),
            ..Sweep::of(Config::default())
        };
        let swept = sweep.run(all_cores(), |_, _| ControlFlow::Continue(()))?;
        let cells: Vec<(Cell, CellResult)> = swept.finished().map(|(c, o)| (c, *o)).collect();
        let (shallow, deep) = cells.split_at(SEEDS.len());
        let balanced = deep.iter().filter(|(_, o)| o.verdict.balanced()).count();
        Ok(Findings {
            table: table(&cells),
            answer: Answer::Exactly(balanced as f64),
            meaning: meaning(shallow, deep),
            measurements: measurements(shallow, deep),
        })
    }
}

fn table(cells: &[(Cell, CellResult)]) -> Table {
    let mut table = Table::new([
        "depth",
        "seed",
        "/obs dropped",
        "verdict",
        "steps",
        "latency",
    ]);
    for (cell, outcome) in cells {
        table.row([
            cell.queue_depth.to_string(),
            cell.seed.to_string(),
            outcome.obs_dropped.to_string(),
            outcome.verdict.name().to_owned(),
            outcome.steps.to_string(),
            format!("{:.1} ms", mean_ms(outcome.mean_latency_s)),
        ]);
    }
    table
}

fn drops(cells: &[(Cell, CellResult)]) -> u64 {
    cells.iter().map(|(_, outcome)| outcome.obs_dropped).sum()
}

/// Starts whose run took the same course under both queues.
fn unchanged(shallow: &[(Cell, CellResult)], deep: &[(Cell, CellResult)]) -> usize {
    let pairs = shallow.iter().zip(deep);
    let same = |a: &CellResult, b: &CellResult| {
        (a.steps, a.verdict, a.final_pole_angle.to_bits())
            == (b.steps, b.verdict, b.final_pole_angle.to_bits())
    };
    pairs.filter(|((_, a), (_, b))| same(a, b)).count()
}

fn meaning(shallow: &[(Cell, CellResult)], deep: &[(Cell, CellResult)]) -> String {
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

fn measurements(shallow: &[(Cell, CellResult)], deep: &[(Cell, CellResult)]) -> Vec<Measurement> {
    let mut measured = Vec::new();
    for (cell, outcome) in shallow.iter().chain(deep) {
        let run = format!("depth {}, seed {}", cell.queue_depth, cell.seed);
        let balanced = u32::from(outcome.verdict.balanced());
        measured.extend([
            Measurement::new(format!("{run}: /obs dropped"), outcome.obs_dropped as f64),
            Measurement::new(format!("{run}: balanced"), balanced),
            Measurement::new(format!("{run}: steps"), outcome.steps as f64),
        ]);
    }
    let same = unchanged(shallow, deep) as f64;
    measured.push(Measurement::new("runs that the depth did not change", same));
    measured
}
