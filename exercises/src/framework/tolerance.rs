//! How near a prediction has to come.

use super::unit::in_unit;

/// How near a right prediction comes. The question states it, so that nobody is wrong by
/// a rounding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tolerance {
    /// The measured number itself, or the right choice.
    Exact,
    /// At most this far from the measured number, in the unit of the question.
    Within(f64),
    /// Anywhere from the last tested number that holds to the first that fails.
    Between,
}

impl Tolerance {
    /// The largest error of a right prediction.
    pub(super) fn within(self) -> f64 {
        match self {
            Self::Within(within) => within,
            Self::Exact | Self::Between => 0.0,
        }
    }

    /// The rule as a sentence, about a `quantity` in `unit`.
    pub(super) fn in_words(self, quantity: &str, unit: &str) -> String {
        match self {
            Self::Exact => "Right: the exact number.".to_owned(),
            Self::Within(within) => {
                format!(
                    "Right: within {} of the measurement.",
                    in_unit(within, unit)
                )
            }
            Self::Between => {
                format!("Right: any {quantity} from the last that holds to the first that fails.")
            }
        }
    }
}
