//! Compares the recorded items with those of the new run, one by one.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use crossbeam_channel::Sender;
use ratelab::{Command, Time};
use ratelab_account::Observer;

use super::{
    Identical,
    difference::{Difference, SeriesItem},
    order,
    series::Series,
};
use crate::recording::reader::Recording;

/// Compares several series of one run at the same time, until one differs.
pub struct Comparison {
    /// Whether the recording goes on to the end of the run.
    complete: bool,
    /// Whether it was under the real clock, and can be executed again up to some moment
    /// only.
    cut: bool,
    /// Number of items that the recorder may have lost.
    may_lack: u64,
    lacks: AtomicU64,
    messages: AtomicU64,
    ticks: AtomicU64,
    /// When the last of its series had begun: those that are empty had, too.
    begun: Time,
    /// Whether one differs, or the run was to end early.
    found: AtomicBool,
    commands: Sender<Command>,
}

impl Comparison {
    /// Of `recording`, which may not be `complete`, and of the run that obeys
    /// `commands`. With `threads` it was under the real clock, and the recorder may have
    /// lost some.
    pub fn new(
        recording: &Recording,
        complete: bool,
        threads: bool,
        commands: Sender<Command>,
    ) -> Self {
        let messages = recording
            .topics
            .iter()
            .filter_map(|rows| rows.heads().first());
        let ticks = recording.ticks.iter().filter_map(|ticks| ticks.first());
        let firsts = messages.map(|head| head.at);
        Self {
            complete,
            cut: threads && !order::is_whole(recording),
            may_lack: match &recording.outcome {
                Some(outcome) if threads => outcome.lost,
                // A file that was cut off lacks the number.
                None if threads => u64::MAX,
                _ => 0,
            },
            lacks: AtomicU64::new(0),
            messages: AtomicU64::new(0),
            ticks: AtomicU64::new(0),
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

    /// Number of items that the recorder lost.
    pub fn lacks(&self) -> u64 {
        self.lacks.load(Ordering::Relaxed)
    }

    /// What is the same so far, in a run that `observer` observes.
    pub fn identical(&self, recording: &Recording, observer: &Observer) -> Identical {
        let [messages, ticks] =
            [&self.messages, &self.ticks].map(|count| count.load(Ordering::Relaxed) as usize);
        let topics = recording.topics.iter();
        Identical {
            topics: topics.filter(|rows| !rows.is_empty()).count(),
            messages,
            ticks,
            until: (self.cut || !recording.is_whole()).then(|| observer.now().min(recording.until)),
            // A run that was never in a file needs none.
            without_digest: recording.bytes > 0
                && recording
                    .outcome
                    .as_ref()
                    .is_none_or(|outcome| outcome.digest.is_none()),
        }
    }

    fn first_difference<S: Series>(&self, series: &mut S) -> Option<Difference> {
        let mut index = 0;
        while series.wait() {
            let mut computed = 0;
            while let Some(item) = series.computed(computed) {
                if self.is_before(series, &item) || self.was_lost(series, index, &item) {
                    computed += 1;
                    continue;
                }
                if series.recorded(index).is_none() {
                    return self.complete.then(|| item.not_recorded());
                }
                let difference = series.compare(index, computed);
                if difference.is_some() {
                    return difference;
                }
                self.count::<S>();
                (index, computed) = (index + 1, computed + 1);
            }
        }
        let missing = series.recorded(index)?;
        if self.cut {
            return None;
        }
        // A run that was ended because of another difference lacks what came after.
        let ended = self.found.load(Ordering::Relaxed);
        (!ended).then(|| missing.not_computed())
    }

    fn count<S: Series>(&self) {
        let count = if S::MESSAGES {
            &self.messages
        } else {
            &self.ticks
        };
        count.fetch_add(1, Ordering::Relaxed);
    }

    /// Whether the recorder lost `item`, as it lost others.
    fn was_lost(&self, series: &impl Series, index: usize, item: &SeriesItem) -> bool {
        let next = series.recorded(index);
        let lost = match next {
            Some(next) => item.number < next.number,
            None => self.complete,
        };
        lost && self.may_lack
            > self
                .lacks
                .fetch_add(u64::from(self.may_lack > 0), Ordering::Relaxed)
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
