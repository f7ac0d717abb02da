//! Brains that were read.

use super::{Brain, LoadedBrain, brain::BrainError};

/// Brains in memory, so that a run reads them before it begins and a sweep reads
/// them once. Copies share the weights.
#[derive(Clone, Debug, Default)]
pub struct Shelf(Vec<(Brain, LoadedBrain)>);

impl Shelf {
    /// Reads `brains`.
    ///
    /// # Errors
    /// [`BrainError`] if one of them cannot be had.
    pub fn of<'b>(brains: impl IntoIterator<Item = &'b Brain>) -> Result<Self, BrainError> {
        let mut shelf = Self::default();
        for brain in brains {
            shelf.fetch(brain)?;
        }
        Ok(shelf)
    }

    /// The brain from the shelf; one that is not there is read and put there.
    ///
    /// # Errors
    /// [`BrainError`] if it cannot be had.
    pub fn fetch(&mut self, brain: &Brain) -> Result<LoadedBrain, BrainError> {
        if let Some((_, loaded)) = self.0.iter().find(|(known, _)| known == brain) {
            return Ok(loaded.clone());
        }
        let loaded = brain.load()?;
        self.0.push((brain.clone(), loaded.clone()));
        Ok(loaded)
    }
}
