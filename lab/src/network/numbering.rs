//! Numbers that go on where a process that was started again begins anew.

use std::collections::HashMap;

/// The numbering of each of several series.
#[derive(Default)]
pub struct Numbering(HashMap<usize, SeriesNumbers>);

#[derive(Default)]
struct SeriesNumbers {
    process: u64,
    /// Numbers used by earlier processes.
    before: u64,
    next: u64,
}

impl Numbering {
    /// The number in `series` of what `process` calls `number`.
    pub fn number(&mut self, series: usize, process: u64, number: u64) -> u64 {
        let series = self.0.entry(series).or_insert_with(|| SeriesNumbers {
            process,
            ..SeriesNumbers::default()
        });
        if series.process != process {
            series.process = process;
            series.before = series.next;
        }
        let number = series.before.saturating_add(number);
        series.next = number.saturating_add(1);
        number
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_restart_goes_on_after_the_last_number() {
        let mut numbering = Numbering::default();
        assert_eq!(numbering.number(0, 1, 40), 40);
        assert_eq!(numbering.number(0, 1, 43), 43);
        assert_eq!(numbering.number(0, 2, 0), 44);
        assert_eq!(numbering.number(0, 2, 1), 45);
        assert_eq!(numbering.number(1, 2, 7), 7);
    }
}
