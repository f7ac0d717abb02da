//! A measured figure of an exercise.

/// A figure with a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Measurement {
    /// Name, with the unit.
    pub name: String,
    /// Measured value.
    pub value: f64,
}

impl Measurement {
    /// Creates the measurement `name` with `value`.
    pub fn new(name: impl Into<String>, value: impl Into<f64>) -> Self {
        Self {
            name: name.into(),
            value: value.into(),
        }
    }
}
