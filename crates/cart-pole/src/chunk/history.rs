//! What was played so far.

use std::collections::VecDeque;

use ratelab::Time;

/// The most ticks that are remembered: three quarters of an hour.
const MAX_TICKS: usize = 1 << 17;

/// What the player played. Figures of the run are made of it, so it outlives a crash.
#[derive(Default)]
pub(super) struct History {
    pub(super) ticks: VecDeque<PlayedTick>,
    /// Number of published actions.
    published: u64,
    /// Number of actions before its last restart.
    forgotten: u64,
    /// The last one.
    pub(super) last: Option<f32>,
}

/// A tick of the player.
pub(super) struct PlayedTick {
    pub(super) start: Time,
    /// The action that it published, or else the one before; its cost left aside.
    pub(super) action: f32,
    /// Number of actions published before.
    before: u64,
}

impl History {
    /// Returns the number of actions that were published in ticks which started at `since` or
    /// later, as far as the player remembers.
    pub(super) fn executed(&self, since: Time) -> u64 {
        let first = self.ticks.partition_point(|tick| tick.start < since);
        let before = self.ticks.get(first).map(|tick| tick.before);
        self.published - before.unwrap_or(self.published).max(self.forgotten)
    }

    /// Adds a tick, with its action if any.
    pub(super) fn begin(&mut self, start: Time, action: Option<f32>) {
        if self.ticks.len() == MAX_TICKS {
            self.ticks.pop_front();
        }
        self.ticks.push_back(PlayedTick {
            start,
            action: action.or(self.last).unwrap_or_default(),
            before: self.published,
        });
    }

    /// The action of the last tick is published.
    pub(super) fn publish(&mut self, action: f32) {
        self.published += 1;
        self.last = Some(action);
    }

    /// The player begins anew; its last tick came to nothing if it was `cut_off`.
    pub(super) fn restart(&mut self, cut_off: bool) {
        self.forgotten = self.published;
        if let Some(tick) = self.ticks.back_mut().filter(|_| cut_off) {
            tick.action = self.last.unwrap_or_default();
        }
    }
}
