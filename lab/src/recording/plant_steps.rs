//! The progress of the plant, and the resulting positions on the timelines.

use std::time::SystemTime;

use ratelab::{Head, Time};

use super::timeline::Stamps;

/// The steps of the plant in a batch, and their number before it.
pub struct PlantSteps<'a> {
    /// Wall time at which run time was zero, under the real clock.
    pub epoch: Option<SystemTime>,
    /// Number of steps before this batch.
    pub before: u64,
    /// Steps in this batch: messages on the topic of states.
    pub steps: &'a [Head],
}

impl PlantSteps<'_> {
    /// No rows.
    pub fn stamps(&self) -> Stamps {
        Stamps::new(self.epoch)
    }

    /// One row at run time `at`.
    pub fn stamp(&self, at: Time) -> Stamps {
        self.stamps_of([at])
    }

    /// One row for each of `times`.
    pub fn stamps_of(&self, times: impl IntoIterator<Item = Time>) -> Stamps {
        let mut stamps = self.stamps();
        for at in times {
            stamps.push(at, self.step_at(at));
        }
        stamps
    }

    /// One row for each of `messages`.
    pub fn stamps_of_messages(&self, messages: &[Head]) -> Stamps {
        self.stamps_of(messages.iter().map(|head| head.at))
    }

    /// Number of steps by run time `at`, including `at` itself.
    pub fn step_at(&self, at: Time) -> u64 {
        let made = self.steps.partition_point(|head| head.at <= at);
        let newest = made
            .checked_sub(1)
            .and_then(|newest| self.steps.get(newest));
        newest.map_or(self.before, |head| head.seq + 1)
    }

    /// Number of steps by the end of this batch.
    pub fn step(&self) -> u64 {
        self.step_at(Time::MAX)
    }
}
