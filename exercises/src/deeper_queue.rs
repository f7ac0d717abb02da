//! A deeper queue: no more losses, and the same fall.

use std::ops::ControlFlow;

use ratelab::{
    cartpole::{BROKEN_HZ, CartPole, pole_angle},
    experiment::sweep::{Cell, CellResult, Sweep, all_cores},
};

use crate::{
    cliff::SEEDS,
    framework::{
        Answer, Brief, Exercise, Failure, Findings, Kind, Measurement, Range, Table, axis,
        cart_pole, mean_ms,
    },
};

/// The queues to compare (messages).
const DEPTHS: [usize; 2] = [1, 100];

/// The knob that sets both queues.
const DEPTH: &str = "queue-depth";

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
        let broken = CartPole::config(&format!("control-hz {BROKEN_HZ}"))?;
        let sweep = Sweep {
            axes: vec![axis(DEPTH, &DEPTHS)?],
            seeds: SEEDS.to_vec(),
            ..Sweep::of(cart_pole(), broken)
        };
        let swept = sweep.run(all_cores(), |_, _| ControlFlow::Continue(()))?;
        let runs: Vec<Run> = swept.finished().map(|(c, o)| Run::of(&c, o)).collect();
        let (shallow, deep) = runs.split_at(SEEDS.len());
        let balanced = deep.iter().filter(|run| run.balanced).count();
        Ok(Findings {
            table: table(&runs),
            answer: Answer::Exactly(balanced as f64),
            meaning: meaning(shallow, deep),
            measurements: measurements(shallow, deep),
        })
    }
}

/// One run.
struct Run {
    depth: String,
    seed: u64,
    obs_dropped: u64,
    balanced: bool,
    verdict: &'static str,
    steps: u64,
    latency_ms: f64,
    /// The pole's last angle (rad), as bits.
    angle: u64,
}

impl Run {
    fn of(cell: &Cell, outcome: &CellResult) -> Self {
        Self {
            depth: cell.value(DEPTH).unwrap_or_default().to_owned(),
            seed: cell.seed,
            obs_dropped: outcome.dropped.first().copied().unwrap_or_default(),
            balanced: !outcome.verdict.is_lost(),
            verdict: outcome.verdict.name(),
            steps: outcome.steps,
            latency_ms: mean_ms(outcome.mean_latency_s),
            angle: pole_angle(&outcome.state).to_bits(),
        }
    }

    /// Whether both took the same course.
    fn is_like(&self, other: &Self) -> bool {
        (self.steps, self.verdict, self.angle) == (other.steps, other.verdict, other.angle)
    }
}

fn table(runs: &[Run]) -> Table {
    let mut table = Table::new([
        "depth",
        "seed",
        "/obs dropped",
        "verdict",
        "steps",
        "latency",
    ]);
    for run in runs {
        table.row([
            run.depth.clone(),
            run.seed.to_string(),
            run.obs_dropped.to_string(),
            run.verdict.to_owned(),
            run.steps.to_string(),
            format!("{:.1} ms", run.latency_ms),
        ]);
    }
    table
}

fn drops(runs: &[Run]) -> u64 {
    runs.iter().map(|run| run.obs_dropped).sum()
}

/// Starts whose run took the same course under both queues.
fn unchanged(shallow: &[Run], deep: &[Run]) -> usize {
    let pairs = shallow.iter().zip(deep);
    pairs.filter(|(one, other)| one.is_like(other)).count()
}

fn meaning(shallow: &[Run], deep: &[Run]) -> String {
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

fn measurements(shallow: &[Run], deep: &[Run]) -> Vec<Measurement> {
    let mut measured = Vec::new();
    for run in shallow.iter().chain(deep) {
        let name = |what| format!("depth {}, seed {}: {what}", run.depth, run.seed);
        measured.extend([
            Measurement::new(name("/obs dropped"), run.obs_dropped as f64),
            Measurement::new(name("balanced"), u32::from(run.balanced)),
            Measurement::new(name("steps"), run.steps as f64),
        ]);
    }
    let same = unchanged(shallow, deep) as f64;
    measured.push(Measurement::new("runs that the depth did not change", same));
    measured
}
