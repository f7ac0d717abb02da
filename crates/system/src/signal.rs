//! The signals of a system, and the figures of its last state.

use std::{borrow::Cow, fmt, sync::Arc};

/// A quantity over time, from the messages of one recorded topic.
#[derive(Clone, Debug)]
pub struct Signal {
    /// Name, such as `pole angle`.
    pub name: Cow<'static, str>,
    /// Unit, such as `°`; empty if it has none.
    pub unit: Cow<'static, str>,
    /// Name of the topic.
    pub topic: Cow<'static, str>,
    /// Computes the quantity from a message's [`Fields`](ratelab_metrics::Fields).
    pub value: SignalValue,
    /// The least and the greatest value before the run is lost, if there are limits.
    pub limits: Option<[f64; 2]>,
    /// The range of its plot in normal operation: least and greatest.
    pub range: [f64; 2],
}

/// A quantity of a message.
#[derive(Clone)]
pub struct SignalValue(Arc<OfRow>);

type OfRow = dyn Fn(&[f64]) -> f64 + Send + Sync;

impl SignalValue {
    /// Computes the quantity by `value`.
    pub fn new(value: impl Fn(&[f64]) -> f64 + Send + Sync + 'static) -> Self {
        Self(Arc::new(value))
    }

    /// The quantity of the message with the numbers `row`.
    pub fn of(&self, row: &[f64]) -> f64 {
        (self.0)(row)
    }
}

impl fmt::Debug for SignalValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("SignalValue")
    }
}

impl Signal {
    /// Whether `value` is beyond the limits.
    pub fn is_lost_at(&self, value: f64) -> bool {
        self.limits
            .is_some_and(|[least, greatest]| value < least || value > greatest)
    }
}

/// A figure of the last state of the plant, for tables and programs.
#[derive(Clone, Debug, PartialEq)]
pub struct Final {
    /// Name, such as `final_pole_angle`.
    pub name: Cow<'static, str>,
    /// Unit, such as `rad`.
    pub unit: Cow<'static, str>,
    /// Value.
    pub value: f64,
}
