//! Generates the reference recordings again.

use std::{
    env, fs, io,
    path::Path,
    process::{Command, ExitCode},
};

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
        if let Err(error) = remove(&root.join(&file)) {
            eprintln!("error: {file}: {error}");
            return ExitCode::FAILURE;
        }
        let cargo = env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let run = Command::new(cargo)
            .current_dir(root)
            .args(["run", "--quiet", "--package", "ratelab-lab", "--"])
            .args(["run", "--clock", "virtual", "--record", &file])
            .args(options)
            .status();
        match run {
            Ok(status) if status.success() => {}
            Ok(status) => {
                eprintln!("error: {file}: ratelab run ended with {status}");
                return ExitCode::FAILURE;
            }
            Err(error) => {
                eprintln!("error: cargo cannot be run: {error}");
                return ExitCode::FAILURE;
            }
        }
    }
    ExitCode::SUCCESS
}

fn remove(file: &Path) -> io::Result<()> {
    match fs::remove_file(file) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}
