//! Printed output and files: the only place from which the command writes to the terminal, but for
//! the lab's screen. A terminal that is gone ends no command.
//!
//! All files are checked before the first is opened for writing. A file of results gets
//! its name when it is complete, and replaces an earlier file of its kind only; what is no
//! regular file is written into.

mod file;
mod files;
mod kind;
mod live;
mod pipe;
mod print;
mod progress;

pub use file::{OutputFile, refuse_existing};
pub use files::{NewFolders, OutputPlan, Outputs, try_new};
pub use kind::OutputKind;
pub use live::Live;
pub use pipe::waits_for_reader;
pub use print::{
    error, note, print_coloured, print_data, print_line, print_recorded, print_result, printed,
    prompt, record_error, stopped_by, write_error,
};
pub use progress::ProgressLine;
