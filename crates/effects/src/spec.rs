//! The values of knobs as text.

use ratelab::{Knob, KnobError, KnobKind};

use crate::{cost::Cost, draw::Draw, links::link::Link, local_clock::ClockError, overrun::Overrun};

/// Checks the value of a knob for an effect, and writes it in its shortest form.
///
/// ```
/// use ratelab_effects::checked;
///
/// let knob = checked("link /obs loss:0.2,delay:30.0".parse()?)?;
/// assert_eq!(knob.to_string(), "link /obs delay:30,loss:0.2");
/// assert!(checked("takes policy soon".parse()?).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// The accepted values.
pub fn checked(mut knob: Knob) -> Result<Knob, String> {
    match &mut knob {
        Knob::Takes { spec, .. } => *spec = spec.parse::<Cost>()?.to_string(),
        Knob::Wakes { spec, .. } => *spec = spec.parse::<Draw>()?.to_string(),
        Knob::Late { spec, .. } => *spec = spec.parse::<Overrun>()?.to_string(),
        Knob::Link { spec, .. } => *spec = spec.parse::<Link>()?.to_string(),
        Knob::Clock { error, .. } | Knob::StampClock { error, .. } => {
            *error = error.parse::<ClockError>()?.to_string();
        }
        _ => {}
    }
    Ok(knob)
}

/// The knob of this kind for `target`, a node or a topic, with a checked `value`.
///
/// # Errors
/// [`KnobError`] if the value is invalid for it.
pub fn knob(kind: KnobKind, target: &str, value: &str) -> Result<Knob, KnobError> {
    checked(kind.set(target, value)?).map_err(KnobError::Value)
}

/// The random duration that a knob sets, if it sets one.
///
/// # Errors
/// The accepted values, for a knob that was not [`checked`].
pub fn draw(knob: &Knob) -> Result<Option<Draw>, String> {
    match knob {
        Knob::Takes { spec, .. } => spec.parse().map(|cost: Cost| Some(cost.draw)),
        Knob::Wakes { spec, .. } => spec.parse().map(Some),
        knob => checked(knob.clone()).map(|_| None),
    }
}

/// Whether a knob has the ticks of its node take time.
pub fn takes_time(knob: &Knob) -> bool {
    let takes = matches!(knob, Knob::Takes { .. }).then(|| draw(knob));
    matches!(takes, Some(Ok(Some(draw))) if !draw.is_none())
}
