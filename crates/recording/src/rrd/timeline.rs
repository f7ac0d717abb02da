//! The timelines of a recording, and the place of rows on them.

use std::time::{SystemTime, UNIX_EPOCH};

use ratelab::{Head, Time};
use rerun::{
    EntityPath, RecordingStream, RecordingStreamResult, SerializedComponentColumn, TimeColumn,
};

/// The result of writing to the stream of a recording.
pub type Written<T = ()> = RecordingStreamResult<T>;

/// Time since the run began.
pub const RUN_TIME: &str = "run_time";

/// Number of control steps of the plant.
pub const CONTROL_STEP: &str = "control_step";

/// Wall time; under the real clock only.
pub const WALL_TIME: &str = "wall_time";

/// The stream of a recording with a batch of its run, which places rows on the timelines.
pub struct BatchStream<'a> {
    /// The stream.
    pub rec: RecordingStream,
    /// Wall time at which run time was zero, under the real clock.
    pub epoch: Option<SystemTime>,
    /// Number of steps of the plant before this batch.
    pub before: u64,
    /// Steps in this batch: messages on the topic of states.
    pub steps: &'a [Head],
}

impl BatchStream<'_> {
    /// Sends `columns`, with a row for each of these run times. Nothing without rows.
    pub fn send(
        &self,
        entity: impl Into<EntityPath>,
        times: &[Time],
        columns: impl IntoIterator<Item = SerializedComponentColumn>,
    ) -> Written {
        if times.is_empty() {
            return Ok(());
        }
        self.rec
            .send_columns(entity, self.timelines(times), columns)
    }

    /// Returns the number of steps by the end of this batch.
    pub fn made(&self) -> u64 {
        self.step_at(Time::MAX)
    }

    /// Returns the number of steps by run time `at`, including `at` itself.
    fn step_at(&self, at: Time) -> u64 {
        let made = self.steps.partition_point(|head| head.at <= at);
        made.checked_sub(1)
            .and_then(|newest| self.steps.get(newest))
            .map_or(self.before, |head| head.seq + 1)
    }

    /// Returns the places of rows at these run times.
    fn timelines(&self, times: &[Time]) -> impl Iterator<Item = TimeColumn> + use<> {
        let nanos: Vec<i64> = times.iter().map(|at| signed(at.as_nanos())).collect();
        let steps = times.iter().map(|at| signed(self.step_at(*at)));
        let steps = TimeColumn::new_sequence(CONTROL_STEP, steps);
        let wall = self.epoch.map(|epoch| {
            let since_epoch = epoch.duration_since(UNIX_EPOCH).unwrap_or_default();
            let epoch = signed(since_epoch.as_nanos());
            TimeColumn::new_timestamp_nanos_since_epoch(
                WALL_TIME,
                nanos.iter().map(|nanos| epoch.saturating_add(*nanos)),
            )
        });
        let run = TimeColumn::new_duration_nanos(RUN_TIME, nanos);
        [run, steps].into_iter().chain(wall)
    }
}

/// Returns the run times of `rows`.
pub fn times(heads: &[Head]) -> Vec<Time> {
    heads.iter().map(|head| head.at).collect()
}

/// As a signed number for the viewer; constant after 292 years.
fn signed(count: impl TryInto<i64>) -> i64 {
    count.try_into().unwrap_or(i64::MAX)
}
