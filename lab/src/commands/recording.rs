//! What a recording says of its run, and whether it comes again.

use std::{path::Path, process, sync::Arc};

use ratelab::{Interrupt, Time};
use ratelab_experiment::Summary;
use ratelab_metrics::Rows;
use ratelab_re_execution::BusyNode;
use ratelab_recording::{
    Identical, Recording, RecordingEnd, Replay, RunStatus, VerifyError, VerifyWith,
    printable::shown, verify as run_again,
};
use ratelab_system::{Setup, System};
use serde::Serialize;
use serde_json::{Map, Value, json};

use crate::{
    cli::{InfoArgs, VerifyArgs},
    error::Error,
    options::read_knob,
    output::{self, ProgressLine, print_data, print_line, print_result},
    program::Program,
    reading, signals,
    summary::{
        json, rounded,
        text::{self, ReportContext},
    },
};

/// Prints the properties of a recording, and the summary of its run.
pub fn info(program: &Program, args: &InfoArgs) -> Result<(), Error> {
    let recording = Arc::new(reading::read(&args.file)?);
    let overview = Overview::new(&program.for_recording(&recording), &recording);
    print_result(args.json, &overview.report(), &overview.text())?;
    Error::if_damaged(&recording)
}

/// A recording for programs.
#[derive(Serialize)]
struct InfoReport<'a> {
    bytes: u64,
    damage: Option<String>,
    file: String,
    from_s: f64,
    lost: u64,
    made_by: String,
    messages: usize,
    processes: Vec<String>,
    /// The figures of the run.
    run: Map<String, Value>,
    system: &'a str,
    ticks: usize,
    to_s: f64,
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

    fn report(&self) -> InfoReport<'a> {
        let recording = self.recording;
        let processes = recording.origin.processes.iter();
        InfoReport {
            bytes: recording.bytes,
            damage: recording.defect(),
            file: shown(&recording.path),
            from_s: rounded(self.begins.as_secs_f64()),
            lost: recording.outcome.as_ref().map_or(0, |outcome| outcome.lost),
            made_by: recording.origin.made_by(),
            messages: self.messages,
            processes: processes.map(ToString::to_string).collect(),
            run: json::metrics(&*self.system, &self.summary, &self.context),
            system: &recording.origin.system,
            ticks: self.ticks,
            to_s: rounded(recording.until.as_secs_f64()),
        }
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

/// Repeats and compares the runs of recordings; prints the result of each. Ctrl-C ends
/// the program normally.
pub fn verify(program: &Program, args: &VerifyArgs) -> Result<(), Error> {
    let asked = signals::interrupt();
    if let Some(file) = &args.ask_policy {
        name_program(program, file)?;
    }
    let mut results: Vec<VerifyReport> = Vec::new();
    let verified = match &*args.files {
        [file] => verify_one(program, file, args, &asked, &mut results),
        _ => verify_several(program, args, &asked, &mut results),
    };
    if args.json {
        print_data(&format!("{:#}", json!(results)))?;
    }
    verified
}

/// What came of a recording that was executed again, for programs.
#[derive(Serialize)]
struct VerifyReport {
    file: String,
    identical: bool,
    messages: Option<usize>,
    ticks: Option<usize>,
    topics: Option<usize>,
    until_s: Option<f64>,
    why: Option<String>,
}

/// Lets the policy in `file` run, where a recording names just it.
fn name_program(program: &Program, file: &Path) -> Result<(), Error> {
    let text = format!("policy {}", file.display());
    let (_, knobs) = read_knob(program, "--ask-policy", &text)?;
    for knob in knobs {
        let named = program.system.resolved(0, &Setup::default(), knob);
        named.map_err(|why| Error::BadInput(format!("--ask-policy {why}")))?;
    }
    Ok(())
}

fn verify_several(
    program: &Program,
    args: &VerifyArgs,
    asked: &Interrupt,
    results: &mut Vec<VerifyReport>,
) -> Result<(), Error> {
    let mut failed = 0;
    for file in &args.files {
        match verify_one(program, file, args, asked, results) {
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
        failed => Err(Error::Unfinished(format!(
            "{failed} of {} recordings were not verified",
            args.files.len()
        ))),
    }
}

/// Verifies the recording in `file`, and adds what came of it to `results`.
fn verify_one(
    program: &Program,
    file: &Path,
    args: &VerifyArgs,
    asked: &Interrupt,
    results: &mut Vec<VerifyReport>,
) -> Result<(), Error> {
    let compared = compare(program, file, args, asked);
    let (identical, verified) = match compared {
        Ok((identical, whole)) => (Some(identical), whole),
        Err(error) => (None, Err(error)),
    };
    let same = identical.as_ref();
    results.push(VerifyReport {
        file: shown(file),
        identical: same.is_some(),
        messages: same.map(|same| same.messages),
        ticks: same.map(|same| same.ticks),
        topics: same.map(|same| same.topics),
        until_s: same.and_then(|same| same.until).map(Time::as_secs_f64),
        why: verified.as_ref().err().map(ToString::to_string),
    });
    if let Some(identical) = identical.filter(|_| !args.json) {
        print_line(&format!("{}: {identical}", shown(file)))?;
    }
    verified
}

/// Returns what was identical, and whether the file is whole.
fn compare(
    program: &Program,
    file: &Path,
    args: &VerifyArgs,
    asked: &Interrupt,
) -> Result<(Identical, Result<(), Error>), Error> {
    let name = shown(file);
    let path = file.to_owned();
    let read = signals::done_unless(asked, move || reading::read(&path))
        .map_err(|why| Error::Unfinished(format!("{name}: reading: {why}")))?;
    let stopped = || Error::unverified(&name, VerifyError::Stopped);
    let recording = read.ok_or_else(stopped)??;
    let until = recording.until;
    let bar = ProgressLine::new(until.as_nanos(), until.to_string());
    let system = program.for_recording(&recording).system;
    let with = VerifyWith {
        perturb: args.perturb,
        asks: args.ask_policy.is_some(),
    };
    let verified = run_again(&recording, &system, with, |look| {
        if let Some(node) = &look.stuck {
            give_up(file, node);
        }
        bar.set(look.now.as_nanos());
        signals::unless(asked)
    });
    drop(bar);
    let identical = verified.map_err(|why| Error::unverified(&name, why))?;
    Ok((identical, Error::if_damaged(&recording)))
}

/// Ends the program: a node's thread that waits for something else than the run cannot be
/// ended.
fn give_up(file: &Path, node: &BusyNode) -> ! {
    let BusyNode { name, at, took } = node;
    let (file, took) = (shown(file), took.as_secs_f64());
    output::error(&format!(
        "{file}: {name} has been in its tick at {at} for 10 s longer than the {took:.3} s of \
         the recorded one: it waits for something that is not a topic, and that does not come back"
    ));
    process::exit(1)
}
