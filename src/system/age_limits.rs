//! How old the sensing behind a push may be.

use std::time::Duration;

/// What a loop bears as its mean push age, where it is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AgeLimits {
    /// From here on small deviations grow.
    pub grows: Option<Duration>,
    /// From here on it is lost.
    pub falls: Option<Duration>,
}

impl AgeLimits {
    /// Where deviations grow, if it is not lost before.
    pub fn swings(self) -> Option<Duration> {
        let before = |grows: &Duration| self.falls.is_none_or(|falls| *grows < falls);
        self.grows.filter(before)
    }
}
