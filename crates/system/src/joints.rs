//! Messages as joint states: positions, velocities and efforts by name, as other robot
//! software exchanges them.

/// The numbers of a joint state.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointValues {
    /// Positions (rad or m).
    pub position: Vec<f64>,
    /// Velocities (rad/s or m/s).
    pub velocity: Vec<f64>,
    /// Efforts (Nm or N).
    pub effort: Vec<f64>,
}

impl JointValues {
    /// Whether all numbers are finite.
    pub fn is_finite(&self) -> bool {
        let all = [&self.position, &self.velocity, &self.effort];
        all.into_iter().flatten().all(|number| number.is_finite())
    }
}

/// The messages of a topic as joint states, and back.
#[derive(Clone, Copy, Debug)]
pub struct Joints {
    /// Name of the topic.
    pub topic: &'static str,
    /// Names of the joints.
    pub names: &'static [&'static str],
    /// The joint state of a message, given as the numbers of
    /// [`Fields`](ratelab_metrics::Fields).
    pub of_row: fn(&[f64]) -> Option<JointValues>,
    /// The numbers of the message with this joint state; `None` if values are missing or
    /// not finite.
    pub to_row: fn(&JointValues) -> Option<Vec<f64>>,
}
