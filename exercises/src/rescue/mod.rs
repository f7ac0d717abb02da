//! Rescue: break the graph, and repair it before the pole is down.

pub mod judge;
pub mod session;

use judge::{RescueFailure, RescueSession, Rescued, judge};
use ratelab::Hz;
use ratelab_cart_pole::{BROKEN_HZ, CONTROL_HZ, CartPole};
use ratelab_experiment::Config;

use crate::framework::{
    Answer, Failure, Findings, Measurement, PredictionPlace, RecordedRun, Table, angle_deg, edge,
    record, widest_deg,
};

/// Durations of the slow phase in the rehearsals (tenths of a second).
const SLOW_PHASES: std::ops::RangeInclusive<u32> = 1..=8;

pub(crate) fn measure() -> Result<Findings, Failure> {
    let rehearsals: Vec<Rehearsal> = SLOW_PHASES.map(Rehearsal::run).collect::<Result<_, _>>()?;
    let (saved, lost) = edge(&rehearsals, |rehearsal| !rehearsal.fell())?;
    let measurements = rehearsals.iter().flat_map(Rehearsal::measurements);
    Ok(Findings {
        table: table(&rehearsals),
        place: PredictionPlace::Between,
        answer: Answer::Between {
            from: saved.slow_s,
            to: lost.slow_s,
        },
        meaning: meaning(&rehearsals, lost),
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
            verdict: run.summary.verdict.clone(),
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

    /// Returns the pole's angle just before the policy was fast again, and its widest one up to
    /// then and from then on (degrees); `None` if the pole had fallen before.
    fn angles_deg(&self) -> Option<[f64; 3]> {
        let steps = &self.run.steps;
        let later = steps.partition_point(|step| step.stamp.as_secs_f64() < self.slow_s);
        let then = later.checked_sub(1).filter(|_| later < steps.len())?;
        Some([
            angle_deg(&steps[then]),
            widest_deg(&steps[..later]),
            widest_deg(&steps[then..]),
        ])
    }

    /// Returns what became of the pole, in a few words.
    fn outcome(&self) -> &'static str {
        match (&self.judged, self.fell()) {
            (_, true) => "fell",
            (Ok(_), _) => "rescued",
            (Err(RescueFailure::Danger { .. }), _) => "never in danger",
            (Err(RescueFailure::Recovered { .. }), _) => "back by itself",
            (Err(_), _) => "not rescued",
        }
    }

    fn measurements(&self) -> Vec<Measurement> {
        let [balanced, rescued] = [!self.fell(), self.judged.is_ok()].map(f64::from);
        let mut figures = vec![("balanced", balanced), ("rescued", rescued)];
        let names = [
            "angle then (degrees)",
            "widest before (degrees)",
            "widest after (degrees)",
        ];
        figures.extend(
            names
                .into_iter()
                .zip(self.angles_deg().into_iter().flatten()),
        );
        let subject = format!("{} s slow", self.slow_s);
        figures
            .into_iter()
            .flat_map(|figure| Measurement::list(&subject, [figure]))
            .collect()
    }
}

fn table(rehearsals: &[Rehearsal]) -> Table {
    let angle = |of: &Rehearsal, place: usize| {
        let angles = of.angles_deg();
        angles.map_or_else(|| "–".to_owned(), |angles| format!("{:.2}°", angles[place]))
    };
    Table::from_items(
        rehearsals,
        &[
            ("at 5 Hz", &|of| format!("{:.1} s", of.slow_s)),
            ("widest before", &|of| angle(of, 1)),
            ("angle then", &|of| angle(of, 0)),
            ("widest after", &|of| angle(of, 2)),
            ("the pole", &|of| of.outcome().to_owned()),
        ],
    )
}

fn meaning(rehearsals: &[Rehearsal], lost: &Rehearsal) -> String {
    let rescued = rehearsals.iter().rev().find(|of| of.judged.is_ok()).and_then(|of| Some((of, of.angles_deg()?))).map_or_else(String::new, |(of, [then, _, after])| {
        format!(
            "After {:.1} s at {BROKEN_HZ} Hz the pole was at {then:.1}° when the rate went up; it \
             swung to {after:.1}° and was caught. ",
            of.slow_s,
        )
    });
    let itself = rehearsals
        .iter()
        .filter(|of| matches!(of.judged, Err(RescueFailure::Recovered { .. })));
    let fell_at: Vec<String> = itself.map(|of| format!("{:.1} s", of.slow_s)).collect();
    let itself = fell_at.split_last().map_or_else(String::new, |(last, others)| {
        format!(
            "After {} and {last} the pole was not in danger when the rate went up: at {BROKEN_HZ} Hz \
             it had come back by itself. ",
            others.join(", "),
        )
    });
    let late = lost.angles_deg().map_or_else(String::new, |[then, ..]| {
        format!(
            "After {:.1} s the pole was at {then:.1}° and fell {:.2} s later. ",
            lost.slow_s,
            lost.run.summary.sim_time.as_secs_f64() - lost.slow_s,
        )
    });
    format!(
        "{rescued}{itself}{late}Many decisions afterwards do not repair one that came too late. \
         Now do it by hand; B runs a failed try again, from the moment that you look at."
    )
}
