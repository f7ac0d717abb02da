//! The signals of a system, and the figures of its last state.

/// A quantity over time, from the messages of one recorded topic.
#[derive(Clone, Copy, Debug)]
pub struct Signal {
    /// Its name, such as `pole angle`.
    pub name: &'static str,
    /// Its unit, such as `°`; empty if it has none.
    pub unit: &'static str,
    /// The topic.
    pub topic: &'static str,
    /// The quantity in a message, given as its [`Fields`](crate::runtime::Fields).
    pub value: fn(&[f64]) -> f64,
    /// The least and the greatest value before the run is lost, if there are such.
    pub limits: Option<[f64; 2]>,
    /// What a plot of it reaches to as long as it is well: least and greatest.
    pub range: [f64; 2],
}

impl Signal {
    /// Whether `value` is beyond the limits.
    pub fn is_lost_at(&self, value: f64) -> bool {
        self.limits
            .is_some_and(|[least, greatest]| value < least || value > greatest)
    }
}

/// A figure of the state in which a run left the plant, for tables and programs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Final {
    /// Its name, such as `final_pole_angle`.
    pub name: &'static str,
    /// Its unit, such as `rad`.
    pub unit: &'static str,
    /// The figure.
    pub value: f64,
}
