//! The push age at which the pole falls, for several causes together and for one alone.

use std::sync::Arc;

use ratelab_experiment::sweep::ByAge;

use super::causes::AgeCause;
use crate::framework::{Answer, Failure, Findings, Measurement, PredictionPlace, Table, asked};

/// The runs of a cause.
struct OfCause {
    cause: AgeCause,
    runs: Arc<ByAge>,
}

impl OfCause {
    fn measure(cause: AgeCause, seed: u64) -> Result<Self, Failure> {
        let runs = cause.by_age(seed)?;
        Ok(Self { cause, runs })
    }

    /// Returns the age that has the fewest of its runs on the wrong side (ms).
    fn limit_ms(&self) -> f64 {
        self.runs.split().map_or(f64::NAN, |split| split.at_s * 1e3)
    }

    fn wrong(&self, limit_ms: f64) -> usize {
        self.runs.misjudged_at(limit_ms / 1e3)
    }

    /// Returns how many of its runs with ages in this range stayed up, such as `3 of 17`.
    fn up(&self, from_ms: f64, to_ms: f64) -> String {
        let inside = |age: f64| (from_ms..to_ms).contains(&(age * 1e3));
        let runs: Vec<(f64, bool)> = self.runs.runs().filter(|(age, _)| inside(*age)).collect();
        let up = runs.iter().filter(|(_, up)| *up).count();
        format!("{up} of {}", runs.len())
    }

    fn measurements(&self, limit_ms: f64) -> [Measurement; 2] {
        Measurement::list(
            self.cause.name(),
            [
                ("limit of its own (ms)", self.limit_ms()),
                ("runs on the wrong side", self.wrong(limit_ms) as f64),
            ],
        )
    }
}

fn lawful(seed: u64) -> Result<Vec<OfCause>, Failure> {
    AgeCause::LAWFUL
        .into_iter()
        .map(|cause| OfCause::measure(cause, seed))
        .collect()
}

/// Returns the age that has the fewest of all runs on the wrong side (ms).
fn limit_ms(causes: &[OfCause]) -> Result<f64, Failure> {
    let all: ByAge = causes.iter().flat_map(|of| of.runs.runs()).collect();
    let split = all
        .split()
        .ok_or_else(|| Failure::Unmeasured("all runs ended alike".to_owned()))?;
    Ok(split.at_s * 1e3)
}

/// Returns a row for each of `causes`.
fn table(causes: &[OfCause], limit_ms: f64) -> Table {
    let wrong = |of: &OfCause| format!("{} of {}", of.wrong(limit_ms), of.runs.len());
    Table::from_items(
        causes,
        &[
            ("cause", &|of| of.cause.name().to_owned()),
            ("up below 60", &|of| of.up(0.0, 60.0)),
            ("60 to 80", &|of| of.up(60.0, 80.0)),
            ("80 to 100", &|of| of.up(80.0, 100.0)),
            ("above", &|of| of.up(100.0, f64::INFINITY)),
            ("own limit", &|of| format!("{:.0} ms", of.limit_ms())),
            ("wrong side", &wrong),
        ],
    )
}

/// Returns the third question: one number for five causes.
pub(crate) fn law(seed: u64) -> Result<Findings, Failure> {
    let causes = lawful(seed)?;
    let limit = limit_ms(&causes)?;
    let runs: usize = causes.iter().map(|of| of.runs.len()).sum();
    let wrong: usize = causes.iter().map(|of| of.wrong(limit)).sum();
    let mut measurements = vec![
        Measurement::new("limit of all (ms)", limit),
        Measurement::new("runs", runs as f64),
        Measurement::new("runs on the wrong side", wrong as f64),
    ];
    measurements.extend(causes.iter().flat_map(|of| of.measurements(limit)));
    Ok(Findings {
        table: table(&causes, limit),
        place: PredictionPlace::Column(5),
        answer: Answer::Exactly(limit.round()),
        meaning: format!(
            "One number is right about {} of {runs} runs: below {limit:.0} ms the pole stands, \
             above it falls, whatever the cause. The loop does not know the cause: only the age of \
             the reading behind a push counts. The rate of exercise 1 was one way to make pushes \
             old.",
            runs - wrong,
        ),
        measurements,
    })
}

/// Returns the fourth question: the cause that breaks the law.
pub(crate) fn jitter(seed: u64) -> Result<Findings, Failure> {
    let mut causes = lawful(seed)?;
    let limit = limit_ms(&causes)?;
    let jitter = OfCause::measure(AgeCause::Jitter, seed)?;
    let constant = asked(&causes, |of| of.cause == AgeCause::Delay)?.limit_ms();
    let own = jitter.limit_ms();
    let earlier = constant - own;
    let mut measurements = jitter.measurements(limit).to_vec();
    measurements.push(Measurement::new("earlier than a delay (ms)", earlier));
    causes.push(jitter);
    Ok(Findings {
        table: table(&causes, limit),
        place: PredictionPlace::Below,
        answer: Answer::Exactly(earlier.round()),
        meaning: format!(
            "The pole falls from {constant:.0} ms on with a constant delay, from {own:.0} ms on \
             with jitter. A mean hides what decides: the oldest part of the run. With jitter a few \
             old pushes in a row are enough; the fresh ones between them lower the mean and save \
             nothing. Losses, random as well, are low in the table for the same reason. So the law \
             is about steady causes: better a constant delay than one that is often short.",
        ),
        measurements,
    })
}
