//! A recorded run as a value: where it comes from, its rows, and how it ended; of any format.

mod origin;
mod recording;
mod row;
mod series;

pub use origin::{
    FORMAT, Origin, ProcessRecord, RecordedDurations, RecordingEnd, RunResult, RunStatus,
    VerdictRecord,
};
pub use recording::{OtherRun, Recording, ThreadLog, end_of};
pub use row::{ColumnForm, RecordColumn, RecordRow};
pub use series::{RunRows, Series};
