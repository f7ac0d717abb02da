//! How far the plant has come, and where that places things on the timelines.

use std::time::SystemTime;

use ratelab::runtime::{Head, Time};

use super::timeline::Stamps;

/// The steps of the plant in a batch, and what came before it.
pub struct Progress<'a> {
    /// Wall time at which run time was zero, where that means something.
    pub epoch: Option<SystemTime>,
    /// Steps before this batch.
    pub before: u64,
    /// Those of this batch: messages on the topic of states.
    pub steps: &'a [Head],
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

    /// A row for each of `messages`.
    pub fn stamps_of_messages(&self, messages: &[Head]) -> Stamps {
        self.stamps_of(messages.iter().map(|head| head.at))
    }

    /// Steps made by run time `at`, with that of `at` itself.
    pub fn step_at(&self, at: Time) -> u64 {
        let made = self.steps.partition_point(|head| head.at <= at);
        let newest = made
            .checked_sub(1)
            .and_then(|newest| self.steps.get(newest));
        newest.map_or(self.before, |head| head.seq + 1)
    }

    /// Steps made with this batch.
    pub fn step(&self) -> u64 {
        self.step_at(Time::MAX)
    }
}
