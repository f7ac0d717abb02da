//! `ratelab verify`: repeats the runs of recordings and compares them, bit for bit.

use std::{path::Path, process};

use ratelab::{Interrupt, Time};
use ratelab_re_execution::BusyNode;
use ratelab_system::Setup;
use serde_json::{Value, json};

use crate::{
    cli::VerifyArgs,
    error::Error,
    options::read_knob,
    output::{self, ProgressLine, print_data, print_line},
    printable::shown,
    program::Program,
    reading, signals,
};
use ratelab_recording::{Identical, VerifyError, VerifyWith, verify as run_again};

/// Repeats and compares the runs of recordings; prints the result of each. Ctrl-C ends
/// the program normally.
pub fn verify(program: &Program, args: &VerifyArgs) -> Result<(), Error> {
    let asked = signals::interrupt();
    if let Some(file) = &args.ask_policy {
        name_program(program, file)?;
    }
    let mut results = Vec::new();
    let verified = match &*args.files {
        [file] => verify_one(program, file, args, &asked, &mut results),
        _ => verify_several(program, args, &asked, &mut results),
    };
    if args.json {
        print_data(&format!("{:#}", Value::Array(results)))?;
    }
    verified
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
    results: &mut Vec<Value>,
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
    results: &mut Vec<Value>,
) -> Result<(), Error> {
    let compared = compare(program, file, args, asked);
    let (identical, verified) = match compared {
        Ok((identical, whole)) => (Some(identical), whole),
        Err(error) => (None, Err(error)),
    };
    results.push(json!({
        "file": shown(file),
        "identical": identical.is_some(),
        "messages": identical.as_ref().map(|identical| identical.messages),
        "ticks": identical.as_ref().map(|identical| identical.ticks),
        "topics": identical.as_ref().map(|identical| identical.topics),
        "until_s": identical.as_ref().and_then(|identical| identical.until).map(Time::as_secs_f64),
        "why": verified.as_ref().err().map(ToString::to_string),
    }));
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
