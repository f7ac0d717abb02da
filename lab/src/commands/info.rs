//! `ratelab info`: the content of a recording.

use std::{path::Path, sync::Arc};

use ratelab::Time;
use ratelab_account::Rows;

use crate::{
    error::Error,
    output::print_line,
    printable::shown,
    program::Program,
    reading,
    summary::text::{self, ReportContext},
};
use ratelab_recording::{Recording, RecordingEnd, Replay, RunStatus};

/// Prints the properties of a recording, and the summary of its run.
pub fn info(program: &Program, file: &Path) -> Result<(), Error> {
    let recording = Arc::new(reading::read(file)?);
    let program = &program.of(&recording);
    print_line(&overview(program, &recording))?;
    Error::if_damaged(&recording)
}

fn overview(program: &Program, recording: &Arc<Recording>) -> String {
    let mut replay = Replay::new(recording.clone(), &program.system);
    let begins = replay.begins();
    replay.advance_to(Time::MAX);
    let messages = recording.topics.iter().map(Rows::len);
    let ticks: usize = recording.ticks.iter().map(Vec::len).sum();
    let file = shown(&recording.path);
    let holds = format!(
        "{begins} to {}: {} messages, {ticks} ticks{}",
        recording.until,
        messages.sum::<usize>(),
        lost(recording.outcome.as_ref())
    );
    let mut lines = vec![
        ("file", format!("{file} ({})", text::size(recording.bytes))),
        ("made by", recording.origin.made_by()),
        ("holds", holds),
    ];
    if !recording.is_of(&*program.system) {
        lines.insert(1, ("system", recording.origin.system.clone()));
    }
    let processes = recording.origin.processes.iter();
    lines.extend(processes.map(|process| ("process", process.to_string())));
    let context = ReportContext {
        open: open(recording),
        ..ReportContext::default()
    };
    let (system, mut summary) = (replay.system(), replay.summary());
    summary.ages = recording.ages(&**system, &summary);
    let run = text::of(&**system, &summary, &context);
    format!("{}\n{run}", text::lines(&lines))
}

/// The reason why the recording lacks the end of its run, if it does.
fn open(recording: &Recording) -> Option<String> {
    match recording.outcome.as_ref().map(|outcome| &outcome.end) {
        Some(RunStatus::Ended(_)) => None,
        Some(RunStatus::Failed { fault }) => Some(format!("then {fault}")),
        Some(RunStatus::WentOn) => Some("its recording ended then, and the run went on".to_owned()),
        None => Some("as far as the file is good".to_owned()),
    }
}

fn lost(outcome: Option<&RecordingEnd>) -> String {
    match outcome.map(|outcome| outcome.lost) {
        None | Some(0) => String::new(),
        Some(lost) => format!(", {lost} more came too fast"),
    }
}
