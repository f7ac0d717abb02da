//! Jitter: the same mean delay, and what theory promises about any pattern of delays.

use crate::framework::{
    Answer, Failure, Findings, KnobRuns, Measurement, PredictionPlace, Table, asked, control_loop,
    own_world, survey,
};

/// Starts for each link.
const STARTS: u64 = 20;

/// Half the ranges of delay around the mean (ms).
const SPREADS: [u32; 7] = [0, 5, 10, 20, 30, 50, 70];

/// The mean delay (ms).
const MEAN: u32 = 70;

/// The range of the question: half of it (ms).
const ASKED: u32 = 30;

/// Runs with each of `delays` (ms) of `/action`.
fn delayed<const DELAYS: usize>(delays: [String; DELAYS]) -> Result<[KnobRuns; DELAYS], Failure> {
    survey(own_world("")?, "link /action delay:{}", delays, STARTS)
}

fn table(labels: &[String], groups: &[KnobRuns]) -> Table {
    let rows: Vec<_> = labels.iter().zip(groups).collect();
    Table::from_items(
        &rows,
        &[
            ("jitter", &|(label, _)| (*label).clone()),
            ("delay", &|(_, group)| format!("{} ms", group.value)),
            ("stay up", &|(_, group)| group.up_of()),
            ("push age", &|(_, group)| group.push_age()),
        ],
    )
}

fn measurements(groups: &[KnobRuns]) -> impl Iterator<Item = Measurement> {
    groups
        .iter()
        .map(|group| group.balanced(format_args!("delay:{} ms", group.value)))
}

/// Returns a delay around the mean (ms).
fn around(spread: u32) -> String {
    match spread {
        0 => format!("{MEAN}"),
        _ => format!("{}..{}", MEAN - spread, MEAN + spread),
    }
}

/// Returns the first question: jitter around the same mean.
pub(crate) fn same_mean() -> Result<Findings, Failure> {
    let groups = delayed(SPREADS.map(around))?;
    let asked = asked(&groups, |group| group.value == around(ASKED))?;
    Ok(Findings {
        table: table(&SPREADS.map(|spread| format!("±{spread} ms")), &groups),
        place: PredictionPlace::Row(4),
        answer: Answer::Exactly(asked.up() as f64),
        meaning: format!(
            "{} stay up with the constant delay, {} with the same mean at random. The actuator \
             acts every 20 ms: an action that comes after 70 ms is applied after 80 ms. A delay \
             beyond 80 ms costs one period more, and a few such actions in a row tip the pole. \
             Much more jitter does less harm, though not harmless: then many actions overtake \
             older ones, and the push in force is fresher than the mean delay says (last column).",
            groups[0].up_of(),
            asked.up_of(),
        ),
        measurements: measurements(&groups).collect(),
    })
}

/// Returns the second question: the jitter margin of the scripted policy at 50 Hz.
pub(crate) fn margin() -> Result<Findings, Failure> {
    let margin = control_loop()?.jitter_margin()?.map(|margin| margin.jitter);
    let none = || Failure::Unmeasured("the loop has no jitter margin".to_owned());
    let longest = margin.ok_or_else(none)?;
    let whole = longest.as_millis();
    let jitters = [whole / 2, whole, 2 * whole, 4 * whole];
    let groups = delayed(jitters.map(|jitter| format!("0..{jitter}")))?;
    let [_, _, twice, four] = &groups;
    let labels = ["half the margin", "the margin", "twice", "four times"];
    let margin_ms = longest.as_secs_f64() * 1e3;
    let own = Measurement::new("jitter margin (ms)", margin_ms);
    let fell = twice.runs.len() - twice.up();
    Ok(Findings {
        table: table(&labels.map(str::to_owned), &groups),
        place: PredictionPlace::Row(2),
        answer: Answer::Exactly(fell as f64),
        meaning: format!(
            "The margin of {margin_ms:.1} ms is a promise and not a prediction: below it small \
             deviations shrink, above it theory says nothing. With twice as much {fell} of {} fell, \
             and with four times as much {} stayed up. The promise holds for the worst pattern \
             that exists, and chance hardly ever draws that one. It also holds for a network that \
             you have not measured: no number of runs can promise that.",
            twice.runs.len(),
            four.up_of(),
        ),
        measurements: [own].into_iter().chain(measurements(&groups)).collect(),
    })
}
