//! Generates the reference recordings again.

use std::{fs, io, path::Path, process::ExitCode};

use crate::cargo;

/// Name of each file, with the arguments of its run.
const RUNS: [(&str, &[&str]); 3] = [
    ("balanced-50hz.rrd", &[]),
    ("fall-5hz.rrd", &["--break"]),
    (
        "rescued.rrd",
        &["--duration-s", "8", "--knobs", "recordings/rescue.knobs"],
    ),
];

/// Generates the recordings in the folder `recordings` of the clone at `root`.
pub fn make(root: &Path) -> ExitCode {
    for (name, options) in RUNS {
        let file = format!("recordings/{name}");
        match fs::remove_file(root.join(&file)) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                eprintln!("error: {file}: {error}");
                return ExitCode::FAILURE;
            }
            _ => {}
        }
        let mut run = cargo(&["--package", "ratelab-lab"]);
        run.current_dir(root);
        run.args(["run", "--clock", "virtual", "--record", &file]);
        let ended = crate::run(run.args(options));
        if ended != ExitCode::SUCCESS {
            return ended;
        }
    }
    ExitCode::SUCCESS
}
