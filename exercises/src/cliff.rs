//! The control-rate cliff: slow the policy until the pole falls.

use ratelab_experiment::Config;

use crate::framework::{
    Answer, Failure, Findings, KnobRuns, Measurement, PredictionPlace, Table, edge, mean_ms, survey,
};

/// The rates of the policy, downwards (Hz).
const RATES: [f64; 10] = [50.0, 25.0, 20.0, 15.0, 10.0, 9.0, 8.0, 7.0, 6.0, 5.0];

/// Starts for each rate.
pub(crate) const STARTS: u64 = 3;

pub(crate) fn measure() -> Result<Findings, Failure> {
    let rates = survey(Config::default(), "control-hz", RATES, STARTS)?;
    let (held, fell) = edge(&rates, KnobRuns::all_up)?;
    Ok(Findings {
        table: table(&rates),
        place: PredictionPlace::Between,
        answer: Answer::Between {
            from: held.number(),
            to: fell.number(),
        },
        meaning: format!(
            "At {held_hz} Hz every start stayed up, at {fell_hz} Hz {} of {} did. The cliff is \
             somewhere in between; no rate that was tried says where. The warning came before \
             the fall: from {} Hz down to {held_hz} Hz nothing fell, but the push age rose from \
             {} to {}.",
            fell.up(),
            fell.runs.len(),
            RATES[0],
            rates[0].push_age(),
            held.push_age(),
            held_hz = held.value,
            fell_hz = fell.value,
        ),
        measurements: measurements(&rates),
    })
}

fn table(rates: &[KnobRuns]) -> Table {
    let steps = |rate: &KnobRuns| {
        rate.runs
            .iter()
            .map(|run| run.steps.to_string())
            .collect::<Vec<_>>()
            .join(" ")
    };
    Table::from_items(
        rates,
        &[
            ("control", &|rate| format!("{} Hz", rate.value)),
            ("balanced", &KnobRuns::up_of),
            ("steps", &steps),
            ("push age", &KnobRuns::push_age),
        ],
    )
}

fn measurements(rates: &[KnobRuns]) -> Vec<Measurement> {
    let mut measured = Vec::new();
    for rate in rates {
        let hz = format!("{} Hz", rate.value);
        measured.push(rate.balanced(&hz));
        for (seed, run) in rate.runs.iter().enumerate() {
            let figures = [
                ("steps", run.steps as f64),
                ("mean latency (ms)", mean_ms(run.mean_latency_s)),
            ];
            measured.extend(Measurement::list(
                format_args!("{hz}, seed {seed}"),
                figures,
            ));
        }
    }
    let latency = |rate: &KnobRuns| -> f64 {
        rate.runs
            .iter()
            .map(|run| mean_ms(run.mean_latency_s))
            .sum()
    };
    let rises = rates
        .windows(2)
        .filter(|pair| latency(&pair[1]) > latency(&pair[0]));
    let name = "steps down at which latency rose";
    measured.push(Measurement::new(name, rises.count() as f64));
    measured
}
