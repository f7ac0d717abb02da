//! Printed output and files: the only place from which the command writes to the terminal, but for
//! the lab's screen. A command goes on without its terminal.
//!
//! All files are checked before the first is opened for writing. A file of results gets
//! its name when it is complete, and replaces only an earlier file of its kind; pipes and
//! devices are written to directly.

mod files;
mod pipe;
mod print;

pub use files::{
    NewFolders, OutputFile, OutputKind, OutputPlan, Outputs, refuse_existing, try_new,
};
pub use pipe::{Live, waits_for_reader};
pub use print::{
    ProgressLine, error, note, print_coloured, print_data, print_line, print_recorded,
    print_result, printed, prompt, record_error, stopped_by, write_error,
};
