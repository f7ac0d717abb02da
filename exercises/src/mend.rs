//! The clock that ties: a wrong line, to be mended.

use ratelab::Time;
use ratelab_cart_pole::{CONTROL_HZ, CartPole};
use ratelab_study::experiment::Config;

use crate::{
    framework::{Answer, Failure, Findings, Measurement, Table, asked},
    ties::{TimedRun, nodes},
};

/// Rates of the policy (Hz).
const RATES: [u64; 8] = [50, 30, 25, 20, 15, 12, 10, 7];

/// The rate of the question (Hz).
const ASKED: u64 = 30;

pub(crate) fn measure() -> Result<Findings, Failure> {
    let pairs = RATES.map(ClockPair::run);
    let pairs = pairs.into_iter().collect::<Result<Vec<_>, _>>()?;
    let asked = asked(&pairs, |pair| pair.hz == ASKED)?;
    Ok(Findings {
        table: table(&pairs),
        answer: Answer::Exactly(asked.lab.latency_ms),
        meaning: meaning(&pairs),
        measurements: pairs.iter().flat_map(ClockPair::measurements).collect(),
    })
}

/// One run on the clock of the exercise and on the lab's.
struct ClockPair {
    hz: u64,
    clock: TimedRun,
    lab: TimedRun,
}

impl ClockPair {
    fn run(hz: u64) -> Result<Self, Failure> {
        let config = CartPole::config(&format!("control-hz {hz}"))?;
        Ok(Self {
            hz,
            clock: on_the_clock(&config, hz)?,
            lab: TimedRun::exact(&config)?,
        })
    }

    fn differs(&self) -> bool {
        let bits = |run: &TimedRun| (run.latency_ms.to_bits(), run.steps);
        bits(&self.clock) != bits(&self.lab)
    }

    fn measurements(&self) -> [Measurement; 2] {
        Measurement::of(
            format_args!("{} Hz, the lab", self.hz),
            [
                ("mean latency (ms)", self.lab.latency_ms),
                ("steps", self.lab.steps as f64),
            ],
        )
    }
}

/// A run on the clock of the exercise.
fn on_the_clock(config: &Config, control_hz: u64) -> Result<TimedRun, Failure> {
    let plant_hz = CONTROL_HZ as u64;
    nodes::run(config.seed, |nodes| {
        let mut failure = None;
        let rates = [plant_hz, control_hz, plant_hz];
        mend_it::run(rates, config.end.as_nanos(), |node, now| {
            nodes
                .tick(node, Time::from_nanos(now))
                .unwrap_or_else(|error| {
                    failure = Some(error);
                    false
                })
        });
        failure.map_or(Ok(()), Err)
    })
}

fn table(pairs: &[ClockPair]) -> Table {
    let sign = |pair: &ClockPair| if pair.differs() { "✖" } else { "✓" }.to_owned();
    Table::of(
        pairs,
        &[
            ("control", &|pair| format!("{} Hz", pair.hz)),
            ("this clock", &|pair| pair.clock.latency()),
            ("the lab's", &|pair| pair.lab.latency()),
            ("reading age", &|pair| pair.clock.reading_age()),
            ("in the lab", &|pair| pair.lab.reading_age()),
            ("", &sign),
        ],
    )
}

fn meaning(pairs: &[ClockPair]) -> String {
    let wrong = pairs.iter().filter(|pair| pair.differs());
    let wrong: Vec<String> = wrong.map(|pair| pair.hz.to_string()).collect();
    if wrong.is_empty() {
        return "Mended: at every rate this clock does what the lab's does. Whole nanoseconds \
                alone were not enough; they have to be rounded last, not first."
            .to_owned();
    }
    format!(
        "Not mended yet: at {} Hz this clock differs. Readings are older there than in the lab, so \
         the policy ticks before the sensor with which it ought to tie. What have these rates in \
         common, and the others not? Read exercises/mend/src/clock.rs, mend its wrong line, and \
         run cargo test -p mend-it; then cargo run -- exercise 12 shows this table again.",
        wrong.join(", "),
    )
}
