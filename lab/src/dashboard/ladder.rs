//! The rungs on which keys move a knob.

/// Rates in Hz: dense where the pole falls.
pub const RATES: [f64; 27] = [
    1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 12.0, 15.0, 20.0, 25.0, 30.0, 40.0, 50.0,
    60.0, 75.0, 100.0, 125.0, 150.0, 200.0, 250.0, 500.0, 750.0, 1000.0,
];

/// Queue depths in messages.
pub const DEPTHS: [f64; 10] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0];

/// Speeds of virtual time against wall time.
pub const SPEEDS: [f64; 10] = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0];

/// Which way a key moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// To the next higher rung.
    Up,
    /// To the next lower rung.
    Down,
}

/// The rung next to `value`, which may itself lie between rungs; `None` at the
/// end of the ladder.
pub fn next(ladder: &[f64], value: f64, way: Way) -> Option<f64> {
    match way {
        Way::Up => ladder.iter().copied().find(|rung| *rung > value),
        Way::Down => ladder.iter().rev().copied().find(|rung| *rung < value),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_between_rungs_moves_to_its_neighbours() {
        assert_eq!(next(&RATES, 7.5, Way::Up), Some(8.0));
        assert_eq!(next(&RATES, 7.5, Way::Down), Some(7.0));
    }

    #[test]
    fn the_ends_of_a_ladder_lead_nowhere() {
        assert_eq!(next(&RATES, 1.0, Way::Down), None);
        assert_eq!(next(&RATES, 5000.0, Way::Up), None);
        assert_eq!(next(&RATES, 5000.0, Way::Down), Some(1000.0));
    }

    #[test]
    fn rungs_ascend() {
        for ladder in [&RATES[..], &DEPTHS, &SPEEDS] {
            assert!(ladder.is_sorted_by(|a, b| a < b));
        }
    }
}
