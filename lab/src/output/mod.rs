//! Printed output and files.
//!
//! All files are checked before the first is opened for writing. A file of results gets
//! its name when it is complete, and replaces an earlier file of its kind only; what is no
//! regular file is written into.

mod file;
mod files;
mod kind;
mod live;
mod paths;
mod pipe;
mod print;
mod progress;
mod unfinished;

pub use file::{OutputFile, refuse_existing};
pub use files::{NewFolders, OutputPlan, Outputs};
pub use kind::OutputKind;
pub use live::Live;
pub use print::{
    error, note, print_data, print_line, print_recorded, print_result, printed, record_error,
    write_error,
};
pub use progress::ProgressLine;
pub use unfinished::remove_unfinished;
