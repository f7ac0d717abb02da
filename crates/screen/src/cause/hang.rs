//! Hangs, by the knobs that caused them.

use std::{ops::Range, time::Duration};

use ratelab::{Knob, Time, TimedKnob};
use ratelab_system::Setup;

/// A tick that a knob makes long.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Hang {
    /// Run time of the knob: the tick is the next one.
    pub at: Time,
    /// The node.
    pub node: String,
    /// Duration of the tick.
    pub cost: Duration,
}

impl Hang {
    /// Returns the hang that `timed` causes, if any.
    pub fn from_knob(timed: &TimedKnob) -> Option<Self> {
        match &timed.knob {
            Knob::Hang { node, cost } => Some(Self {
                at: timed.at,
                node: node.clone(),
                cost: *cost,
            }),
            _ => None,
        }
    }

    /// Returns the hangs that a run with `setup` begins with.
    pub fn at_the_start(setup: &Setup) -> Vec<Self> {
        let at = Time::ZERO;
        let knobs = setup.iter().cloned().map(|knob| TimedKnob { at, knob });
        knobs.filter_map(|timed| Self::from_knob(&timed)).collect()
    }

    /// Returns when it may be going on, for a node with this `period`.
    pub fn span(&self, period: Duration) -> Range<Time> {
        self.at..self.at + period + self.cost
    }
}
