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
    /// What is drawn of the robot: none in recordings of early versions.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub geoms: Vec<GeomRecord>,
}

/// A part of a robot as it is drawn: the hull of its points, on a body that moves.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GeomRecord {
    /// Index of its body in the model.
    pub body: usize,
    /// Points in the frame of that body (m); one of a plane.
    pub points: Vec<[f64; 3]>,
    /// Radius of the ball around each point (m).
    #[serde(default)]
    pub radius: f64,
    /// The normal of a plane, in the same frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal: Option<[f64; 3]>,
}
