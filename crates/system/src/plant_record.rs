//! What a recording keeps of a plant, so that its run is repeated without the files of the model.

use serde::{Deserialize, Serialize};

/// A robot of an MJCF file with the reference that its runs begin at.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlantRecord {
    /// Step of physics (ms).
    pub step_ms: f64,
    /// The compiled physics, as text.
    pub model: String,
    /// The positions of the reference.
    pub positions: Vec<f64>,
    /// The controls there.
    pub controls: Vec<f64>,
    /// The activations there.
    pub activations: Vec<f64>,
}
