//! Jitter: the same mean delay, and what theory promises about any pattern of delays.

use std::time::Duration;

use ratelab::Hz;
use ratelab_cart_pole::{
    CONTROL_HZ,
    policy::Scripted,
    stability::{Loop, StabilityError, Timing, WorldModel},
};

use crate::framework::{
    Answer, Brief, Exercise, ExerciseKind, Failure, Findings, KnobRuns, Measurement, Range, Table,
    Tolerance, own_world, survey,
};

/// Starts for each link.
const STARTS: u64 = 20;

const RANGE: Range = Range {
    least: 0.0,
    most: STARTS as f64,
    whole: true,
};

/// Half the ranges of delay around the mean (ms).
const SPREADS: [u32; 7] = [0, 5, 10, 20, 30, 50, 70];

/// The mean delay (ms).
const MEAN: u32 = 70;

/// The range of the question: half of it (ms).
const ASKED: u32 = 30;

/// The first question: jitter around the same mean.
pub struct Jitter;

/// The second question: the jitter margin.
pub struct Margin;

const JITTER: Brief = Brief {
    number: 8,
    part: "a",
    name: "jitter",
    title: "Jitter: the same mean",
    kind: ExerciseKind::PredictThenRun,
    objective: "Two networks hold each action back for 70 ms on average. The first always takes \
                exactly 70 ms: all of 20 starts stay up for ten seconds. The second takes between \
                40 and 100 ms, each time another, drawn at random, so that an action may overtake \
                the one before it; what comes after a newer one is never read. All nodes keep \
                their 50 Hz, and the world does not wait. More and less jitter around the same \
                mean is measured beside the two.",
    question: "With 40 to 100 ms at random, how many of the 20 starts stay up?",
    quantity: "starts up",
    unit: "",
    tolerance: Tolerance::Within(2.0),
    range: RANGE,
    choices: &[],
};

const MARGIN: Brief = Brief {
    number: 8,
    part: "b",
    name: "jitter-margin",
    title: "Jitter: what the margin promises",
    kind: ExerciseKind::PredictThenRun,
    objective: "Without a constant part of the delay, theory has a promise: as long as each \
                action is late by no more than the jitter margin, 36.8 ms for this loop at 50 Hz, \
                small deviations shrink whatever the pattern of the delays, even if an adversary \
                chooses each of them. Delays between nothing and half the margin, the margin, \
                twice and four times the margin are drawn at random, for 20 starts each.",
    question: "With twice the margin, how many of the 20 starts fall?",
    quantity: "starts fallen",
    unit: "",
    tolerance: Tolerance::Exact,
    range: RANGE,
    choices: &[],
};

fn delays(links: &[String]) -> Result<Vec<KnobRuns>, Failure> {
    survey(own_world("")?, "link /action", links, 0..STARTS)
}

fn table(first: &str, rows: impl Iterator<Item = (String, String)>, groups: &[KnobRuns]) -> Table {
    let mut table = Table::new([first, "delay", "stay up", "push age"]);
    for ((label, delay), group) in rows.zip(groups) {
        table.row([
            label,
            delay,
            group.up_of(),
            format!("{:.1} ms", group.push_age_ms()),
        ]);
    }
    table
}

impl Exercise for Jitter {
    fn brief(&self) -> &'static Brief {
        &JITTER
    }

    fn measure(&self, _seed: u64) -> Result<Findings, Failure> {
        let range = |spread: u32| match spread {
            0 => format!("{MEAN}"),
            _ => format!("{}..{}", MEAN - spread, MEAN + spread),
        };
        let links = SPREADS.map(|spread| format!("delay:{}", range(spread)));
        let groups = delays(&links)?;
        let asked = SPREADS.iter().position(|spread| *spread == ASKED);
        let asked = asked.and_then(|index| groups.get(index));
        let asked = asked.ok_or_else(|| Failure::Unmeasured("no such jitter".to_owned()))?;
        let rows = SPREADS.iter();
        let rows = rows.map(|spread| (format!("±{spread} ms"), format!("{} ms", range(*spread))));
        let measurements = groups.iter().map(|group| {
            let name = format!("{} ms: starts balanced", group.value);
            Measurement::new(name, group.up() as f64)
        });
        Ok(Findings {
            table: table("jitter", rows, &groups),
            refuted: Vec::new(),
            answer: Answer::Exactly(asked.up() as f64),
            meaning: format!(
                "{} with the constant delay, {} with the same mean at random. The actuator acts \
                 every 20 ms: what comes after 70 ms is applied after 80, but a delay beyond 80 \
                 ms costs a period more, and a few of those in a row are more than the pole \
                 bears. Much more jitter is better again, and not because it is harmless: where \
                 delays are that wide, many actions overtake older ones, and the push in force \
                 is fresher than the mean delay says (last column).",
                groups[0].up_of(),
                asked.up_of(),
            ),
            measurements: measurements.collect(),
        })
    }

    fn next_part(&self) -> Option<&'static dyn Exercise> {
        Some(&Margin)
    }
}

/// The margin of the scripted policy at 50 Hz.
fn margin() -> Result<Duration, Failure> {
    let timing = Timing::direct(Hz::new(CONTROL_HZ)?);
    let control = Loop::cart_pole(Scripted::GAINS, WorldModel::Continuous, timing);
    let control = control.map_err(StabilityError::from)?;
    let margin = control.jitter_margin()?.map(|margin| margin.jitter);
    margin.ok_or_else(|| Failure::Unmeasured("the loop has no jitter margin".to_owned()))
}

impl Exercise for Margin {
    fn brief(&self) -> &'static Brief {
        &MARGIN
    }

    fn measure(&self, _seed: u64) -> Result<Findings, Failure> {
        let margin = margin()?;
        let whole = margin.as_millis();
        let jitters = [whole / 2, whole, 2 * whole, 4 * whole];
        let links = jitters.map(|jitter| format!("delay:0..{jitter}"));
        let groups = delays(&links)?;
        let [_, _, twice, four] = &groups[..] else {
            return Err(Failure::Unmeasured("runs are missing".to_owned()));
        };
        let share = ["half the margin", "the margin", "twice", "four times"];
        let rows = share.iter().zip(jitters);
        let rows = rows.map(|(share, jitter)| ((*share).to_owned(), format!("0..{jitter} ms")));
        let margin_ms = margin.as_secs_f64() * 1e3;
        let mut measurements = vec![Measurement::new("jitter margin (ms)", margin_ms)];
        measurements.extend(groups.iter().map(|group| {
            let name = format!("{} ms: starts balanced", group.value);
            Measurement::new(name, group.up() as f64)
        }));
        let fell = twice.runs.len() - twice.up();
        Ok(Findings {
            table: table("jitter", rows, &groups),
            refuted: Vec::new(),
            answer: Answer::Exactly(fell as f64),
            meaning: format!(
                "The margin of {margin_ms:.1} ms is a promise and no prediction: below it nothing \
                 can go wrong, above it theory is silent. Twice as much felled {fell} of {}, and \
                 with four times as much {} stayed up. The promise holds for the worst pattern \
                 that exists, and chance hardly ever draws that one; it also holds for a network \
                 that you have not measured, which no number of runs does.",
                twice.runs.len(),
                four.up_of(),
            ),
            measurements,
        })
    }
}
