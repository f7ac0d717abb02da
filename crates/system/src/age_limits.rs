//! Limits on the age of the sensing behind a push.

use std::time::Duration;

/// Limits of the mean push age of a control loop, where they are known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AgeLimits {
    /// Above this mean age small deviations grow.
    pub grows: Option<Duration>,
    /// From this mean age on, up to [`falls`](Self::falls), it depends on what makes the pushes
    /// old whether the run is lost.
    pub may_fall: Option<Duration>,
    /// Above this mean age the run is lost. It is borne where the age is constant.
    pub falls: Option<Duration>,
}

impl AgeLimits {
    /// The age at which deviations grow, if it is below the age of a loss.
    pub fn swings(self) -> Option<Duration> {
        let before = |grows: &Duration| self.falls.is_none_or(|falls| *grows < falls);
        self.grows.filter(before)
    }
}
