//! The control-rate cliff: slow the policy until the pole falls.

use std::ops::ControlFlow;

use ratelab_study::experiment::{
    Config,
    sweep::{Cell, CellResult, Sweep, all_cores},
};

use crate::framework::{
    Answer, Brief, Exercise, ExerciseKind, Failure, Findings, Measurement, Range, Table, Tolerance,
    axis, cart_pole, mean_ms, push_age_ms,
};

/// The rates of the policy, downwards (Hz).
const RATES: [f64; 10] = [50.0, 25.0, 20.0, 15.0, 10.0, 9.0, 8.0, 7.0, 6.0, 5.0];

/// Seeds of the starts.
pub(crate) const SEEDS: [u64; 3] = [0, 1, 2];

/// See [the module](self).
pub struct Cliff;

const BRIEF: Brief = Brief {
    number: 1,
    part: "",
    name: "cliff",
    title: "The control-rate cliff",
    kind: ExerciseKind::PredictThenRun,
    objective: "Sensor and plant keep their 50 Hz; only the policy is slowed, through 50, 25, 20, \
                15, 10, 9, 8, 7, 6 and 5 Hz. Between its decisions the actuator holds the last \
                one. Each rate runs for ten seconds from three starts, and for each you see \
                whether the pole stayed up and the push age: how old, on average over the last \
                second, the reading was behind the push in force.",
    question: "At which control rate does the pole first fail to stay up?",
    quantity: "control rate",
    unit: "Hz",
    tolerance: Tolerance::Between,
    range: Range {
        least: 0.0,
        most: RATES[0],
        whole: false,
    },
    choices: &[],
};

impl Exercise for Cliff {
    fn brief(&self) -> &'static Brief {
        &BRIEF
    }

    fn measure(&self, _seed: u64) -> Result<Findings, Failure> {
        let sweep = Sweep {
            axes: vec![axis("control-hz", &RATES)?],
            seeds: SEEDS.to_vec(),
            ..Sweep::of(cart_pole(), Config::default())
        };
        let swept = sweep.run(all_cores(), |_, _| ControlFlow::Continue(()))?;
        let cells: Vec<(Cell, &CellResult)> = swept.finished().collect();
        let rates = RATES.iter().zip(cells.chunks(SEEDS.len()));
        let rates: Vec<RateResult> = rates
            .map(|(hz, cells)| RateResult::of(*hz, cells))
            .collect();
        let turn = turn(&rates)?;
        Ok(Findings {
            table: table(&rates),
            refuted: Vec::new(),
            answer: Answer::Between {
                from: turn.held.hz,
                to: turn.fell.hz,
            },
            meaning: turn.meaning(&rates),
            measurements: measurements(&rates),
        })
    }
}

/// The results of one rate, over all starts.
struct RateResult {
    hz: f64,
    balanced: usize,
    seeds: Vec<u64>,
    steps: Vec<u64>,
    latencies_ms: Vec<f64>,
    /// The mean push age of the last second, over all starts.
    push_age_ms: f64,
}

impl RateResult {
    fn of(hz: f64, cells: &[(Cell, &CellResult)]) -> Self {
        let outcomes = || cells.iter().map(|(_, outcome)| outcome);
        Self {
            hz,
            balanced: outcomes().filter(|o| !o.verdict.is_lost()).count(),
            seeds: cells.iter().map(|(cell, _)| cell.seed).collect(),
            steps: outcomes().map(|o| o.steps).collect(),
            latencies_ms: outcomes().map(|o| mean_ms(o.mean_latency_s)).collect(),
            push_age_ms: push_age_ms(outcomes().copied()),
        }
    }

    fn latency_ms(&self) -> f64 {
        self.latencies_ms.iter().sum::<f64>() / self.latencies_ms.len() as f64
    }
}

/// The two rates between which the result changes.
struct CliffEdge<'a> {
    held: &'a RateResult,
    fell: &'a RateResult,
}

fn turn(rates: &[RateResult]) -> Result<CliffEdge<'_>, Failure> {
    let fell = rates.iter().position(|rate| rate.balanced < SEEDS.len());
    let pair = fell.and_then(|fell| Some((rates.get(fell)?, rates.get(fell.checked_sub(1)?)?)));
    pair.map(|(fell, held)| CliffEdge { held, fell })
        .ok_or_else(|| Failure::Unmeasured("no rate held and then fell".to_owned()))
}

impl CliffEdge<'_> {
    fn meaning(&self, rates: &[RateResult]) -> String {
        let first = rates.first().map_or(f64::NAN, |rate| rate.push_age_ms);
        format!(
            "At {} Hz every start stayed up, at {} Hz {} of {} did: it turns somewhere in \
             between, and no rate tried says where. The warning came before the fall: on the way \
             from {} Hz to {} Hz nothing fell, yet the push age rose from {first:.1} ms to {:.1} \
             ms.",
            self.held.hz,
            self.fell.hz,
            self.fell.balanced,
            SEEDS.len(),
            RATES[0],
            self.held.hz,
            self.held.push_age_ms,
        )
    }
}

fn table(rates: &[RateResult]) -> Table {
    let mut table = Table::new(["control", "balanced", "steps", "push age"]);
    for rate in rates {
        let steps: Vec<String> = rate.steps.iter().map(u64::to_string).collect();
        table.row([
            format!("{} Hz", rate.hz),
            format!("{} of {}", rate.balanced, rate.steps.len()),
            steps.join(" "),
            format!("{:.1} ms", rate.push_age_ms),
        ]);
    }
    table
}

fn measurements(rates: &[RateResult]) -> Vec<Measurement> {
    let mut measured = Vec::new();
    for rate in rates {
        let name = format!("{} Hz: starts balanced", rate.hz);
        measured.push(Measurement::new(name, rate.balanced as f64));
    }
    for rate in rates {
        let runs = rate.seeds.iter().zip(&rate.steps).zip(&rate.latencies_ms);
        for ((seed, steps), latency_ms) in runs {
            let run = format!("{} Hz, seed {seed}", rate.hz);
            let steps = Measurement::new(format!("{run}: steps"), *steps as f64);
            let latency = Measurement::new(format!("{run}: mean latency (ms)"), *latency_ms);
            measured.extend([steps, latency]);
        }
    }
    let rises = rates
        .windows(2)
        .filter(|pair| pair[1].latency_ms() > pair[0].latency_ms());
    let name = "steps down at which latency rose";
    measured.push(Measurement::new(name, rises.count() as f64));
    measured
}
