//! Hold or zero: what an actuator does while nothing new arrives.

use ratelab_cart_pole::stability::Lost;

use crate::framework::{
    Answer, Failure, Findings, KnobRuns, Measurement, PredictionPlace, Table, asked, control_loop,
    own_world, survey,
};

/// Starts for each loss.
const STARTS: u64 = 20;

/// Probabilities of loss.
const LOSSES: [&str; 5] = ["0.5", "0.6", "0.7", "0.8", "0.9"];

/// The probability of the question.
const ASKED: &str = "0.8";

/// Returns the first question: the last action is held.
pub(crate) fn hold() -> Result<Findings, Failure> {
    let held = losses("hold")?;
    let up = asked(&held, |group| group.value == ASKED)?;
    Ok(Findings {
        table: table(&[("hold", &held)]),
        place: PredictionPlace::Row(at(ASKED)),
        answer: Answer::Exactly(up.up() as f64),
        meaning: format!(
            "{} stayed up, though ten actions a second are enough where they come evenly. Chance \
             is not even: of 500 messages twenty in a row may well be lost. Then the motor pushes \
             one way for 0.4 s, by a reading of a pole that has moved on. The mean does not tell \
             the longest gap.",
            up.up_of(),
        ),
        measurements: measurements("hold", &held),
    })
}

/// Returns the second question: no force once the action is old.
pub(crate) fn zero() -> Result<Findings, Failure> {
    let (held, let_go) = (losses("hold")?, losses("zero:0")?);
    let up = asked(&let_go, |group| group.value == ASKED)?;
    let control = control_loop()?;
    // The losses at which the expected square of a small deviation grows.
    let hold_margin = control.loss_margin(Lost::Hold)?;
    let zero_margin = control.loss_margin(Lost::Zero)?;
    let mut measured = measurements("zero", &let_go);
    measured.push(Measurement::new("loss margin, hold", hold_margin));
    measured.push(Measurement::new("loss margin, zero", zero_margin));
    Ok(Findings {
        table: table(&[("hold", &held), ("zero", &let_go)]),
        place: PredictionPlace::Row(2 * at(ASKED) + 1),
        answer: Answer::Exactly(up.up() as f64),
        meaning: format!(
            "{} stayed up with no force between two actions. An old push is worse than none: it \
             was right for a pole that leant the other way. Theory agrees about small deviations: \
             their squares shrink on average up to a loss of {:.0} % if the last action is held, \
             and up to {:.0} % if there is no force. This is not a rule for every plant: a pole \
             forgives a moment without force, a drone does not.",
            up.up_of(),
            hold_margin * 100.0,
            zero_margin * 100.0,
        ),
        measurements: measured,
    })
}

/// Returns the place of a loss in the list.
fn at(loss: &str) -> usize {
    let place = LOSSES.iter().position(|known| *known == loss);
    place.unwrap_or_default()
}

/// Returns all losses, with this handling of stale actions.
fn losses(on_stale: &str) -> Result<[KnobRuns; LOSSES.len()], Failure> {
    let base = own_world(&format!("on-stale {on_stale}"))?;
    survey(base, "link /action loss:{}", LOSSES, STARTS)
}

fn table(ways: &[(&str, &[KnobRuns])]) -> Table {
    let rows: Vec<(&&str, &KnobRuns)> = (0..LOSSES.len())
        .flat_map(|at| ways.iter().map(move |(way, all)| (way, &all[at])))
        .collect();
    Table::from_items(
        &rows,
        &[
            ("loss", &|(_, group)| group.value.clone()),
            ("between two actions", &|(way, _)| (**way).to_owned()),
            ("stay up", &|(_, group)| group.up_of()),
            ("push age", &|(_, group)| group.push_age()),
        ],
    )
}

fn measurements(way: &str, groups: &[KnobRuns]) -> Vec<Measurement> {
    groups
        .iter()
        .map(|group| group.balanced(format_args!("{way}, loss {}", group.value)))
        .collect()
}
