//! The presets through which keys move a knob.

use std::fmt::Display;

use ratelab::{Knob, KnobKind};
use ratelab_effects::knob;

/// Rates in Hz: dense where the pole falls.
pub const RATES: [f64; 27] = [
    1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 12.0, 15.0, 20.0, 25.0, 30.0, 40.0, 50.0,
    60.0, 75.0, 100.0, 125.0, 150.0, 200.0, 250.0, 500.0, 750.0, 1000.0,
];

/// The same for hands in a hurry: three presses from 5 to 50.
pub const COARSE_RATES: [f64; 8] = [1.0, 2.0, 5.0, 10.0, 25.0, 50.0, 100.0, 1000.0];

/// Queue depths in messages.
pub const DEPTHS: [f64; 10] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0];

/// Delays of a link (ms).
pub const DELAYS: [f64; 17] = [
    0.0, 5.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0, 100.0, 120.0, 150.0, 200.0,
    300.0, 500.0,
];

/// Shares of messages that a link loses.
pub const LOSSES: [f64; 13] = [
    0.0, 0.01, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0,
];

/// Speeds of virtual time against wall time.
pub const SPEEDS: [f64; 10] = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0];

/// The direction in which a key moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// To the next higher preset.
    Up,
    /// To the next lower preset.
    Down,
}

/// The preset next to `value`, which may itself lie between presets; `None` at the
/// end of them.
pub fn next(presets: &[f64], value: f64, direction: Direction) -> Option<f64> {
    match direction {
        Direction::Up => presets.iter().copied().find(|preset| *preset > value),
        Direction::Down => presets.iter().rev().copied().find(|preset| *preset < value),
    }
}

/// The knobs of `kind` that turn all `targets` to the preset next to `current`.
///
/// # Errors
/// A notice, at the end of the presets.
pub fn next_knobs(
    kind: KnobKind,
    targets: &[String],
    (presets, current): (&[f64], f64),
    direction: Direction,
) -> Result<Vec<Knob>, String> {
    let Some(value) = next(presets, current, direction) else {
        let what = format!("the {} of {}", kind.name(), targets.join(" and "));
        let unit = if kind == KnobKind::Rate { " Hz" } else { "" };
        return Err(at_end(&what, direction, format!("{current}{unit}")));
    };
    let value = value.to_string();
    let knobs = targets.iter().map(|target| knob(kind, target, &value));
    let knobs: Result<_, _> = knobs.collect();
    knobs.map_err(|error| error.to_string())
}

/// The number next to `at` in a circle of `count`.
pub fn neighbour(at: Option<usize>, count: usize, direction: Direction) -> Option<usize> {
    let step = if direction == Direction::Up {
        1
    } else {
        count.checked_sub(1)?
    };
    (at.unwrap_or(0) + step).checked_rem(count)
}

/// The notice that `what` has no preset beyond its `value`.
pub fn at_end(what: &str, direction: Direction, value: impl Display) -> String {
    let end = match direction {
        Direction::Up => "highest",
        Direction::Down => "lowest",
    };
    format!("{what} is at its {end}, {value}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_between_presets_moves_to_its_neighbours() {
        assert_eq!(next(&RATES, 7.5, Direction::Up), Some(8.0));
        assert_eq!(next(&RATES, 7.5, Direction::Down), Some(7.0));
    }

    #[test]
    fn the_ends_of_the_presets_lead_nowhere() {
        assert_eq!(next(&RATES, 1.0, Direction::Down), None);
        assert_eq!(next(&RATES, 5000.0, Direction::Up), None);
        assert_eq!(next(&RATES, 5000.0, Direction::Down), Some(1000.0));
    }

    #[test]
    fn knobs_turn_together_and_the_last_preset_is_named() {
        let nodes = ["a", "b"].map(str::to_owned);
        let turned = |hz| next_knobs(KnobKind::Rate, &nodes, (&RATES[..], hz), Direction::Up);
        let knobs: Vec<String> = turned(50.0).map_or_else(
            |why| vec![why],
            |knobs| knobs.iter().map(Knob::to_string).collect(),
        );
        assert_eq!(knobs, ["rate a 60", "rate b 60"]);
        let end = "the rate of a and b is at its highest, 1000 Hz".to_owned();
        assert_eq!(turned(1000.0), Err(end));
    }

    #[test]
    fn presets_ascend() {
        for presets in [
            &RATES[..],
            &COARSE_RATES,
            &DEPTHS,
            &DELAYS,
            &LOSSES,
            &SPEEDS,
        ] {
            assert!(presets.is_sorted_by(|a, b| a < b));
        }
    }

    #[test]
    fn a_circle_is_gone_round_either_way() {
        assert_eq!(neighbour(Some(2), 3, Direction::Up), Some(0));
        assert_eq!(neighbour(Some(0), 3, Direction::Down), Some(2));
        assert_eq!(neighbour(None, 0, Direction::Up), None);
        assert_eq!(neighbour(None, 0, Direction::Down), None);
    }
}
