//! `ratelab info`: what is in a recording.

use std::{path::Path, sync::Arc};

use ratelab::runtime::Time;

use crate::{
    error::Error,
    output::print_line,
    recording::{Origin, Recording, RecordingEnd, Replay, schema::RunStatus},
    report::{self, ReportContext},
};

/// Prints what a recording is of and what the run came to.
pub fn info(file: &Path) -> Result<(), Error> {
    let recording = Arc::new(Recording::read(file)?);
    print_line(&overview(&recording))?;
    Error::if_damaged(&recording)
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
