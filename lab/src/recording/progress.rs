//! How far the plant has come, and where that places things on the timelines.

use std::time::SystemTime;

use ratelab::{
    cartpole::ControlStep,
    runtime::{Message, Time},
};

use super::timeline::Stamps;

/// The control steps of a batch, and what came before it.
pub struct Progress<'a> {
    /// Wall time at which run time was zero, where that means something.
    pub epoch: Option<SystemTime>,
    /// Control steps made before this batch.
    pub before: u64,
    /// Those of this batch.
    pub steps: &'a [Message<ControlStep>],
}

impl Progress<'_> {
    /// No rows yet.
    pub fn stamps(&self) -> Stamps {
        Stamps::new(self.epoch)
    }

    /// A single row at run time `at`.
    pub fn stamp(&self, at: Time) -> Stamps {
        self.stamps_of([at])
    }

    /// A row for each of `times`.
    pub fn stamps_of(&self, times: impl IntoIterator<Item = Time>) -> Stamps {
        let mut stamps = self.stamps();
        for at in times {
            stamps.push(at, self.step_at(at));
        }
        stamps
    }

    /// A row per control step of this batch.
    pub fn at_steps(&self) -> Stamps {
        let mut stamps = self.stamps();
        for message in self.steps {
            stamps.push(message.stamp, message.data.step);
        }
        stamps
    }

    /// Control steps made by run time `at`, with that of `at` itself.
    pub fn step_at(&self, at: Time) -> u64 {
        let made = self.steps.partition_point(|message| message.stamp <= at);
        match made.checked_sub(1) {
            Some(newest) => self.steps[newest].data.step,
            None => self.before,
        }
    }

    /// Control steps made with this batch.
    pub fn step(&self) -> u64 {
        self.step_at(Time::MAX)
    }
}
