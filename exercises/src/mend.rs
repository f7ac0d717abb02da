//! The clock that ties: a wrong line, to be mended.

use ratelab::{Hz, Time};
use ratelab_cart_pole::CONTROL_HZ;

use crate::{
    framework::{Answer, Failure, Findings, Measurement, PredictionPlace, Table, asked},
    ties::{Nodes, Pair, TimedRun},
};

/// Rates of the policy, in whole numbers (Hz).
const RATES: [f64; 8] = [50.0, 30.0, 25.0, 20.0, 15.0, 12.0, 10.0, 7.0];

/// The rate of the question (Hz).
const ASKED: f64 = 30.0;

pub(crate) fn measure() -> Result<Findings, Failure> {
    let pairs = Pair::for_rates(&RATES, schedule)?;
    let asked = asked(&pairs, |pair| pair.hz.get() == ASKED)?;
    Ok(Findings {
        table: table(&pairs),
        place: PredictionPlace::Column(2),
        answer: Answer::Exactly(asked.exact.latency_ms),
        meaning: meaning(&pairs),
        measurements: pairs.iter().flat_map(measurements).collect(),
    })
}

/// Ticks the nodes on the clock of the exercise, with the policy at `control`, up to `end`.
fn schedule(nodes: &mut Nodes, control: Hz, end: Time) -> Result<(), Failure> {
    let mut failure = None;
    let rates = [CONTROL_HZ, control.get(), CONTROL_HZ].map(|hz| hz as u64);
    mend_it::run(rates, end.as_nanos(), |node, now| {
        let ticked = nodes.tick(node, Time::from_nanos(now));
        ticked.unwrap_or_else(|error| {
            failure = Some(error);
            false
        })
    });
    failure.map_or(Ok(()), Err)
}

/// Returns whether the clock of the exercise does something else than the lab's.
fn differs(pair: &&Pair) -> bool {
    let bits = |run: &TimedRun| (run.latency_ms.to_bits(), run.steps);
    bits(&pair.other) != bits(&pair.exact)
}

fn measurements(pair: &Pair) -> [Measurement; 2] {
    Measurement::list(
        format_args!("{}, the lab", pair.hz),
        [
            ("mean latency (ms)", pair.exact.latency_ms),
            ("steps", pair.exact.steps as f64),
        ],
    )
}

fn table(pairs: &[Pair]) -> Table {
    let sign = |pair: &Pair| if differs(&pair) { "✖" } else { "✓" }.to_owned();
    Table::from_items(
        pairs,
        &[
            ("control", &|pair| pair.hz.to_string()),
            ("this clock", &|pair| pair.other.latency()),
            ("the lab's", &|pair| pair.exact.latency()),
            ("reading age", &|pair| pair.other.reading_age()),
            ("in the lab", &|pair| pair.exact.reading_age()),
            ("", &sign),
        ],
    )
}

fn meaning(pairs: &[Pair]) -> String {
    let wrong: Vec<String> = pairs
        .iter()
        .filter(differs)
        .map(|pair| pair.hz.get().to_string())
        .collect();
    if wrong.is_empty() {
        return "Mended: at every rate this clock does what the lab's does. Whole nanoseconds \
                alone were not enough; they have to be rounded last, not first."
            .to_owned();
    }
    format!(
        "Not mended yet: at {} Hz this clock differs. Readings are older there than in the lab, so \
         the policy ticks before the sensor that should tick at the same instant. What do these \
         rates have in common? Read exercises/mend/src/clock.rs, mend its wrong line, and \
         run cargo test -p mend-it; then cargo run -- exercise 12 shows this table again.",
        wrong.join(", "),
    )
}
