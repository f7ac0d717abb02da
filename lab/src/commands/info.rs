//! `ratelab info`: the content of a recording.

use std::sync::Arc;

use ratelab::Time;
use ratelab_experiment::Summary;
use ratelab_metrics::Rows;
use ratelab_system::System;
use serde_json::{Value, json};

use crate::{
    cli::InfoArgs,
    error::Error,
    output::print_result,
    printable::shown,
    program::Program,
    reading,
    summary::{
        json, rounded,
        text::{self, ReportContext},
    },
};
use ratelab_recording::{Recording, RecordingEnd, Replay, RunStatus};

/// Prints the properties of a recording, and the summary of its run.
pub fn info(program: &Program, args: &InfoArgs) -> Result<(), Error> {
    let recording = Arc::new(reading::read(&args.file)?);
    let overview = Overview::new(&program.for_recording(&recording), &recording);
    print_result(args.json, &overview.json(), &overview.text())?;
    Error::if_damaged(&recording)
}

/// What there is to say of a recording.
struct Overview<'a> {
    recording: &'a Recording,
    system: Arc<dyn System>,
    /// Whether it is of another system than the program has.
    strange: bool,
    begins: Time,
    messages: usize,
    ticks: usize,
    summary: Summary,
    context: ReportContext,
}

impl<'a> Overview<'a> {
    fn new(program: &Program, recording: &'a Arc<Recording>) -> Self {
        let mut replay = Replay::new(recording.clone(), &program.system);
        let begins = replay.begins();
        replay.advance_to(Time::MAX);
        let (system, mut summary) = (replay.system().clone(), replay.summary());
        let ages = recording.ages(&*system, &summary);
        if recording.begins_with_run() {
            summary.set_ages(&*system, ages);
        } else {
            summary.ages = ages;
        }
        Self {
            begins,
            messages: recording.topics.iter().map(Rows::len).sum(),
            ticks: recording.ticks.iter().map(Vec::len).sum(),
            strange: !recording.is_of(&*program.system),
            context: ReportContext {
                open: open(recording),
                ..ReportContext::default()
            },
            system,
            summary,
            recording,
        }
    }

    fn text(&self) -> String {
        let recording = self.recording;
        let file = shown(&recording.path);
        let holds = format!(
            "{} to {}: {} messages, {} ticks{}",
            self.begins,
            recording.until,
            self.messages,
            self.ticks,
            lost(recording.outcome.as_ref())
        );
        let mut lines = vec![
            ("file", format!("{file} ({})", text::size(recording.bytes))),
            ("made by", recording.origin.made_by()),
            ("holds", holds),
        ];
        if self.strange {
            lines.insert(1, ("system", recording.origin.system.clone()));
        }
        let processes = recording.origin.processes.iter();
        lines.extend(processes.map(|process| ("process", process.to_string())));
        let run = text::render(&*self.system, &self.summary, &self.context);
        format!("{}\n{run}", text::lines(&lines))
    }

    fn json(&self) -> Value {
        let recording = self.recording;
        let processes = recording.origin.processes.iter();
        json!({
            "bytes": recording.bytes,
            "damage": recording.defect(),
            "file": shown(&recording.path),
            "from_s": rounded(self.begins.as_secs_f64()),
            "lost": recording.outcome.as_ref().map_or(0, |outcome| outcome.lost),
            "made_by": recording.origin.made_by(),
            "messages": self.messages,
            "processes": processes.map(ToString::to_string).collect::<Vec<_>>(),
            "run": json::metrics(&*self.system, &self.summary, &self.context),
            "system": recording.origin.system,
            "ticks": self.ticks,
            "to_s": rounded(recording.until.as_secs_f64()),
        })
    }
}

/// Returns the reason why the recording lacks the end of its run, if it does.
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
