//! The promised measurements of every exercise, from one file.

use std::{collections::BTreeMap, fmt};

use serde::Deserialize;
use thiserror::Error;

use super::Brief;

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

    /// Returns the figures of `subject`, each with its name.
    pub(crate) fn list<const N: usize>(
        subject: impl fmt::Display,
        figures: [(&str, f64); N],
    ) -> [Self; N] {
        figures.map(|(what, value)| Self::new(format!("{subject}: {what}"), value))
    }
}

/// The bands of all exercises, from `bands.toml`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expectations {
    /// Sources of the figures, by the word that bands use for them.
    pub sources: BTreeMap<String, String>,
    /// By exercise, then by measurement.
    pub exercises: BTreeMap<String, BTreeMap<String, Expectation>>,
}

/// The band of a measurement. All given conditions must hold.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expectation {
    /// The exact value.
    pub equals: Option<f64>,
    /// The exact text with the same number of decimals.
    pub reads: Option<String>,
    /// The lower bound.
    pub at_least: Option<f64>,
    /// The upper bound.
    pub at_most: Option<f64>,
    /// Source of the figure: one of [`Expectations::sources`].
    pub source: String,
}

/// A measurement with its band.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// Name of the measurement.
    pub name: String,
    /// The value; `None` if the exercise no longer measures it.
    pub measured: Option<f64>,
    /// The band; `None` if the file has none for it.
    pub band: Option<Expectation>,
}

/// An unusable file of bands: the reason, and what to do.
#[derive(Clone, Debug, Error)]
#[error("{0}")]
pub struct ExpectationsError(String);

impl Expectations {
    /// Loads the bands included with the exercises.
    ///
    /// # Errors
    /// [`ExpectationsError`] if the file is damaged.
    pub fn load() -> Result<Self, ExpectationsError> {
        Self::parse(include_str!("../../bands.toml"))
    }

    /// Parses the bands in `text`.
    ///
    /// # Errors
    /// [`ExpectationsError`] if it is invalid, or a band lacks bounds or a source.
    pub fn parse(text: &str) -> Result<Self, ExpectationsError> {
        let bands: Result<Self, _> = toml::from_str(text);
        let bands =
            bands.map_err(|why| ExpectationsError(format!("bands.toml cannot be read: {why}")))?;
        for (name, band) in bands.exercises.values().flatten() {
            if band.bounds().is_empty() {
                return Err(ExpectationsError(format!(
                    "the band of {name:?} holds for every value: give it equals, reads, at_least \
                     or at_most"
                )));
            }
            if !bands.sources.contains_key(&band.source) {
                return Err(ExpectationsError(format!(
                    "the band of {name:?} comes from {:?}, which is none of the sources: add it \
                     there",
                    band.source
                )));
            }
        }
        Ok(bands)
    }

    /// Pairs the measurements of an exercise with their bands: all measurements, and all
    /// bands without a measurement.
    ///
    /// # Errors
    /// [`ExpectationsError`] if the file lacks the exercise.
    pub fn compare(
        &self,
        exercise: &Brief,
        measurements: &[Measurement],
    ) -> Result<Vec<Check>, ExpectationsError> {
        let bands = self.exercises.get(&exercise.name).ok_or_else(|| {
            let name = &exercise.name;
            let what_to_do = format!("add [exercises.{name}] to bands.toml");
            ExpectationsError(format!("exercise {name:?} has no bands: {what_to_do}"))
        })?;
        let measured = measurements.iter().map(|measurement| Check {
            name: measurement.name.clone(),
            measured: Some(measurement.value),
            band: bands.get(&measurement.name).cloned(),
        });
        let is_measured = |name: &str| measurements.iter().any(|m| m.name == name);
        let missing = bands
            .iter()
            .filter(|(name, _)| !is_measured(name))
            .map(|(name, band)| Check {
                name: name.clone(),
                measured: None,
                band: Some(band.clone()),
            });
        Ok(measured.chain(missing).collect())
    }
}

impl Expectation {
    /// Returns whether `value` lies in the band.
    pub fn holds(&self, value: f64) -> bool {
        let reads = |text: &str| {
            let decimals = text
                .split_once('.')
                .map_or(0, |(_, decimals)| decimals.len());
            format!("{value:.decimals$}") == text
        };
        value.is_finite()
            && self.equals.is_none_or(|exact| value == exact)
            && self.reads.as_deref().is_none_or(reads)
            && self.at_least.is_none_or(|least| value >= least)
            && self.at_most.is_none_or(|most| value <= most)
    }

    /// Returns its conditions, in words.
    fn bounds(&self) -> Vec<String> {
        let bounds = [
            self.equals.map(|value| format!("exactly {value}")),
            self.reads.clone(),
            self.at_least.map(|value| format!("at least {value}")),
            self.at_most.map(|value| format!("at most {value}")),
        ];
        bounds.into_iter().flatten().collect()
    }
}

impl fmt::Display for Expectation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.bounds().join(", "))
    }
}

impl Check {
    /// Returns whether the measurement exists, has a band, and lies in it.
    pub fn holds(&self) -> bool {
        self.band
            .as_ref()
            .zip(self.measured)
            .is_some_and(|(band, measured)| band.holds(measured))
    }
}

impl fmt::Display for Check {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.name)?;
        match (self.measured, &self.band) {
            (Some(measured), Some(band)) => {
                write!(f, "{measured}, expected {band} ({})", band.source)
            }
            (None, Some(band)) => write!(f, "not measured, expected {band} ({})", band.source),
            (Some(measured), None) => write!(f, "{measured}, for which there is no band"),
            (None, None) => f.write_str("not measured"),
        }
    }
}
