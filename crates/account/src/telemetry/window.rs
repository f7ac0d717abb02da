//! Messages per second over the last second.

use ratelab::{
    Time,
    sync::atomic::{AtomicU64, Ordering},
};

/// Width of one slice of the window.
const SLICE_NANOS: u64 = 100_000_000;

/// Slices in the window: one second.
const WINDOW: u64 = 10;

/// Slices kept: more than the window, so that a reader slightly in the past or the future
/// still finds complete ones.
const KEPT: usize = 16;

/// Counts events per slice of run time; one writer, any number of readers, no
/// lock.
///
/// Each slice is one word, its number above and its count below, so a reader
/// can never see one without the other.
#[derive(Debug, Default)]
pub(crate) struct RateWindow {
    slices: [AtomicU64; KEPT],
}

impl RateWindow {
    /// Counts one event at `stamp`.
    #[inline]
    pub(crate) fn count(&self, stamp: Time) {
        self.count_many(stamp, 1);
    }

    /// Counts several events at `stamp`, which may be earlier than the last one.
    #[inline]
    pub(crate) fn count_many(&self, stamp: Time, events: u32) {
        let number = slice_number(stamp);
        let slice = &self.slices[node(number)];
        let word = slice.load(Ordering::Relaxed);
        let before = match word >> 32 {
            held if held > number => return, // Older than all kept slices.
            held if held == number => word as u32,
            _ => 0,
        };
        let count = number << 32 | u64::from(before.saturating_add(events));
        slice.store(count, Ordering::Relaxed);
    }

    /// Events per second in the last second of complete slices before `now`; in the first
    /// second of a run, over the elapsed part.
    pub(crate) fn per_second(&self, now: Time) -> f64 {
        let current = slice_number(now);
        let first = current.saturating_sub(WINDOW).max(1);
        if first == current {
            return 0.0;
        }
        let events: u64 = (first..current).map(|number| self.events_in(number)).sum();
        events as f64 * 1e9 / ((current - first) * SLICE_NANOS) as f64
    }

    /// Events within the last second, including the current slice.
    pub(crate) fn lately(&self, now: Time) -> u64 {
        let current = slice_number(now);
        let first = current.saturating_sub(WINDOW).max(1);
        (first..=current).map(|number| self.events_in(number)).sum()
    }

    fn events_in(&self, number: u64) -> u64 {
        let word = self.slices[node(number)].load(Ordering::Relaxed);
        if word >> 32 == number {
            word & 0xffff_ffff
        } else {
            0
        }
    }
}

/// The number of a slice; numbers start at one, so that zero marks an empty word.
fn slice_number(time: Time) -> u64 {
    time.as_nanos() / SLICE_NANOS + 1
}

fn node(number: u64) -> usize {
    number as usize % KEPT
}
