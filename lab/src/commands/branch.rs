//! `ratelab branch`: a recorded run, left at a moment with something changed.

use ratelab::{Command, Speed};
use ratelab_experiment::Summary;
use ratelab_recording::{Change, Departure, StopReason, VerifyError, branch as branched};
use ratelab_system::{BuildError, Verdict};
use serde::Serialize;

use crate::{
    cli::BranchArgs,
    error::Error,
    options::read_knob,
    output::{print_recorded, print_result},
    program::Program,
    reading,
    results::{destination_of, record},
    signals,
    summary::{
        ages::{self, AgeFigures},
        text,
    },
};

/// Returns where and how the branch leaves the recorded run.
fn departure(program: &Program, args: &BranchArgs) -> Result<Departure, Error> {
    if let Some(end) = args.duration_s.filter(|end| *end <= args.at) {
        return Err(Error::BadInput(format!(
            "--duration-s {end}: the branch begins at {}: choose a later end",
            args.at
        )));
    }
    let mut knobs = Vec::new();
    for knob in &args.knob {
        knobs.extend(read_knob(program, "--knob", knob)?.1);
    }
    Ok(Departure {
        at: args.at,
        knobs,
        end: args.duration_s,
        speed: Speed::Unlimited,
    })
}

/// A run beside its branch, for programs.
#[derive(Serialize)]
struct BranchReport<'a> {
    age_parts: Vec<AgeFigures<'a>>,
    branch: RunEnd<'a>,
    knobs: &'a [String],
    left_at_s: f64,
    recorded: Option<RunEnd<'a>>,
}

#[derive(Serialize)]
struct RunEnd<'a> {
    cause_of_end: &'a str,
    ended_at_s: f64,
}

impl<'a> From<&'a Verdict> for RunEnd<'a> {
    fn from(verdict: &'a Verdict) -> Self {
        Self {
            cause_of_end: verdict.name(),
            ended_at_s: verdict.at.as_secs_f64(),
        }
    }
}

/// Prints the result of a recorded run, that of its branch, and what made the difference.
pub fn branch(program: &Program, args: &BranchArgs) -> Result<(), Error> {
    let recording = reading::read(&args.file)?;
    let program = &program.for_recording(&recording);
    Error::if_after_end(args.at, &recording)?;
    let departure = departure(program, args)?;
    let unverified = |why| Error::unverified(args.file.display(), why);
    let mut branch =
        branched(&recording, &program.system, &departure).map_err(|why| match why {
            VerifyError::Setup(BuildError::Setting(why)) => {
                Error::BadInput(format!("--knob {why}"))
            }
            why => unverified(why),
        })?;
    let destination = args.record.clone().map(|place| destination_of(place, None));
    let commands = branch.experiment.commands();
    signals::watch(move || drop(commands.send(Command::Stop)), || ());
    let recorder = destination
        .map(|to| record(to, &branch.experiment))
        .transpose()?;
    branch.experiment.watch_ages();
    let knobs = args.knob.join(", ");
    let change = Change::new(&recording, &*program.system, branch.at, knobs);
    let outcome = branch.run();
    let recorded = recorder.map(|recorder| {
        recorder.end(
            outcome
                .as_ref()
                .map_or(StopReason::Off, StopReason::from_outcome),
        );
        recorder.finish()
    });
    let Summary { verdict, ages, .. } = outcome.map_err(unverified)??;
    let before = change
        .recorded
        .as_ref()
        .map(ToString::to_string)
        .unwrap_or_else(|| "unknown, it is cut off".to_owned());
    let so = change.sentence(Some(verdict.clone()));
    let mut lines = vec![
        ("left at", change.left(args.at)),
        ("recorded", before),
        ("branch", verdict.to_string()),
        ("so", so),
    ];
    lines.extend(ages::lines(&ages, |_| true));
    let report = BranchReport {
        age_parts: ages::figures(&ages),
        branch: RunEnd::from(&verdict),
        knobs: &args.knob,
        left_at_s: change.at.as_secs_f64(),
        recorded: change.recorded.as_ref().map(RunEnd::from),
    };
    print_result(args.json, &report, &text::lines(&lines))?;
    if let Some(recorded) = recorded {
        print_recorded(args.json, &recorded?)?;
    }
    Error::if_damaged(&recording)
}
