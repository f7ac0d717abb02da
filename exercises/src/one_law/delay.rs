//! Which delay fells the pole at a control rate.

use crate::framework::{
    Answer, Failure, Findings, KnobRuns, Measurement, PredictionPlace, Table, edge, own_world,
    survey,
};

/// Delays of `/action` (ms).
const DELAYS: [u32; 11] = [0, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100];

/// Starts for each delay.
const STARTS: u64 = 6;

/// Returns the first question.
pub(crate) fn at_50_hz() -> Result<Findings, Failure> {
    at(
        50.0,
        "A push is older than its delay, as it is held until the next one is applied: see the push \
         age.",
    )
}

/// Returns the second question.
pub(crate) fn at_25_hz() -> Result<Findings, Failure> {
    at(
        25.0,
        "At 25 Hz the same delay does more harm: every push is 10 ms older. Compare the push ages \
         of both tables, not the delays.",
    )
}

fn at(hz: f64, meaning: &str) -> Result<Findings, Failure> {
    let base = own_world(&format!("rate actuator 500, control-hz {hz}"))?;
    let delays = survey(base, "link /action delay:{}", DELAYS, STARTS)?;
    let (held, failed) = edge(&delays, KnobRuns::all_up)?;
    Ok(Findings {
        table: table(&delays),
        place: PredictionPlace::Between,
        answer: Answer::Between {
            from: held.number(),
            to: failed.number(),
        },
        meaning: format!(
            "At {} ms every start stayed up, with a push age of {:.0} ms; at {} ms {} did, with \
             {:.0} ms. {meaning}",
            held.value,
            held.push_age_ms(),
            failed.value,
            failed.up_of(),
            failed.push_age_ms(),
        ),
        measurements: delays.iter().flat_map(measurements).collect(),
    })
}

fn table(delays: &[KnobRuns]) -> Table {
    Table::from_items(
        delays,
        &[
            ("delay", &|delay| format!("{} ms", delay.value)),
            ("balanced", &KnobRuns::up_of),
            ("push age", &KnobRuns::push_age),
        ],
    )
}

fn measurements(delay: &KnobRuns) -> [Measurement; 2] {
    Measurement::list(
        format_args!("{} ms", delay.value),
        [
            ("starts balanced", delay.up() as f64),
            ("push age (ms)", delay.push_age_ms()),
        ],
    )
}
