//! The timelines of a recording.

use std::time::{SystemTime, UNIX_EPOCH};

use ratelab::Time;
use rerun::TimeColumn;

/// Time since the run began.
pub const RUN_TIME: &str = "run_time";

/// Number of control steps of the plant.
pub const CONTROL_STEP: &str = "control_step";

/// Wall time; under the real clock only.
pub const WALL_TIME: &str = "wall_time";

/// The times of the rows of a batch, on every timeline.
#[derive(Clone, Debug, Default)]
pub struct Stamps {
    /// Wall time at which the run began (ns since 1970).
    epoch: Option<i64>,
    nanos: Vec<i64>,
    steps: Vec<i64>,
}

impl Stamps {
    /// Without rows. With an `epoch`, the wall time at which run time was zero, rows are
    /// on [`WALL_TIME`] too.
    pub fn new(epoch: Option<SystemTime>) -> Self {
        let since = epoch.map(|epoch| epoch.duration_since(UNIX_EPOCH).unwrap_or_default());
        Self {
            epoch: since.map(|since| signed(since.as_nanos())),
            nanos: Vec::new(),
            steps: Vec::new(),
        }
    }

    /// Adds a row at run time `time`, after `step` steps of the plant.
    pub fn push(&mut self, time: Time, step: u64) {
        self.nanos.push(signed(time.as_nanos()));
        self.steps.push(signed(step));
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.nanos.len()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.nanos.is_empty()
    }

    /// The index columns for `RecordingStream::send_columns`.
    pub fn columns(&self) -> impl Iterator<Item = TimeColumn> + use<> {
        let nanos = self.nanos.iter().copied();
        let wall = self.epoch.map(|epoch| {
            let nanos = nanos.clone().map(|nanos| epoch.saturating_add(nanos));
            TimeColumn::new_timestamp_nanos_since_epoch(WALL_TIME, nanos)
        });
        let run = TimeColumn::new_duration_nanos(RUN_TIME, nanos);
        let steps = TimeColumn::new_sequence(CONTROL_STEP, self.steps.iter().copied());
        [run, steps].into_iter().chain(wall)
    }
}

/// As a signed number for the viewer; constant after 292 years.
fn signed(count: impl TryInto<i64>) -> i64 {
    count.try_into().unwrap_or(i64::MAX)
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, UNIX_EPOCH};

    use ratelab::Time;

    use super::{CONTROL_STEP, RUN_TIME, Stamps, WALL_TIME};

    #[test]
    fn wall_time_is_run_time_since_the_epoch() {
        let mut stamps = Stamps::new(Some(UNIX_EPOCH + Duration::from_secs(1)));
        stamps.push(Time::from_nanos(20), 1);
        stamps.push(Time::MAX, u64::MAX);
        let columns: Vec<_> = stamps.columns().collect();
        let named: Vec<_> = columns.iter().map(|c| (c.name(), c.times_raw())).collect();
        let end = i64::MAX;
        assert_eq!(
            named,
            [
                (RUN_TIME, &[20, end][..]),
                (CONTROL_STEP, &[1, end]),
                (WALL_TIME, &[1_000_000_020, end]),
            ]
        );
    }

    #[test]
    fn virtual_time_has_no_wall() {
        let mut stamps = Stamps::new(None);
        stamps.push(Time::ZERO, 0);
        assert_eq!((stamps.len(), stamps.columns().count()), (1, 2));
    }
}
