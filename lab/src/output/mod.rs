//! What a command prints, and the files that it writes.
//!
//! Nothing is opened for writing before everything is known to be possible. A
//! file of results takes its name when it is whole.

mod csv_file;
mod files;
mod live;
mod paths;
mod print;
mod unfinished;

pub use csv_file::CsvFile;
pub use files::{Outputs, Plan};
pub use live::Live;
pub use print::{error, note, printed, record_error, say, tell_recorded, write_error};
pub use unfinished::remove_unfinished;
