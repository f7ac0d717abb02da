//! A figure that an exercise measured.

/// A figure with a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Measurement {
    /// What it is, and its unit.
    pub name: String,
    /// What was measured.
    pub value: f64,
}

impl Measurement {
    /// `value`, measured as `name`.
    pub fn new(name: impl Into<String>, value: impl Into<f64>) -> Self {
        Self {
            name: name.into(),
            value: value.into(),
        }
    }
}
