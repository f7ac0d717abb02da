//! The limits of the theory: predicted growth, measured growth, and the consequence.

use ratelab::{Hz, Time};
use ratelab_cart_pole::{
    CONTROL_HZ, CartPole,
    stability::{Rates, Stability, measured_growth},
};
use ratelab_experiment::Config;

use crate::{
    cliff::STARTS,
    framework::{
        Answer, Failure, Findings, Measurement, PredictionPlace, RecordedRun, Table, asked, hz,
        record, widest_deg,
    },
};

/// Control rates, in ascending order (Hz).
const RATES: [f64; 8] = [5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0];

/// Duration at 50 Hz before the policy is slowed (s), after which the deviation of the
/// start is far below any clipping.
const SETTLE_S: f64 = 30.0;

/// Duration after that (s).
const WATCH_S: f64 = 60.0;

/// Duration of a run from the usual starts in the first exercise (s).
const USUAL_S: f64 = 10.0;

/// The last part of a run, in which the amplitude of the swing is measured (s).
const TAIL_S: f64 = 20.0;

pub(crate) fn measure() -> Result<Findings, Failure> {
    let trials: Vec<LimitTrial> = hz(&RATES)?
        .into_iter()
        .map(LimitTrial::run)
        .collect::<Result<_, _>>()?;
    let stable = asked(&trials, |trial| trial.theory.is_stable())?;
    Ok(Findings {
        table: table(&trials),
        place: PredictionPlace::Between,
        answer: Answer::Exactly(stable.hz.get()),
        meaning: meaning(&trials),
        measurements: trials.iter().flat_map(LimitTrial::measurements).collect(),
    })
}

/// One rate, in theory and in two runs.
struct LimitTrial {
    hz: Hz,
    theory: Stability,
    /// Growth of the settled deviation (1/s), at rates with predicted growth.
    growth: Option<f64>,
    /// Time from the slowing of the policy to the first clipped action (s).
    clipped_s: Option<f64>,
    /// Runs of a minute from the usual starts.
    minutes: Vec<Minute>,
}

/// A run of a minute at one rate.
struct Minute {
    lasted_s: f64,
    balanced: bool,
    /// The pole's widest angle towards the end (degrees).
    swing_deg: f64,
}

impl Minute {
    fn run(seed: u64, control_hz: Hz) -> Result<Self, Failure> {
        let run = record(&Config {
            seed,
            end: Time::from_secs_f64(WATCH_S)?,
            ..CartPole::config(&format!("control-hz {}", control_hz.get()))?
        })?;
        let lasted_s = run.summary.sim_time.as_secs_f64();
        let tail = run
            .steps
            .iter()
            .filter(|step| step.stamp.as_secs_f64() > lasted_s - TAIL_S);
        Ok(Self {
            lasted_s,
            balanced: !run.summary.verdict.is_lost(),
            swing_deg: widest_deg(tail),
        })
    }
}

impl LimitTrial {
    fn run(hz: Hz) -> Result<Self, Failure> {
        let theory = Stability::for_rates(Rates {
            sensor: Hz::new(CONTROL_HZ)?,
            control: hz,
        })?;
        let slowed = Time::from_secs_f64(SETTLE_S)?;
        let settled = record(&Config {
            end: Time::from_secs_f64(SETTLE_S + WATCH_S)?,
            knobs: CartPole::KNOBS.parse_timed(&format!("{SETTLE_S} control-hz {}", hz.get()))?,
            ..Config::default()
        })?;
        let growth = measured_growth(&settled.steps, slowed, theory.hyper_period);
        let minutes = (0..STARTS).map(|seed| Minute::run(seed, hz));
        Ok(Self {
            hz,
            growth: growth.filter(|_| !theory.is_stable()),
            clipped_s: clipped_s(&settled, slowed),
            minutes: minutes.collect::<Result<_, _>>()?,
            theory,
        })
    }

    /// Returns the number of starts with the pole up after the usual time.
    fn up(&self) -> usize {
        self.minutes
            .iter()
            .filter(|run| run.lasted_s > USUAL_S)
            .count()
    }

    /// Returns the number of starts with the pole up after a minute.
    fn still_up(&self) -> usize {
        self.minutes.iter().filter(|run| run.balanced).count()
    }

    /// Returns the amplitude of the swing of these (degrees); `None` if there are none.
    fn swing_deg(&self) -> Option<f64> {
        self.minutes
            .iter()
            .filter(|run| run.balanced)
            .map(|run| run.swing_deg)
            .reduce(f64::max)
    }

    fn measurements(&self) -> Vec<Measurement> {
        let off = self.growth.map(|growth| growth - self.theory.growth());
        let figures = [
            ("predicted growth (1/s)", Some(self.theory.growth())),
            ("starts up after 10 s", Some(self.up() as f64)),
            ("starts up after 60 s", Some(self.still_up() as f64)),
            ("measured growth (1/s)", self.growth),
            ("measured off predicted (1/s)", off.map(f64::abs)),
            ("swing after 60 s (degrees)", self.swing_deg()),
        ];
        let known = figures
            .into_iter()
            .filter_map(|(what, figure)| Some((what, figure?)));
        known
            .flat_map(|figure| Measurement::list(self.hz, [figure]))
            .collect()
    }
}

/// Returns the time from the slowing to the first clipped action (s).
fn clipped_s(run: &RecordedRun, slowed: Time) -> Option<f64> {
    let clipped = run
        .steps
        .iter()
        .skip_while(|step| step.stamp < slowed)
        .find(|step| step.data.action.0.abs() >= 1.0)?;
    Some(clipped.stamp.since(slowed).as_secs_f64())
}

fn table(trials: &[LimitTrial]) -> Table {
    let or_dash = |text: Option<String>| text.unwrap_or_else(|| "–".to_owned());
    let of_starts = |up: usize, trial: &LimitTrial| format!("{up} of {}", trial.minutes.len());
    Table::from_items(
        trials,
        &[
            ("control", &|trial| trial.hz.to_string()),
            ("in theory", &|trial| {
                format!("{:+.2}/s", trial.theory.growth())
            }),
            ("measured", &|trial| {
                or_dash(trial.growth.map(|growth| format!("{growth:+.2}/s")))
            }),
            ("clips after", &|trial| {
                or_dash(trial.clipped_s.map(|seconds| format!("{seconds:.2} s")))
            }),
            ("up 10 s", &|trial| of_starts(trial.up(), trial)),
            ("up 60 s", &|trial| of_starts(trial.still_up(), trial)),
            ("swing", &|trial| {
                or_dash(trial.swing_deg().map(|swing| format!("±{swing:.2}°")))
            }),
        ],
    )
}

fn meaning(trials: &[LimitTrial]) -> String {
    let growing = trials
        .iter()
        .filter_map(|trial| trial.growth.map(|growth| (trial, growth)));
    let off = growing.map(|(trial, growth)| (growth - trial.theory.growth()).abs());
    let worst = off.fold(0.0, f64::max);
    let unstable = trials.iter().filter(|trial| !trial.theory.is_stable());
    let swinging: Vec<String> = unstable
        .filter_map(|trial| {
            let swing = trial.swing_deg()?;
            let (up, of) = (trial.still_up(), trial.minutes.len());
            Some(format!(
                "{} ({up} of {of} up, within ±{swing:.1}°)",
                trial.hz
            ))
        })
        .collect();
    format!(
        "While the motor had force to spare, theory and run agreed to {worst:.4}/s at every rate \
         with growth. Then the action clips, and theory is about another loop. At these rates \
         every small deviation grows, and yet the pole may be up after a minute: {}. There it \
         swings, and the clipped action keeps the swing from growing further, not always. So \
         unstable does not mean fallen, and up does not mean stable.",
        swinging.join(", "),
    )
}
