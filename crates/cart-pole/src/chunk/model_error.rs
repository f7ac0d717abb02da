//! The model of a plan, which may differ from the plant.

use std::{fmt, str::FromStr};

use crate::ParameterError;

/// How much longer the pole of the plan's model is than the plant's. As text `length:1.2`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelError {
    /// The factor.
    pub length: f64,
}

impl ModelError {
    /// The accepted factors.
    const LENGTHS: [f64; 2] = [0.1, 10.0];
}

impl Default for ModelError {
    fn default() -> Self {
        Self { length: 1.0 }
    }
}

impl fmt::Display for ModelError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "length:{}", self.length)
    }
}

impl FromStr for ModelError {
    type Err = ParameterError;

    fn from_str(text: &str) -> Result<Self, ParameterError> {
        let [min, max] = Self::LENGTHS;
        let length = text.trim().strip_prefix("length:").map(str::parse);
        match length {
            Some(Ok(length)) if (min..=max).contains(&length) => Ok(Self { length }),
            _ => Err(ParameterError::Model {
                text: text.to_owned(),
                min: min.to_string(),
                max: max.to_string(),
            }),
        }
    }
}
