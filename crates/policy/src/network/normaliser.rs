//! A normaliser in front of the first layer, of a library that is known by the names of its statistics.

use super::{
    error::{quoted, unfit},
    state_item::{StateItem, StateKind, is_beside},
    tensor::Tensor,
};
use crate::WeightsError;

/// The statistics of a normaliser of rsl_rl, `EmpiricalNormalization`.
const STATISTICS: [&str; 4] = ["_mean", "_std", "_var", "count"];

/// What rsl_rl adds to the standard deviation.
const LEAST: f32 = 1e-2;

/// What is taken from each number of an observation, and what it is divided by then.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Normaliser {
    mean: Vec<f32>,
    divisor: Vec<f32>,
}

impl Normaliser {
    /// Returns the beginning of the names of its statistics among `items`, if the actor has one.
    pub(super) fn stem<'f>(items: &[StateItem<'f>]) -> Option<&'f str> {
        let mut stems = items
            .iter()
            .filter(|item| !is_beside(item.name))
            .filter_map(|item| item.name.strip_suffix("_std")?.strip_suffix('.'));
        let stem = stems.next()?;
        let is_there = |statistic: &&str| {
            let mut tensors = items
                .iter()
                .filter(|item| matches!(item.kind, StateKind::Tensor(_)));
            tensors.any(|item| is_statistic(item.name, stem, statistic))
        };
        let is_whole = STATISTICS.iter().all(is_there);
        (is_whole && stems.next().is_none()).then_some(stem)
    }

    /// Returns whether a tensor is one of the statistics that begin with `stem`.
    pub(super) fn has(stem: &str, tensor: &str) -> bool {
        STATISTICS
            .iter()
            .any(|statistic| is_statistic(tensor, stem, statistic))
    }

    /// Reads the statistics that begin with `stem`, of `inputs` numbers.
    ///
    /// # Errors
    /// [`WeightsError`] for statistics of another size, and numbers that are not finite.
    pub(super) fn read(
        stem: &str,
        inputs: usize,
        mut read: impl FnMut(&str) -> Result<Tensor, WeightsError>,
    ) -> Result<Self, WeightsError> {
        let mut numbers = |statistic: &str| {
            let name = format!("{stem}.{statistic}");
            let values = read(&name)?.values;
            let is_sound = values.iter().all(|value| value.is_finite());
            if values.len() == inputs && is_sound {
                return Ok(values);
            }
            Err(unfit(format!(
                "expected {inputs} finite numbers in {}, found others",
                quoted(&name)
            )))
        };
        let (mean, deviations) = (numbers("_mean")?, numbers("_std")?);
        let divisor: Vec<f32> = deviations.iter().map(|std| std + LEAST).collect();
        if divisor.iter().any(|divisor| *divisor <= 0.0) {
            let what = format!("expected deviations in \"{stem}._std\", found one below zero");
            return Err(unfit(what));
        }
        Ok(Self { mean, divisor })
    }

    /// Normalises an observation.
    pub(super) fn apply(&self, observation: &mut [f32]) {
        let statistics = self.mean.iter().zip(&self.divisor);
        for (number, (mean, divisor)) in observation.iter_mut().zip(statistics) {
            *number = (*number - mean) / divisor;
        }
    }
}

fn is_statistic(tensor: &str, stem: &str, statistic: &str) -> bool {
    let rest = tensor.strip_prefix(stem);
    rest.and_then(|rest| rest.strip_prefix('.')) == Some(statistic)
}
