//! `ratelab exercise`: predict, run, check.

mod learner;

use std::{ops::ControlFlow, path::Path};

use exercises::{
    framework::{Answers, Exercise},
    questions,
    rescue::session::{RESCUE, accept},
};
use ratelab_recording::{Recording, VerifyWith, verify};

use crate::{
    cli::{ExerciseArgs, Label, Wanted},
    error::Error,
    output::print_line,
    predictions::answers_file,
    program::Program,
    reading,
};
use ratelab_recording::printable::shown;

/// Lists the exercises, does one, or checks their promises.
pub fn exercise(program: &Program, args: &ExerciseArgs) -> Result<(), Error> {
    check_options(args)?;
    let file = answers_file(args.answers.as_deref());
    match (&args.what, &args.number) {
        (None, _) => print_line(&list(&Answers::load(&file)?, &file)),
        (Some(Wanted::Exercise(label)), None) => match &args.session {
            Some(session) => judge_session(program, find(label)?[0], session),
            None => learner::learn(&find(label)?, args, &file),
        },
        (Some(Wanted::Check), None) => check(questions(), &Answers::load(&file)?),
        (Some(Wanted::Check), Some(label)) => {
            check(find(label)?.into_iter(), &Answers::load(&file)?)
        }
        (Some(Wanted::Exercise(_)), Some(Label(label))) => Err(Error::BadInput(format!(
            "one exercise at a time: leave {label} out"
        ))),
    }
}

/// Refuses options that need the number of an exercise.
fn check_options(args: &ExerciseArgs) -> Result<(), Error> {
    let lonely = match args.what {
        Some(Wanted::Exercise(_)) => None,
        _ if args.predict.is_some() => Some("--predict"),
        _ if args.session.is_some() => Some("--session"),
        _ if args.redo => Some("--redo"),
        _ if args.hint => Some("--hint"),
        _ if args.seed.is_some() => Some("--seed"),
        _ => None,
    };
    lonely.map_or(Ok(()), |option| {
        let why = format!("{option} is of one exercise: say its number, as in ratelab exercise 1");
        Err(Error::BadInput(why))
    })
}

/// Returns the questions that a label names: at least one.
fn find(Label(label): &Label) -> Result<Vec<&'static Exercise>, Error> {
    match exercises::named(label) {
        known if known.is_empty() => Err(Error::BadInput(format!(
            "there is no exercise {label}: there are {} (6 is all of 6a to 6d)",
            exercises::labels()
        ))),
        known => Ok(known),
    }
}

/// Width of a title in the list.
const TITLE: usize = 36;

fn list(answers: &Answers, file: &Path) -> String {
    let next = exercises::next(answers).map(|next| next.brief());
    let lines: String = questions()
        .map(|exercise| {
            let brief = exercise.brief();
            let mark = if brief.path { "●" } else { " " };
            let is_next = next.is_some_and(|next| next.name == brief.name);
            let kind = format!("{}{}", if is_next { "next: " } else { "" }, brief.kind);
            let state = answers.predicted(brief).unwrap_or(kind);
            format!(
                "{:<3} {mark} {:<TITLE$} {state}\n",
                brief.label(),
                brief.title
            )
        })
        .collect();
    let go_on = next.map_or_else(
        || "All are done.".to_owned(),
        |next| {
            format!(
                "ratelab exercise {} goes on: it asks what you expect, then measures.",
                next.label()
            )
        },
    );
    format!(
        "{lines}\n● the path of an hour; the others are more. ✓ ✖ your first prediction was right, \
         wrong.\n{go_on}\nPredictions are kept in {}.",
        shown(file)
    )
}

/// Repeats the measurement of each of `exercises`, and prints the result of the
/// prediction. Only measurements can fail.
fn check(
    exercises: impl Iterator<Item = &'static Exercise>,
    answers: &Answers,
) -> Result<(), Error> {
    let mut broken = 0;
    for exercise in exercises {
        broken += check_one(exercise, answers)?;
    }
    match broken {
        0 => Ok(()),
        n => Err(Error::Unfinished(format!(
            "{n} measurements do not hold: the runtime differs from that of the exercises"
        ))),
    }
}

/// Returns how many measurements of `exercise` do not hold.
fn check_one(exercise: &Exercise, answers: &Answers) -> Result<usize, Error> {
    let brief = exercise.brief();
    let findings = exercise.run()?;
    let checks = findings.checks(brief)?;
    let failed: Vec<_> = checks.iter().filter(|check| !check.holds()).collect();
    let of = checks.len();
    let (sign, held) = match failed.len() {
        0 => ("✓", format!("{of} measurements hold")),
        n => ("✖", format!("{n} of {of} measurements do not hold")),
    };
    let prediction = answers.get(brief);
    let skipped = prediction.map_or("; no prediction yet, skipped", |_| "");
    let (label, title) = (brief.label(), &brief.title);
    print_line(&format!("{sign} {label} {title}: {held}{skipped}"))?;
    for check in &failed {
        print_line(&format!("    {check}"))?;
    }
    if let Some(prediction) = prediction {
        let number = brief.in_unit(prediction.number());
        // The bands are about the number zero.
        let of_learner = match prediction.seed() {
            0 => findings,
            seed => exercise.measure(seed)?,
        };
        let (hit, by) = of_learner.judge(brief, prediction);
        let outcome = if hit { "right" } else { "wrong" };
        print_line(&format!(
            "    your prediction of {number} was {outcome}. {by}"
        ))?;
    }
    Ok(failed.len())
}

/// Judges the session in `file`, and prints the verdict: it is a rescue, and its run comes again.
fn judge_session(program: &Program, exercise: &Exercise, file: &Path) -> Result<(), Error> {
    let brief = exercise.brief();
    if brief.number != RESCUE {
        return Err(Error::BadInput(format!(
            "--session is for exercise {RESCUE}: {} is not done in a session",
            brief.title
        )));
    }
    let recording = reading::read(file)?;
    let name = shown(file);
    let (accepted, text) = judged(program, &recording);
    if accepted {
        print_line(&format!("✓ {name}: {text}"))?;
        return Error::if_damaged(&recording);
    }
    print_line(&format!("✖ {name}: {text}"))?;
    let why = format!("{name} is not accepted as your rescue");
    Err(Error::Unfinished(why))
}

/// Returns whether `recording` is a rescue of the learner's own whose run comes again, if it is
/// whole, with a text.
fn judged(program: &Program, recording: &Recording) -> (bool, String) {
    let (accepted, text) = accept(recording);
    if !accepted || !recording.is_whole() {
        return (accepted, text);
    }
    let go_on = |_: &_| ControlFlow::Continue(());
    match verify(recording, &program.system, VerifyWith::default(), go_on) {
        Ok(_) => (true, text),
        Err(why) => (false, format!("not verified: {why}")),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use ratelab::Time;
    use ratelab_cart_pole::CartPole;
    use ratelab_experiment::{Config, Experiment};
    use ratelab_recording::StopReason;

    use super::*;
    use crate::results::{destination_of, record};

    #[test]
    fn a_rescue_counts_if_its_run_comes_again_and_its_digest_is_right() {
        let program = Program::new(Arc::new(CartPole::default()), true);
        let knobs = CartPole::KNOBS.parse_list("1 control-hz 5\n2.1 control-hz 50");
        let config = Config {
            knobs: knobs.expect("knobs"),
            end: Time::from_nanos(9_000_000_000),
            ..Config::default()
        };
        let experiment = Experiment::new(program.system.clone(), &config).expect("built");
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("own.rrd");
        let recorder =
            record(destination_of(Some(path.clone()), None), &experiment).expect("a new file");
        recorder.end(StopReason::from_outcome(&experiment.run()));
        recorder.finish().expect("recorded");
        let own = Recording::read(&path).expect("a recording");
        let (accepted, text) = judged(&program, &own);
        assert!(accepted && text.starts_with("rescued"), "{text}");
        let altered = Recording {
            altered: true,
            ..own.clone()
        };
        let mut unproven = own;
        unproven.outcome.as_mut().expect("an end").digest = None;
        for (recording, why) in [
            (altered, "its digest is another"),
            (unproven, "this file has no digest"),
        ] {
            let (accepted, text) = judged(&program, &recording);
            let refused = !accepted && text.starts_with("not verified") && text.contains(why);
            assert!(refused, "{text}");
        }
    }
}
