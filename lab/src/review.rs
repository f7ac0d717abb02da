//! `ratelab info` and `ratelab verify`: what is in a recording, and whether it
//! comes again.

mod watch;

use std::{
    path::{Path, PathBuf},
    sync::{Arc, atomic::AtomicBool},
};

use ratelab::runtime::Time;

use crate::{
    error::Error,
    output::{self, print_line},
    recording::{Origin, Recording, RecordingEnd, Replay, schema::RunStatus, verify},
    report::{self, ReportContext},
    signals,
};
use watch::Watch;

/// Prints what a recording is of and what the run came to.
pub fn info(file: &Path) -> Result<(), Error> {
    let recording = Arc::new(Recording::read(file)?);
    print_line(&overview(&recording))?;
    defect(&recording)
}

fn overview(recording: &Arc<Recording>) -> String {
    let mut replay = Replay::new(recording.clone());
    let begins = replay.begins();
    replay.advance_to(Time::MAX);
    let Origin {
        ratelab,
        mujoco,
        platform,
        ..
    } = &recording.origin;
    let messages = recording.topics.iter().map(|topic| topic.heads.len());
    let ticks: usize = recording.ticks.iter().map(Vec::len).sum();
    let file = recording.path.display();
    let lines = [
        (
            "file",
            format!("{file} ({})", report::size(recording.bytes)),
        ),
        (
            "made by",
            format!("ratelab {ratelab}, MuJoCo {mujoco}, {platform}"),
        ),
        (
            "holds",
            format!(
                "{begins} to {}: {} messages, {ticks} ticks{}",
                recording.until,
                messages.sum::<usize>(),
                lost(recording.outcome.as_ref())
            ),
        ),
    ];
    let lines = lines.map(|(name, text)| report::line(name, &text));
    let context = ReportContext {
        open: open(recording),
        ..ReportContext::default()
    };
    let summary = report::text(&replay.summary(), &context);
    format!("{}\n{summary}", lines.join("\n"))
}

/// Why a recording does not know how its run ended, if it does not.
fn open(recording: &Recording) -> Option<String> {
    match recording.outcome.as_ref().map(|outcome| &outcome.end) {
        Some(RunStatus::Ended(_)) => None,
        Some(RunStatus::Failed { fault }) => Some(format!("then {fault}")),
        Some(RunStatus::WentOn) => Some("its recording ended then, and the run went on".to_owned()),
        None => Some("as far as the file is good".to_owned()),
    }
}

fn lost(outcome: Option<&RecordingEnd>) -> String {
    match outcome {
        None => String::new(),
        Some(outcome) if outcome.lost > 0 => {
            format!(", {} more came too fast", outcome.lost)
        }
        Some(_) => String::new(),
    }
}

/// Runs recordings again and compares; says of each what came of it. Ctrl-C ends
/// it in order.
pub fn verify_all(files: &[PathBuf]) -> Result<(), Error> {
    let asked = signals::stop_flag();
    let [file] = files else {
        return verify_several(files, &asked);
    };
    verify_one(file, &asked)
}

fn verify_several(files: &[PathBuf], asked: &Arc<AtomicBool>) -> Result<(), Error> {
    let mut failed = 0;
    for file in files {
        match verify_one(file, asked) {
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

fn verify_one(file: &Path, asked: &Arc<AtomicBool>) -> Result<(), Error> {
    let recording = Recording::read(file)?;
    let name = file.display();
    let watch = Watch::new(recording.until, asked);
    let verified = verify(&recording, |now| watch.look(now));
    drop(watch);
    let identical = verified.map_err(|why| Error::Unverified {
        file: name.to_string(),
        why,
    })?;
    print_line(&format!("{name}: {identical}"))?;
    defect(&recording)
}

/// What is wrong with a file that was shown as far as it is good.
pub fn defect(recording: &Recording) -> Result<(), Error> {
    match recording.defect() {
        Some(defect) => {
            let file = recording.path.display();
            Err(Error::BadInput(format!("{file}: {defect}")))
        }
        None => Ok(()),
    }
}
