//! The arguments of `look`, whose name may be left out.

use std::{ffi::OsString, fs, path::PathBuf};

use clap::Args;

use crate::program::Program;

/// The bag to look at.
#[derive(Debug, Args)]
pub struct LookArgs {
    /// The bag: an MCAP file of ROS 2, a folder with its files, or a table of events (.csv) with
    /// the columns topic,log_ns and, where known, publish_ns,stamp_ns (header stamp),seq.
    #[arg(value_name = "BAG")]
    pub file: PathBuf,

    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// The endings of bags.
const ENDINGS: [&str; 3] = ["mcap", "csv", "db3"];

/// `args` with the name of the command, if the first is a bag.
pub fn with_look(program: &Program, args: impl IntoIterator<Item = OsString>) -> Vec<OsString> {
    let mut args: Vec<OsString> = args.into_iter().collect();
    let Some(first) = args.get(1) else {
        return args;
    };
    let is_option = first.to_string_lossy().starts_with('-');
    // Most first arguments are names of commands: the definition of all takes milliseconds.
    let is_bag = !is_option && is_bag(&PathBuf::from(first));
    if is_bag && super::command(program).find_subcommand(first).is_none() {
        args.insert(1, "look".into());
    }
    args
}

/// Whether `path` has the ending of a bag, or is a folder with a file that has one.
fn is_bag(path: &PathBuf) -> bool {
    let has_ending = |path: &PathBuf| {
        let ending = path.extension().map(|ending| ending.to_string_lossy());
        ending.is_some_and(|ending| ENDINGS.contains(&&*ending))
    };
    let files = || fs::read_dir(path).into_iter().flatten().flatten();
    has_ending(path) || (path.is_dir() && files().any(|file| has_ending(&file.path())))
}
