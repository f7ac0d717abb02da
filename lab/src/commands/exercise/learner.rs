//! One exercise with a learner: objective, prediction, measurement, and the result of the
//! prediction. The measurement is shown only after a prediction.

use std::{
    io::{self, IsTerminal, Write},
    path::Path,
};

use exercises::framework::{Answers, Brief, Exercise, Prediction};

use super::WIDTH;
use crate::{cli::ExerciseArgs, error::Error, output::print_line, rescue::RESCUE};

/// Does `exercise` with the learner whose predictions are in `file`.
pub fn learn(exercise: &dyn Exercise, args: &ExerciseArgs, file: &Path) -> Result<(), Error> {
    let brief = exercise.brief();
    let given = args.predict.as_deref();
    let given = given.map(|text| Prediction::read(text, brief)).transpose();
    let given = given.map_err(|error| Error::BadInput(format!("--predict: {error}")))?;
    let mut answers = Answers::load(file)?;
    let known = answers.get(brief).filter(|_| !args.redo).cloned();
    let asks = known.is_none() && given.is_none() && io::stdin().is_terminal();
    if asks {
        // Checks that the file is writable before the learner types a prediction.
        Answers::try_place(file)?;
        print_line(&introduction(brief))?;
    }
    let prediction = match (known, given) {
        (Some(known), None) => known,
        (Some(known), Some(_)) => {
            let number = brief.in_unit(known.number());
            let reason = known.reason();
            return Err(Error::BadInput(format!(
                "you already predicted {number} ({reason}): --redo predicts again"
            )));
        }
        (None, given) => {
            let prediction = given.map_or_else(|| ask(brief), Ok)?;
            answers.set(brief, prediction.clone());
            answers.save(file)?;
            prediction
        }
    };
    if !asks {
        print_line(&introduction(brief))?;
    }
    let findings = exercise.run()?;
    print_line(&findings.table.to_string())?;
    print_line(&wrapped(&findings.reconcile(brief, &prediction)))?;
    match next(brief) {
        Some(next) => print_line(&format!("\n{next}")),
        None => Ok(()),
    }
}

fn introduction(brief: &Brief) -> String {
    format!(
        "Exercise {}: {} ({})\n\n{}\n\n{}\n",
        brief.number,
        brief.title,
        brief.kind,
        wrapped(brief.objective),
        wrapped(brief.question),
    )
}

/// Asks for a prediction until it is valid; input from a script gets one attempt.
fn ask(brief: &Brief) -> Result<Prediction, Error> {
    let unit = brief.unit;
    let typed = io::stdin().is_terminal();
    loop {
        if typed {
            print!("Your prediction{}, and why: ", in_unit(unit));
            // A failure is ignored here: printing the answer reports it.
            let _ = io::stdout().flush();
        }
        let mut line = String::new();
        let read = io::stdin().read_line(&mut line).unwrap_or(0);
        match Prediction::read(&line, brief) {
            Ok(prediction) => {
                if typed {
                    print_line("")?;
                }
                return Ok(prediction);
            }
            Err(error) if typed && read > 0 => print_line(&format!("  {error}"))?,
            Err(error) => {
                let how = "type it, or give it with --predict";
                return Err(Error::BadInput(format!("{error}: {how}")));
            }
        }
    }
}

fn in_unit(unit: &str) -> String {
    if unit.is_empty() {
        String::new()
    } else {
        format!(" in {unit}")
    }
}

/// The next step after this exercise.
fn next(brief: &Brief) -> Option<String> {
    if brief.number == RESCUE {
        let how = "Now by hand: ratelab --speed 0.2 --record rescue.rrd, and then\n\
                   ratelab exercise 5 --session rescue.rrd";
        return Some(how.to_owned());
    }
    let next = exercises::find(brief.number + 1)?.brief();
    Some(format!(
        "Next: ratelab exercise {} ({})",
        next.number, next.title
    ))
}

/// Wraps `text` to a readable width.
fn wrapped(text: &str) -> String {
    textwrap::fill(text, WIDTH)
}
