//! One law: the age of the pushes decides, whatever made them old.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex},
};

use ratelab::sync::lock;
use ratelab_experiment::{
    Config, Experiment,
    sweep::{ByAge, CellResult},
};
use ratelab_system::{StepMs, WorldKind};
use rayon::prelude::*;

use crate::framework::{
    Answer, Failure, Findings, KnobRuns, Measurement, PredictionPlace, SplitMix, Table, asked,
    cart_pole, edge, own_world, survey,
};

/// Delays of `/action` (ms).
const DELAYS: [u32; 11] = [0, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100];

/// Starts for each delay.
const STARTS_PER_DELAY: u64 = 6;

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
    let delays = survey(base, "link /action delay:{}", DELAYS, STARTS_PER_DELAY)?;
    let (held, failed) = edge(&delays, KnobRuns::all_up)?;
    Ok(Findings {
        table: delay_table(&delays),
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

fn delay_table(delays: &[KnobRuns]) -> Table {
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
fn limit_table(causes: &[OfCause], limit_ms: f64) -> Table {
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
        table: limit_table(&causes, limit),
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
        table: limit_table(&causes, limit),
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

/// Runs of each cause.
pub const RUNS: u64 = 200;

/// Number of different starts to draw from.
const DIFFERENT_STARTS: usize = 1_000;

/// Step of the physics: as long as the period of the actuator.
const STEP: StepMs = StepMs::ALL[1];

/// The runs of a cause, once they are measured.
type KeptRuns = Arc<Mutex<Option<Arc<ByAge>>>>;

/// A cause of old pushes, with values on both sides of what the pole bears.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AgeCause {
    /// A slow policy.
    Rate,
    /// A constant delay of `/action`.
    Delay,
    /// Random loss of messages on `/action`, the last one held.
    Loss,
    /// A slow policy that ticks long after the sensor.
    Phase,
    /// A policy that takes time to decide.
    Thinking,
    /// A random delay of `/action`.
    Jitter,
}

impl AgeCause {
    /// The causes that follow the law.
    pub const LAWFUL: [Self; 5] = [
        Self::Rate,
        Self::Delay,
        Self::Loss,
        Self::Phase,
        Self::Thinking,
    ];

    /// Returns its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rate => "rate",
            Self::Delay => "delay",
            Self::Loss => "loss",
            Self::Phase => "phase",
            Self::Thinking => "thinking",
            Self::Jitter => "jitter",
        }
    }

    /// Knobs with a value that is drawn.
    fn knobs(self, chance: &mut SplitMix) -> String {
        let mut value = |from, to| format!("{:.2}", chance.within(from, to));
        match self {
            // A period of 25 to 200 ms.
            Self::Rate => format!("control-hz {:.2}", 1e3 / chance.within(25.0, 200.0)),
            Self::Delay => format!("link /action delay:{}", value(0.0, 130.0)),
            Self::Loss => format!("link /action loss:{}", value(0.3, 0.95)),
            Self::Phase => format!(
                "sensor-hz 8, control-hz 8, offset policy {}",
                value(0.0, 120.0)
            ),
            Self::Thinking => format!("think-ms {}", value(0.0, 130.0)),
            Self::Jitter => format!("link /action delay:0..{}", value(40.0, 600.0)),
        }
    }

    /// Returns the run number `run` drawn from the learner's number `seed`.
    fn config(self, seed: u64, run: u64) -> Result<Config, Failure> {
        let chance = &mut SplitMix::new(seed, self as u64, run);
        let knobs = self.knobs(chance);
        Ok(Config {
            seed: chance.below(DIFFERENT_STARTS) as u64,
            world: WorldKind::Own { step_ms: STEP },
            ..own_world(&format!("rate actuator 500, {knobs}"))?
        })
    }

    fn run(self, seed: u64, run: u64) -> Result<CellResult, Failure> {
        let experiment = Experiment::new(cart_pole(), &self.config(seed, run)?)?;
        Ok(CellResult::new(&*cart_pole(), &experiment.run()?))
    }

    /// Returns all its runs by age, drawn from the learner's number `seed`.
    ///
    /// They take seconds, and two questions need the same: the first result is kept, and who asks
    /// for it meanwhile waits.
    pub fn by_age(self, seed: u64) -> Result<Arc<ByAge>, Failure> {
        static KNOWN: Mutex<BTreeMap<(u64, u64), KeptRuns>> = Mutex::new(BTreeMap::new());
        let kept = lock(&KNOWN).entry((seed, self as u64)).or_default().clone();
        let mut kept = lock(&kept);
        if let Some(known) = &*kept {
            return Ok(known.clone());
        }
        let runs: Vec<CellResult> = (0..RUNS)
            .into_par_iter()
            .map(|run| self.run(seed, run))
            .collect::<Result<_, Failure>>()?;
        Ok(kept.insert(Arc::new(ByAge::new(&runs))).clone())
    }
}
