//! Rescue: break the graph, and repair it before the pole is down.

pub mod judge;
pub mod session;

use judge::{RescueFailure, RescueSession, Rescued, judge};
use ratelab::Hz;
use ratelab_cart_pole::{BROKEN_HZ, CONTROL_HZ, CartPole};
use ratelab_study::experiment::Config;

use crate::framework::{
    Answer, Failure, Findings, Measurement, RecordedRun, Table, angle_deg, edge, record, widest_deg,
};

/// Durations of the slow phase in the rehearsals (tenths of a second).
const SLOW_PHASES: std::ops::RangeInclusive<u32> = 1..=10;

pub(crate) fn measure() -> Result<Findings, Failure> {
    let rehearsals = SLOW_PHASES.map(Rehearsal::run);
    let rehearsals: Vec<Rehearsal> = rehearsals.collect::<Result<_, _>>()?;
    let (saved, lost) = edge(&rehearsals, |rehearsal| !rehearsal.fell())?;
    let measurements = rehearsals.iter().flat_map(Rehearsal::measurements);
    Ok(Findings {
        table: table(&rehearsals),
        answer: Answer::Between {
            from: saved.slow_s,
            to: lost.slow_s,
        },
        meaning: meaning(saved, lost),
        measurements: measurements.collect(),
    })
}

/// A scripted rescue.
struct Rehearsal {
    slow_s: f64,
    run: RecordedRun,
    judged: Result<Rescued, RescueFailure>,
}

impl Rehearsal {
    /// Runs with a slow phase of `tenths` of a second at the start.
    fn run(tenths: u32) -> Result<Self, Failure> {
        let slow_s = f64::from(tenths) / 10.0;
        let run = record(&Config {
            knobs: CartPole::KNOBS.parse_timed(&format!("{slow_s} control-hz {CONTROL_HZ}"))?,
            ..CartPole::config(&format!("control-hz {BROKEN_HZ}"))?
        })?;
        let judged = judge(&RescueSession {
            control_hz: Hz::new(BROKEN_HZ)?,
            events: &run.summary.events,
            steps: &run.steps,
            verdict: run.summary.verdict,
        });
        Ok(Self {
            slow_s,
            run,
            judged,
        })
    }

    fn fell(&self) -> bool {
        self.run.summary.verdict.is_lost()
    }

    /// The pole's angle just before the policy became fast again (degrees).
    fn angle_at_return_deg(&self) -> f64 {
        let steps = self.run.steps.iter();
        let slow = steps.take_while(|step| step.stamp.as_secs_f64() < self.slow_s);
        slow.last().map_or(0.0, angle_deg)
    }

    fn measurements(&self) -> [Measurement; 2] {
        Measurement::of(
            format_args!("{} s slow", self.slow_s),
            [
                ("balanced", f64::from(!self.fell())),
                ("rescued", f64::from(self.judged.is_ok())),
            ],
        )
    }
}

fn table(rehearsals: &[Rehearsal]) -> Table {
    let judged = |rehearsal: &Rehearsal| match &rehearsal.judged {
        Ok(_) => "rescued",
        Err(RescueFailure::Danger { .. }) => "not in danger",
        Err(_) => "not rescued",
    };
    Table::of(
        rehearsals,
        &[
            ("at 5 Hz for", &|of| format!("{:.1} s", of.slow_s)),
            ("widest angle", &|of| {
                format!("{:.1}°", widest_deg(&of.run.steps))
            }),
            ("verdict", &|of| of.run.summary.verdict.name().to_owned()),
            ("judged", &|of| judged(of).to_owned()),
        ],
    )
}

fn meaning(saved: &Rehearsal, lost: &Rehearsal) -> String {
    format!(
        "After {:.1} s at {BROKEN_HZ} Hz the pole stood at {:.1}° when the policy was fast again; \
         it came to {:.1}° and was caught. After {:.1} s it stood at {:.1}° and was down {:.2} s \
         later. Nothing but the rate told the two apart, and it was set right in both: what is \
         decided too late is not made up for by deciding often. Now do it by hand.",
        saved.slow_s,
        saved.angle_at_return_deg(),
        widest_deg(&saved.run.steps),
        lost.slow_s,
        lost.angle_at_return_deg(),
        lost.run.summary.sim_time.as_secs_f64() - lost.slow_s,
    )
}
