//! Compares the recorded items with those of the new run, one by one.

use std::sync::atomic::{AtomicBool, Ordering};

use crossbeam_channel::Sender;
use ratelab::runtime::{Command, Time};

use super::{
    difference::{Difference, SeriesItem},
    series::Series,
};
use crate::recording::reader::Recording;

/// Compares several series of one run at the same time, until one differs.
pub struct Comparison {
    /// Whether the recording goes on to the end of the run.
    complete: bool,
    /// When the last of its series had begun: those that are empty had, too.
    begun: Time,
    /// Whether one differs, or the run was to end early.
    found: AtomicBool,
    commands: Sender<Command>,
}

impl Comparison {
    /// Of `recording`, which may not be `complete`, and of the run that obeys
    /// `commands`.
    pub fn new(recording: &Recording, complete: bool, commands: Sender<Command>) -> Self {
        let messages = recording
            .topics
            .iter()
            .filter_map(|rows| rows.heads().first());
        let ticks = recording.ticks.iter().filter_map(|ticks| ticks.first());
        let firsts = messages.map(|head| head.at);
        Self {
            complete,
            begun: firsts
                .chain(ticks.map(|tick| tick.at))
                .max()
                .unwrap_or_default(),
            found: AtomicBool::new(false),
            commands,
        }
    }

    /// Compares what comes with what was recorded, and ends the run if that is
    /// not the same.
    pub fn compare(&self, mut series: impl Series) -> Option<Difference> {
        // The tap goes with the first difference: the run no longer waits for it.
        let difference = self.first_difference(&mut series)?;
        self.stop();
        Some(difference)
    }

    /// Ends the run before its end.
    pub fn stop(&self) {
        self.found.store(true, Ordering::Relaxed);
        let _ = self.commands.send(Command::Stop); // It may be over.
    }

    fn first_difference(&self, series: &mut impl Series) -> Option<Difference> {
        let mut index = 0;
        while series.wait() {
            let mut computed = 0;
            while let Some(item) = series.computed(computed) {
                if !self.is_before(series, &item) {
                    if series.recorded(index).is_none() {
                        return self.complete.then(|| item.not_recorded());
                    }
                    let difference = series.compare(index, computed);
                    if difference.is_some() {
                        return difference;
                    }
                    index += 1;
                }
                computed += 1;
            }
        }
        let missing = series.recorded(index)?;
        // A run that was ended because of another difference lacks what came after.
        let ended = self.found.load(Ordering::Relaxed);
        (!ended).then(|| missing.not_computed())
    }

    /// Whether something came before it was recorded: recordings may begin later
    /// than runs.
    fn is_before(&self, series: &impl Series, item: &SeriesItem) -> bool {
        match series.recorded(0) {
            Some(first) => item.number < first.number,
            None => item.at < self.begun,
        }
    }
}
