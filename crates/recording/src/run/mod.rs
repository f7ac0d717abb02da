//! A recorded run as a value: where it comes from, its rows, and how it ended; of any format.

mod end;
mod lineage;
mod origin;
mod other_runtime;
mod recording;
mod row;
mod rows;
mod series;

pub use end::{RecordingEnd, RunResult, RunStatus, VerdictRecord};
pub use lineage::end_of;
pub use origin::{FORMAT, Origin, ProcessRecord};
pub use other_runtime::OtherRun;
pub use recording::{Recording, ThreadLog};
pub use row::{ColumnForm, RecordColumn, RecordRow};
pub use rows::RunRows;
pub use series::Series;
