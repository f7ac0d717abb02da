//! `ratelab verify`: repeats the runs of recordings and compares them, bit for bit.

mod progress;

use std::{
    path::{Path, PathBuf},
    sync::{Arc, atomic::AtomicBool},
};

use crate::{
    error::Error,
    output::{self, print_line},
    program::Program,
    recording::{Recording, verify as run_again},
    signals,
};
use progress::Progress;

/// Repeats and compares the runs of recordings; prints the result of each. Ctrl-C ends
/// the program normally.
pub fn verify(program: &Program, files: &[PathBuf]) -> Result<(), Error> {
    let asked = signals::stop_flag();
    let [file] = files else {
        return verify_several(program, files, &asked);
    };
    verify_one(program, file, &asked)
}

fn verify_several(
    program: &Program,
    files: &[PathBuf],
    asked: &Arc<AtomicBool>,
) -> Result<(), Error> {
    let mut failed = 0;
    for file in files {
        match verify_one(program, file, asked) {
            Ok(()) => {}
            Err(stopped) if stopped.is_stop() => return Err(stopped),
            Err(error) => {
                output::error(&error);
                failed += 1;
            }
        }
    }
    match failed {
        0 => Ok(()),
        failed => Err(Error::Failed {
            failed,
            of: files.len(),
        }),
    }
}

fn verify_one(program: &Program, file: &Path, asked: &Arc<AtomicBool>) -> Result<(), Error> {
    let recording = Recording::read(file)?;
    let name = file.display();
    let progress = Progress::new(recording.until, asked);
    let verified = run_again(&recording, &program.system, |now| progress.look(now));
    drop(progress);
    let identical = verified.map_err(|why| Error::Unverified {
        file: name.to_string(),
        why,
    })?;
    print_line(&format!("{name}: {identical}"))?;
    Error::if_damaged(&recording)
}
