//! Ties between due times: one graph, two schedules, two latencies.

mod accumulating;
pub mod nodes;

use accumulating::schedule;
use nodes::ScheduledRun;
use ratelab::Hz;
use ratelab_account::{Distribution, TopicAccount};
use ratelab_cart_pole::{ACTION, CartPole, OBS};
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
    pub(crate) latency_ms: f64,
    /// Mean age of readings when the policy used them.
    pub(crate) reading_age_ms: f64,
    /// Mean age of actions when they were applied.
    action_age_ms: f64,
    dropped: u64,
    pub(crate) steps: u64,
}

impl TimedRun {
    pub(crate) fn exact(config: &Config) -> Result<Self, Failure> {
        let experiment = Experiment::new(cart_pole(), config)?;
        let summary = experiment.run()?;
        let age_ms = |topic| {
            let readers = summary.topic(topic).map(|topic| &topic.readers);
            mean_ms(readers.and_then(|readers| readers.first()?.ages.mean_s()))
        };
        Ok(Self {
            latency_ms: mean_ms(summary.latency.mean_s()),
            reading_age_ms: age_ms(OBS),
            action_age_ms: age_ms(ACTION),
            dropped: summary.topic(OBS).map_or(0, TopicAccount::dropped),
            steps: summary.steps,
        })
    }
}

impl From<ScheduledRun> for TimedRun {
    fn from(run: ScheduledRun) -> Self {
        let mean = |distribution: &Distribution| mean_ms(distribution.mean_s());
        Self {
            latency_ms: mean(&run.latency),
            reading_age_ms: mean(&run.reading_age),
            action_age_ms: mean(&run.action_age),
            dropped: run.dropped,
            steps: run.steps,
        }
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
            added: added.into(),
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

    /// The two runs with the names of their schedules.
    fn runs(&self) -> [(&'static str, &TimedRun); 2] {
        [("periods added", &self.added), ("exact time", &self.exact)]
    }

    fn measurements(&self) -> Vec<Measurement> {
        let each = self.runs().into_iter().flat_map(|(how, run)| {
            let name = |what| format!("{}, {how}: {what}", self.hz);
            [
                Measurement::new(name("mean latency (ms)"), run.latency_ms),
                Measurement::new(name("/obs dropped"), run.dropped as f64),
                Measurement::new(name("steps"), run.steps as f64),
            ]
        });
        each.collect()
    }
}

/// A row for each rate, with both schedules side by side.
fn table(pairs: &[Pair]) -> Table {
    let mut table = Table::new([
        "rate",
        "periods added",
        "exact time",
        "reading age",
        "exact",
        "action age",
        "exact",
    ]);
    for Pair { hz, added, exact } in pairs {
        table.row([
            hz.to_string(),
            format!("{:.4} ms", added.latency_ms),
            format!("{:.4} ms", exact.latency_ms),
            format!("{:.1} ms", added.reading_age_ms),
            format!("{:.1} ms", exact.reading_age_ms),
            format!("{:.1} ms", added.action_age_ms),
            format!("{:.1} ms", exact.action_age_ms),
        ]);
    }
    table
}
