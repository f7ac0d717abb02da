//! What a policy is made with.

use ratelab::Hz;

/// The inputs of a policy besides its observations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PolicyContext {
    /// The seed of the run.
    pub seed: u64,
    /// Control rate at the start of the run.
    pub control_hz: Hz,
    /// Number of actions in a chunk; `None` for single actions.
    pub chunk: Option<usize>,
}
