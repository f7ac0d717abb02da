//! `ratelab branch`: a recorded run, left at a moment with something changed.

use ratelab::{runtime::Time, system::Verdict};

use crate::{
    cli::BranchArgs,
    error::Error,
    options::read_knob,
    output::print_line,
    program::Program,
    recording::{Branch, Recording, branch as branched, schema::RunStatus},
    report,
};

/// Prints the result of a recorded run, that of its branch, and what made the difference.
pub fn branch(program: &Program, args: &BranchArgs) -> Result<(), Error> {
    let recording = Recording::read(&args.file)?;
    if args.at > recording.until {
        return Err(Error::BadInput(format!(
            "--at {}: this recording ends at {}: choose an earlier moment",
            args.at, recording.until
        )));
    }
    let mut knobs = Vec::new();
    for knob in &args.knob {
        knobs.extend(read_knob(program, "--knob", knob)?.1);
    }
    let branch = branched(
        &recording,
        &program.system,
        args.at,
        &knobs,
        args.duration_s,
    );
    let Branch { at, result } = branch.map_err(|why| Error::Unverified {
        file: args.file.display().to_string(),
        why,
    })?;
    let verdict = result?.verdict;
    let recorded = recorded(&recording, program);
    let before = recorded.map_or("unknown, it is cut off".to_owned(), |v| v.to_string());
    print_line(&report::line("left at", &left(args.at, at)))?;
    print_line(&report::line("recorded", &before))?;
    print_line(&report::line("branch", &verdict.to_string()))?;
    let knobs = args.knob.join(", ");
    let so = sentence(recorded, verdict, &format!("with {knobs} from {at} on"));
    print_line(&report::line("so", &so))?;
    Error::if_damaged(&recording)
}

/// The moment of the branch, and the one that was asked for if it is another.
fn left(asked: Time, at: Time) -> String {
    match asked == at {
        true => at.to_string(),
        false => format!("{at}, the last rest of the nodes up to {asked}"),
    }
}

fn recorded(recording: &Recording, program: &Program) -> Option<Verdict> {
    match &recording.outcome.as_ref()?.end {
        RunStatus::Ended(end) => Some(end.verdict.verdict(&*program.system)),
        RunStatus::Failed { .. } | RunStatus::WentOn => None,
    }
}

fn sentence(recorded: Option<Verdict>, branch: Verdict, with: &str) -> String {
    let before = match recorded {
        Some(verdict) if verdict.is_lost() => format!("lost at {}", verdict.at),
        Some(_) => "not lost".to_owned(),
        None => "unknown".to_owned(),
    };
    let after = match (recorded.map(|verdict| verdict.is_lost()), branch.is_lost()) {
        (Some(true), true) => format!("still lost, at {}", branch.at),
        (_, true) => format!("lost at {}", branch.at),
        (_, false) => "it stays up".to_owned(),
    };
    format!("{before}; {with} {after}")
}
