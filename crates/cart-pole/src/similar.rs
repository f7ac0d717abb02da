//! Readings that are too similar to the last one to be sent.

use super::{ParameterError, message::Observation};

/// Lets a reading pass if it is at least so far from the last one that passed: the Euclidean
/// distance of their five numbers, whatever their units. At 0, the default, all pass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SimilarReadings {
    norm: f64,
    last: Option<Observation>,
}

impl SimilarReadings {
    /// Parses a distance of 0 or more, before the first reading.
    ///
    /// # Errors
    /// [`ParameterError`] for an invalid text.
    pub fn parse(text: &str) -> Result<Self, ParameterError> {
        let norm: Option<f64> = text.trim().parse().ok();
        match norm.filter(|norm| *norm >= 0.0 && norm.is_finite()) {
            Some(norm) => Ok(Self { norm, last: None }),
            None => Err(ParameterError::Distance(text.to_owned())),
        }
    }

    /// Returns the distance below which readings are similar.
    pub fn norm(&self) -> f64 {
        self.norm
    }

    /// Sets the distance; returns the one before.
    pub(super) fn set(&mut self, text: &str) -> Result<String, ParameterError> {
        let norm = Self::parse(text)?.norm;
        Ok(std::mem::replace(&mut self.norm, norm).to_string())
    }

    /// Returns whether `reading` passes.
    pub(super) fn pass(&mut self, reading: &Observation) -> bool {
        let near_last = |last| distance(&last, reading) < self.norm;
        let near = self.norm > 0.0 && self.last.is_some_and(near_last);
        if !near {
            self.last = Some(*reading);
        }
        !near
    }
}

fn distance(one: &Observation, other: &Observation) -> f64 {
    let pairs = one.to_array().into_iter().zip(other.to_array());
    let squares = pairs.map(|(one, other)| {
        let apart = f64::from(one) - f64::from(other);
        apart * apart
    });
    squares.sum::<f64>().sqrt()
}
