//! Events per second over the last second.

use ratelab::Time;

/// Width of one slice of the window.
const SLICE_NANOS: u64 = 100_000_000;

/// Slices in the window: one second.
const WINDOW: u64 = 10;

/// Slices kept: more than the window, so that a look slightly into the past or the future
/// still finds complete ones.
const KEPT: usize = 16;

/// Counts events per slice of run time.
#[derive(Clone, Debug, Default)]
pub(crate) struct RateWindow {
    /// The number of each slice, and its events.
    slices: [(u64, u32); KEPT],
}

impl RateWindow {
    /// Counts events at `stamp`, which may be earlier than the last one.
    pub(crate) fn count(&mut self, stamp: Time, events: u32) {
        let number = slice_number(stamp);
        let slice = &mut self.slices[number as usize % KEPT];
        if slice.0 < number {
            *slice = (number, 0);
        }
        // What is older than all kept slices is left out.
        if slice.0 == number {
            slice.1 = slice.1.saturating_add(events);
        }
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
        let (held, events) = self.slices[number as usize % KEPT];
        if held == number { events.into() } else { 0 }
    }
}

/// Returns the number of a slice; numbers start at one, so that zero marks an empty one.
fn slice_number(time: Time) -> u64 {
    time.as_nanos() / SLICE_NANOS + 1
}
