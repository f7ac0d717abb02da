//! Actions that are planned ahead, as data.

use std::{sync::Arc, time::Duration};

use ratelab::{Head, Knob, Time};

/// How the plans of a system are read from its topics. A run may lack some of these.
#[derive(Clone, Copy, Debug)]
pub struct Planning {
    /// Name of the topic of plans.
    pub plans: &'static str,
    /// Reads the plan in a message there; `None` if there is none.
    pub plan: fn(&Self, &Head, &[f64]) -> Option<ActionPlan>,
    /// Name of the topic with the steps of the node that plays them.
    pub steps: &'static str,
    /// Reads the step in a message there; `None` if there is none.
    pub step: fn(&Self, &[f64]) -> Option<PlayStep>,
    /// Name of the topic of the actions that it played.
    pub played: &'static str,
    /// Reads the action in a message there.
    pub action: fn(&[f64]) -> f64,
    /// The greatest action, in either direction.
    pub most: f64,
    /// The numbers of an action, of which plans have the first.
    pub width: usize,
    /// The time that an action is meant for.
    pub period: Duration,
    /// The knob for plans of at least so many actions.
    pub longer: fn(usize) -> Knob,
    /// The knob for plans that expect this delay.
    pub expecting: fn(Duration) -> Knob,
    /// Parameters that may spoil a run, the worst first.
    pub spoilers: &'static [Spoiler],
}

impl Planning {
    /// Returns its topics.
    pub fn topics(&self) -> [&'static str; 3] {
        [self.plans, self.steps, self.played]
    }
}

/// A parameter that may spoil a run, with the value that does not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Spoiler {
    /// Its node.
    pub node: &'static str,
    /// Its name.
    pub name: &'static str,
    /// Its value in a run with plans that sets none.
    pub usual: &'static str,
    /// The value that spoils nothing.
    pub sound: &'static str,
    /// What any other value does, with `{}` for that.
    pub told: &'static str,
}

/// Actions, one after the other.
#[derive(Clone, Debug, PartialEq)]
pub struct ActionPlan {
    /// How it was made, in a word.
    pub kind: &'static str,
    /// Run time at which its making began.
    pub made: Time,
    /// The delay from then on after which it was expected to be there.
    pub expected: Duration,
    /// Run time for which the first action is meant.
    pub begins: Time,
    /// The time that each is meant for; not zero.
    pub period: Duration,
    /// The actions.
    pub actions: Arc<[f64]>,
}

impl ActionPlan {
    /// Returns the run time at which its last action is over.
    pub fn ends(&self) -> Time {
        self.begins + self.period * self.actions.len() as u32
    }

    /// Returns the place of the action that is meant for run time `at`; beyond the last one, how far.
    /// `None` before the first.
    pub fn place(&self, at: Time) -> Option<usize> {
        let since = at.as_nanos().checked_sub(self.begins.as_nanos())?;
        let place = u128::from(since) / self.period.as_nanos().max(1);
        usize::try_from(place).ok()
    }

    /// Returns the action that is meant for run time `at`.
    pub fn action(&self, at: Time) -> Option<f64> {
        self.actions.get(self.place(at)?).copied()
    }
}

/// What the node that plays plans did, at a moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlayStep {
    /// Number of the newest plan that it has, counted from zero on the topic of plans.
    pub newest: u64,
    /// Whether it took that plan now.
    pub took: bool,
    /// Whether it has no action for now.
    pub stalls: bool,
    /// The time that an action is for.
    pub period: Duration,
    /// The part of the age of the action that it played of which the plan knew what would
    /// happen meanwhile; `None` if it played none now.
    pub predicted: Option<Duration>,
}
