//! The push age at which the pole falls, for several causes together and for one alone.

use std::sync::Arc;

use ratelab_study::experiment::sweep::ByAge;

use super::causes::AgeCause;
use crate::framework::{
    Answer, Brief, Exercise, ExerciseKind, Failure, Findings, Measurement, Range, Table, Tolerance,
};

/// Width of the rows of the table (ms).
const BIN_MS: f64 = 20.0;

const RANGE: Range = Range {
    least: 0.0,
    most: 1_000.0,
    whole: false,
};

/// The third question: one number for five causes.
pub const LAW: Law = Law(&Brief {
    number: 6,
    part: "c",
    name: "one-law",
    title: "One law: one number",
    kind: ExerciseKind::PredictThenRun,
    objective: "Now a thousand runs, 200 each of five causes: a slow policy, a constant delay, \
                random losses, a slow policy that ticks long after the sensor (a phase), and a \
                policy that thinks. How slow, how late, how much is lost, and the start, are \
                drawn at random. All that is kept of a run is its push age in the last second, \
                and whether the pole was up. The lab shows a limit beside the age: do all five \
                keep to it? This takes some seconds.",
    question: "From which push age on does the pole fall, whatever made it old?",
    quantity: "push age",
    unit: "ms",
    tolerance: Tolerance::Within(10.0),
    range: RANGE,
    choices: &[],
});

/// The fourth question: the cause that breaks the law.
pub const JITTER: JitterLaw = JitterLaw(&Brief {
    number: 6,
    part: "d",
    name: "one-law-jitter",
    title: "One law: where it fails",
    kind: ExerciseKind::PredictThenRun,
    objective: "A sixth cause: jitter. Each action is delayed by another time, at random between \
                nothing and up to 600 ms, so that one overtakes the other; an action that comes \
                after a newer one is never read. Again 200 runs are drawn, and of each the push \
                age in the last second is kept. By the law the pole falls at the same age as with \
                a constant delay, 0 ms earlier.",
    question: "At how much younger pushes does jitter fell the pole than a constant delay?",
    quantity: "younger by",
    unit: "ms",
    tolerance: Tolerance::Within(7.0),
    range: RANGE,
    choices: &[],
});

/// See [`LAW`].
pub struct Law(&'static Brief);

/// See [`JITTER`].
pub struct JitterLaw(&'static Brief);

/// The runs of a cause.
struct OfCause {
    cause: AgeCause,
    runs: Arc<ByAge>,
}

impl OfCause {
    fn of(cause: AgeCause, seed: u64) -> Result<Self, Failure> {
        let runs = cause.by_age(seed)?;
        Ok(Self { cause, runs })
    }

    /// The age that has the fewest of its runs on the wrong side (ms).
    fn limit_ms(&self) -> f64 {
        self.runs.split().map_or(f64::NAN, |split| split.at_s * 1e3)
    }

    fn wrong(&self, limit_ms: f64) -> usize {
        self.runs.misjudged_at(limit_ms / 1e3)
    }

    /// Such as `3 of 17`, for each range of ages; the last one is open.
    fn cells(&self) -> [String; 4] {
        let cell = |from_ms: f64, to_ms: f64| {
            let inside = |age: f64| (from_ms..to_ms).contains(&(age * 1e3));
            let ages: Vec<bool> = self
                .runs
                .runs()
                .filter(|(age, _)| inside(*age))
                .map(|(_, up)| up)
                .collect();
            let up = ages.iter().filter(|up| **up).count();
            format!("{up} of {}", ages.len())
        };
        [
            cell(0.0, 80.0 - BIN_MS),
            cell(80.0 - BIN_MS, 80.0),
            cell(80.0, 80.0 + BIN_MS),
            cell(80.0 + BIN_MS, f64::INFINITY),
        ]
    }

    fn row(&self, table: &mut Table, limit_ms: f64) {
        let [a, b, c, d] = self.cells();
        table.row([
            self.cause.name().to_owned(),
            a,
            b,
            c,
            d,
            format!("{:.0} ms", self.limit_ms()),
            format!("{} of {}", self.wrong(limit_ms), self.runs.len()),
        ]);
    }

    fn measurements(&self, limit_ms: f64) -> [Measurement; 2] {
        let name = |what| format!("{}: {what}", self.cause.name());
        [
            Measurement::new(name("limit of its own (ms)"), self.limit_ms()),
            Measurement::new(name("runs on the wrong side"), self.wrong(limit_ms) as f64),
        ]
    }
}

fn lawful(seed: u64) -> Result<Vec<OfCause>, Failure> {
    let causes = AgeCause::LAWFUL.into_iter();
    causes.map(|cause| OfCause::of(cause, seed)).collect()
}

/// The age that has the fewest of all runs on the wrong side (ms).
fn limit_ms(causes: &[OfCause]) -> Result<f64, Failure> {
    let all: ByAge = causes.iter().flat_map(|of| of.runs.runs()).collect();
    let split = all.split();
    let split = split.ok_or_else(|| Failure::Unmeasured("all runs ended alike".to_owned()))?;
    Ok(split.at_s * 1e3)
}

fn table() -> Table {
    Table::new([
        "cause",
        "up below 60",
        "60 to 80",
        "80 to 100",
        "above",
        "own limit",
        "wrong side",
    ])
}

impl Exercise for Law {
    fn brief(&self) -> &'static Brief {
        self.0
    }

    fn draws(&self) -> bool {
        true
    }

    fn measure(&self, seed: u64) -> Result<Findings, Failure> {
        let causes = lawful(seed)?;
        let limit = limit_ms(&causes)?;
        let runs: usize = causes.iter().map(|of| of.runs.len()).sum();
        let wrong: usize = causes.iter().map(|of| of.wrong(limit)).sum();
        let mut table = table();
        causes.iter().for_each(|of| of.row(&mut table, limit));
        let mut measurements = vec![
            Measurement::new("limit of all (ms)", limit),
            Measurement::new("runs", runs as f64),
            Measurement::new("runs on the wrong side", wrong as f64),
        ];
        measurements.extend(causes.iter().flat_map(|of| of.measurements(limit)));
        Ok(Findings {
            table,
            refuted: Vec::new(),
            answer: Answer::Exactly(limit.round()),
            meaning: format!(
                "One number tells {} of {runs} runs apart, and asks of none what made it old: \
                 below {limit:.0} ms the pole stands, above it falls. Nothing in the loop sees a \
                 rate, a delay or a loss; what it feels is how old the reading is on which it \
                 acts. The rate of exercise 1 was never the cause, only one way to grow old.",
                runs - wrong,
            ),
            measurements,
        })
    }

    fn next_part(&self) -> Option<&'static dyn Exercise> {
        Some(&JITTER)
    }
}

impl Exercise for JitterLaw {
    fn brief(&self) -> &'static Brief {
        self.0
    }

    fn draws(&self) -> bool {
        true
    }

    fn measure(&self, seed: u64) -> Result<Findings, Failure> {
        let causes = lawful(seed)?;
        let limit = limit_ms(&causes)?;
        let jitter = OfCause::of(AgeCause::Jitter, seed)?;
        let mut table = table();
        let rows = causes.iter().chain([&jitter]);
        rows.for_each(|of| of.row(&mut table, limit));
        let delay = causes.iter().find(|of| of.cause == AgeCause::Delay);
        let constant = delay.map_or(f64::NAN, OfCause::limit_ms);
        let (own, earlier) = (jitter.limit_ms(), constant - jitter.limit_ms());
        let mut measurements = jitter.measurements(limit).to_vec();
        measurements.push(Measurement::new("earlier than a delay (ms)", earlier));
        Ok(Findings {
            table,
            refuted: Vec::new(),
            answer: Answer::Exactly(earlier.round()),
            meaning: format!(
                "A constant delay fells the pole from {constant:.0} ms on, jitter from {own:.0} \
                 ms. A mean hides what decides: the oldest stretch of the run. Where the delay \
                 changes from one message to the next, a few old pushes in a row are enough, and \
                 the fresh ones between them lower the mean and save nothing. Losses, random as \
                 well, are low in the table for the same reason. So a law about a mean is a law \
                 about steady causes: a delay that you can rely on is worth more than one that is \
                 often short.",
            ),
            measurements,
        })
    }
}
