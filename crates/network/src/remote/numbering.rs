//! Numbers, times and totals that go on where a process that was started again begins anew.

use std::collections::HashMap;

use ratelab::Time;

/// A count that goes on.
#[derive(Default)]
struct Count {
    process: u64,
    /// Counted by earlier processes.
    before: u64,
    now: u64,
    /// The processes before it, each with what was counted before that.
    earlier: Vec<(u64, u64)>,
}

impl Count {
    /// Returns what `process` calls `count`, after all that earlier processes counted.
    fn after_others(&mut self, process: u64, count: u64) -> u64 {
        if self.process != process {
            self.earlier.push((self.process, self.before));
            self.process = process;
            self.before = self.now;
        }
        self.before.saturating_add(count)
    }

    /// Returns what `process` calls `count`, if anything of that process has come.
    fn known(&self, process: u64, count: u64) -> Option<u64> {
        let now = [(self.process, self.before)];
        let mut processes = now.iter().chain(self.earlier.iter().rev());
        let (_, before) = processes.find(|(known, _)| *known == process)?;
        Some(before.saturating_add(count))
    }
}

/// The numbering of each of several series, with their times.
#[derive(Default)]
pub struct Numbering(HashMap<usize, (Count, Time)>);

/// The place of an item in its series.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SeriesPlace {
    /// Its number.
    pub number: u64,
    /// Its run time, never before that of the item before: a better estimate of a clock
    /// may have moved it.
    pub at: Time,
    /// Numbers between it and the item before.
    pub missing: u64,
}

impl Numbering {
    /// Returns the place in `series` of the item that `process` calls `number`, at run time `at`;
    /// `None` if it was there already.
    pub fn place(
        &mut self,
        series: usize,
        process: u64,
        number: u64,
        at: Time,
    ) -> Option<SeriesPlace> {
        let is_first = !self.0.contains_key(&series);
        let (count, last) = self.0.entry(series).or_default();
        let number = count.after_others(process, number);
        let missing = number.checked_sub(count.now)?;
        count.now = number.saturating_add(1);
        *last = at.max(*last);
        Some(SeriesPlace {
            number,
            at: *last,
            missing: if is_first { 0 } else { missing },
        })
    }
}

impl Numbering {
    /// Returns the number in `series` of the item that `process` calls `number`; `None` if nothing
    /// of that process has come.
    pub fn known(&self, series: usize, process: u64, number: u64) -> Option<u64> {
        self.0.get(&series)?.0.known(process, number)
    }
}

/// Totals of several counters.
#[derive(Default)]
pub struct Totals(HashMap<usize, Count>);

impl Totals {
    /// Returns the total of `counter`, of which `process` has counted `count`.
    pub fn total(&mut self, counter: usize, process: u64, count: u64) -> u64 {
        let total = self.0.entry(counter).or_default();
        total.now = total.after_others(process, count).max(total.now);
        total.now
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The number, the run time (ns) and what is missing before it.
    fn place(of: &mut Numbering, process: u64, number: u64, at: u64) -> Option<(u64, u64, u64)> {
        let place = of.place(0, process, number, Time::from_nanos(at))?;
        Some((place.number, place.at.as_nanos(), place.missing))
    }

    #[test]
    fn a_restart_goes_on_after_the_last_number() {
        let of = &mut Numbering::default();
        assert_eq!(place(of, 1, 40, 5), Some((40, 5, 0)));
        assert_eq!(place(of, 1, 43, 6), Some((43, 6, 2)));
        assert_eq!(place(of, 1, 43, 6), None);
        assert_eq!(place(of, 2, 0, 4), Some((44, 6, 0)));
        assert_eq!(place(of, 2, 2, 7), Some((46, 7, 1)));
        let other = of.place(1, 2, 7, Time::ZERO).expect("another series");
        assert_eq!((other.number, other.missing), (7, 0));
    }

    #[test]
    fn a_restart_adds_to_the_total() {
        let totals = &mut Totals::default();
        let counts = [(1, 3), (1, 5), (2, 0), (2, 4), (3, 1)];
        let found = counts.map(|(process, count)| totals.total(0, process, count));
        assert_eq!(found, [3, 5, 5, 9, 10]);
    }
}
