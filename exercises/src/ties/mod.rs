//! Ties between due times: one graph, two schedules, two latencies.

mod accumulating;
pub mod nodes;

use accumulating::schedule;
use ratelab::Hz;
use ratelab_account::{Distribution, Snapshot};
use ratelab_cart_pole::{ACTION, ACTUATOR, CartPole, OBS, SENSE_TO_ACT};
use ratelab_study::experiment::{Config, Experiment};

use crate::framework::{
    Answer, Failure, Findings, Measurement, Table, asked, cart_pole, hz, mean_ms,
};

/// Control rates, as published (Hz).
const RATES: [f64; 6] = [50.0, 25.0, 20.0, 15.0, 10.0, 5.0];

/// The rate of the question (Hz).
const ASKED: f64 = 25.0;

pub(crate) fn measure() -> Result<Findings, Failure> {
    let rates = hz(&RATES)?;
    let pairs: Vec<Pair> = rates.into_iter().map(Pair::run).collect::<Result<_, _>>()?;
    let asked = asked(&pairs, |pair| pair.hz.get() == ASKED)?;
    Ok(Findings {
        table: table(&pairs),
        answer: Answer::Exactly(asked.exact.latency_ms),
        meaning: asked.meaning(),
        measurements: pairs.iter().flat_map(Pair::measurements).collect(),
    })
}

/// The result of a run, under any scheduler.
pub(crate) struct TimedRun {
    /// Mean latency from sensing to acting.
    pub(crate) latency_ms: f64,
    /// Mean age of readings when the policy used them.
    reading_age_ms: f64,
    /// Mean age of actions when they were applied.
    action_age_ms: f64,
    /// Readings lost unread.
    dropped: u64,
    /// Control steps of the plant.
    pub(crate) steps: u64,
}

impl TimedRun {
    /// Runs `config` under the lab's scheduler.
    pub(crate) fn exact(config: &Config) -> Result<Self, Failure> {
        let experiment = Experiment::new(cart_pole(), config)?;
        let observer = experiment.observer();
        let summary = experiment.run()?;
        Ok(Self::of(&observer.snapshot(), summary.steps))
    }

    /// The result of a run with these accounts and plant steps.
    fn of(run: &Snapshot, steps: u64) -> Self {
        let reader = |topic| run.topic(topic).and_then(|topic| topic.readers.first());
        let age_ms = |topic| mean_ms(reader(topic).and_then(|reader| reader.ages.mean_s()));
        let latency = run.meter(ACTUATOR, SENSE_TO_ACT);
        Self {
            latency_ms: mean_ms(latency.and_then(Distribution::mean_s)),
            reading_age_ms: age_ms(OBS),
            action_age_ms: age_ms(ACTION),
            dropped: reader(OBS).map_or(0, |reader| reader.dropped),
            steps,
        }
    }

    pub(crate) fn latency(&self) -> String {
        format!("{:.4} ms", self.latency_ms)
    }

    pub(crate) fn reading_age(&self) -> String {
        format!("{:.1} ms", self.reading_age_ms)
    }

    fn action_age(&self) -> String {
        format!("{:.1} ms", self.action_age_ms)
    }
}

/// One run under both schedulers.
struct Pair {
    hz: Hz,
    added: TimedRun,
    exact: TimedRun,
}

impl Pair {
    fn run(control_hz: Hz) -> Result<Self, Failure> {
        let config = CartPole::config(&format!("control-hz {}", control_hz.get()))?;
        let seconds = config.end.as_secs_f64();
        let added = nodes::run(config.seed, |nodes| {
            schedule(nodes, control_hz.get(), seconds)
        })?;
        Ok(Self {
            hz: control_hz,
            added,
            exact: TimedRun::exact(&config)?,
        })
    }

    fn meaning(&self) -> String {
        let (added, exact) = (&self.added, &self.exact);
        format!(
            "At {} the scheduler that adds periods reports {:.4} ms, the exact one {:.4} ms: \
             {:.1} ms more. Added up, the due times of policy and sensor come to differ in the \
             last bit, and where they ought to tie the last bit decides who is first. Sometimes \
             the policy runs a hair before the sensor and acts on the reading of one period ago \
             (readings are {:.1} ms older on average), sometimes a hair after the actuator, and \
             its action waits for the next step (actions are {:.1} ms older). Either way one \
             period of the plant is lost, and nobody dropped a message more for it: {} in the \
             one, {} in the other.",
            self.hz,
            added.latency_ms,
            exact.latency_ms,
            added.latency_ms - exact.latency_ms,
            added.reading_age_ms - exact.reading_age_ms,
            added.action_age_ms - exact.action_age_ms,
            added.dropped,
            exact.dropped,
        )
    }

    fn measurements(&self) -> impl Iterator<Item = Measurement> {
        let runs = [("periods added", &self.added), ("exact time", &self.exact)];
        runs.into_iter().flat_map(|(how, run)| {
            Measurement::of(
                format_args!("{}, {how}", self.hz),
                [
                    ("mean latency (ms)", run.latency_ms),
                    ("/obs dropped", run.dropped as f64),
                    ("steps", run.steps as f64),
                ],
            )
        })
    }
}

/// A row for each rate, with both schedules side by side.
fn table(pairs: &[Pair]) -> Table {
    Table::of(
        pairs,
        &[
            ("rate", &|pair| pair.hz.to_string()),
            ("periods added", &|pair| pair.added.latency()),
            ("exact time", &|pair| pair.exact.latency()),
            ("reading age", &|pair| pair.added.reading_age()),
            ("exact", &|pair| pair.exact.reading_age()),
            ("action age", &|pair| pair.added.action_age()),
            ("exact", &|pair| pair.exact.action_age()),
        ],
    )
}
