//! Clocks that keep a node silent, or that are too coarse for its rate, as known before a run.

use std::time::Duration;

use ratelab::{ClockError, Hz, Knob, Time, millis};

use super::GraphSystem;
use crate::{FULL, Setup};

/// How late a first tick is from which on it is worth a note, beyond the offset of its node.
const LATE: Duration = Duration::from_secs(1);

impl GraphSystem {
    /// Returns what the clocks of a run with `setup` do to nodes at a rate.
    pub(super) fn clock_warnings(&self, setup: &Setup) -> Vec<String> {
        let warnings = self
            .topology()
            .nodes
            .iter()
            .filter(|node| node.triggers.is_empty())
            .filter_map(|node| {
                let error = setup
                    .iter()
                    .filter(|knob| knob.target() == node.name)
                    .find_map(|knob| match knob {
                        Knob::Clock { error, .. } => Some(*error),
                        _ => None,
                    })?;
                let offset = setup.offset(&node.name).unwrap_or_default();
                let hz = setup.rate(&node.name).unwrap_or(node.hz);
                silent(&node.name, error, offset).or_else(|| coarse(&node.name, error, hz))
            });
        warnings.collect()
    }
}

/// Returns a node whose clock shows the due time of the first tick long after the run has begun.
fn silent(node: &str, error: ClockError, offset: Duration) -> Option<String> {
    let due = Time::ZERO + offset;
    let first = error.when(due);
    (first > due + LATE).then(|| {
        let late = (first.as_secs_f64() * 10.0).round() / 10.0;
        format!(
            "{node} ticks first at {late:.1} s: its clock ({error}) shows {:.1} s then, when its \
             first tick is due",
            due.as_secs_f64()
        )
    })
}

/// Returns a node at a rate above that of the steps of its clock.
fn coarse(node: &str, error: ClockError, hz: Hz) -> Option<String> {
    let (step, period) = (error.step().as_secs_f64(), 1.0 / hz.get());
    (step > period * FULL).then(|| {
        format!(
            "{node} ticks at {hz}, but its clock goes in steps of {} ms, so it will skip {:.0} % of \
             its periods: raise the rate of the clock",
            millis::to_millis(error.step()),
            (1.0 - period / step) * 1e2
        )
    })
}
