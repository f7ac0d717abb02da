//! The texts that a command prints, and the files that it writes.
//!
//! Nothing is opened for writing before everything is known to be possible. A
//! file of results takes its name when it is whole.

mod csv_file;
mod files;
mod live;
mod paths;
mod print;
mod unfinished;
mod whole;

pub use csv_file::CsvFile;
pub use files::{OutputPlan, Outputs};
pub use live::Live;
pub use print::{error, note, print_line, print_recorded, printed, record_error, write_error};
pub use unfinished::remove_unfinished;
pub use whole::write_whole;
