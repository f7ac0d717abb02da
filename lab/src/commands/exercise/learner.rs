//! One exercise with a learner: objective, prediction, measurement, and the result of the
//! prediction. The measurement is shown only after a prediction.

use std::{
    io::{self, IsTerminal, Write},
    path::Path,
};

use exercises::{
    framework::{Answers, Brief, Exercise, Prediction},
    parts,
};

use super::WIDTH;
use crate::{cli::ExerciseArgs, error::Error, output::print_line, rescue::RESCUE};

/// Does `exercise` with the learner whose predictions are in `file`: shows what was
/// predicted and measured, and asks the next question.
pub fn learn(
    exercise: &'static dyn Exercise,
    args: &ExerciseArgs,
    file: &Path,
) -> Result<(), Error> {
    check_seed(exercise, args)?;
    let mut learner = Learner {
        answers: Answers::load(file)?,
        file,
        args,
    };
    if args.redo {
        parts(exercise).for_each(|part| learner.answers.clear(part.brief()));
    }
    let is_known = |part: &&dyn Exercise| learner.answers.get(part.brief()).is_some();
    let known = parts(exercise).filter(is_known).count();
    let next = parts(exercise).nth(known);
    match (&args.predict, next) {
        (Some(text), Some(next)) => learner.predict(next, text),
        (Some(_), None) => Err(learner.already(exercise)),
        (None, _) => learner.go_through(exercise, known),
    }?;
    let unanswered = parts(exercise).find(|part| learner.answers.get(part.brief()).is_none());
    match next_step(exercise.brief(), unanswered) {
        Some(next) => print_line(&format!("\n{next}")),
        None => Ok(()),
    }
}

/// Refuses a number where nothing is drawn.
fn check_seed(exercise: &'static dyn Exercise, args: &ExerciseArgs) -> Result<(), Error> {
    if args.seed.is_none() || parts(exercise).any(|part| part.draws()) {
        return Ok(());
    }
    let number = exercise.brief().number;
    let why = format!("exercise {number} is the same for everyone: leave --seed out");
    Err(Error::BadInput(why))
}

/// A learner with predictions.
struct Learner<'a> {
    answers: Answers,
    file: &'a Path,
    args: &'a ExerciseArgs,
}

impl Learner<'_> {
    /// Shows all answered questions, then asks the next ones. Input from a script answers
    /// one of them, or none where some are answered.
    fn go_through(&mut self, exercise: &'static dyn Exercise, known: usize) -> Result<(), Error> {
        let typed = io::stdin().is_terminal();
        for (index, part) in parts(exercise).enumerate() {
            if let Some(prediction) = self.answers.get(part.brief()).cloned() {
                self.check_same(part, &prediction)?;
                self.introduce(part, prediction.seed())?;
                reveal(part, &prediction)?;
                if index + 1 < known {
                    print_line("")?;
                }
                continue;
            }
            let mut line = String::new();
            if typed {
                // Checks that the file is writable before the learner types a prediction.
                Answers::try_place(self.file)?;
                if index > 0 {
                    print_line("")?;
                }
                self.introduce(part, self.seed(part))?;
            } else {
                line = read_line()?;
                if line.trim().is_empty() && index > 0 {
                    return Ok(());
                }
                if line.trim().is_empty() && part.evidence(self.seed(part))?.is_some() {
                    self.introduce(part, self.seed(part))?;
                }
            }
            let prediction = match typed {
                true => ask(part.brief())?,
                false => read(&line, part.brief())?,
            };
            let prediction = self.keep(part, prediction)?;
            if !typed {
                self.introduce(part, prediction.seed())?;
            }
            reveal(part, &prediction)?;
            if !typed {
                return Ok(());
            }
        }
        Ok(())
    }

    /// Answers one question with the text of `--predict`.
    fn predict(&mut self, part: &'static dyn Exercise, text: &str) -> Result<(), Error> {
        let prediction = Prediction::read(text, part.brief());
        let prediction =
            prediction.map_err(|error| Error::BadInput(format!("--predict: {error}")))?;
        let prediction = self.keep(part, prediction)?;
        self.introduce(part, prediction.seed())?;
        reveal(part, &prediction)
    }

    /// The learner's number for this question; zero where it does not matter.
    fn seed(&self, part: &dyn Exercise) -> u64 {
        let given = self.args.seed.filter(|_| part.draws());
        given.unwrap_or_default()
    }

    /// Keeps a prediction, with the learner's number where that matters.
    fn keep(&mut self, part: &dyn Exercise, prediction: Prediction) -> Result<Prediction, Error> {
        let prediction = match self.seed(part) {
            0 => prediction,
            seed => prediction.about(seed),
        };
        self.answers.set(part.brief(), prediction.clone());
        self.answers.save(self.file)?;
        Ok(prediction)
    }

    /// Refuses another number than that of the prediction.
    fn check_same(&self, part: &dyn Exercise, prediction: &Prediction) -> Result<(), Error> {
        let (known, given) = (prediction.seed(), self.args.seed);
        match given.filter(|given| part.draws() && *given != known) {
            None => Ok(()),
            Some(_) => Err(Error::BadInput(format!(
                "your prediction is about --seed {known}: --redo predicts again"
            ))),
        }
    }

    /// The refusal of a second prediction.
    fn already(&self, exercise: &'static dyn Exercise) -> Error {
        let last = parts(exercise).last().unwrap_or(exercise).brief();
        let known = self.answers.get(last).map_or_else(String::new, |known| {
            format!("{} ({})", last.in_unit(known.number()), known.reason())
        });
        Error::BadInput(format!(
            "you already predicted {known}: --redo predicts again"
        ))
    }

    /// Prints the text before the prediction, with the figures to look at.
    fn introduce(&self, part: &dyn Exercise, seed: u64) -> Result<(), Error> {
        let brief = part.brief();
        let evidence = part.evidence(seed)?;
        let evidence = evidence.map_or_else(String::new, |table| format!("{table}\n"));
        let number = match part.draws() {
            true => format!("Drawn from your number, {seed} (--seed).\n\n"),
            false => String::new(),
        };
        print_line(&format!(
            "Exercise {}: {} ({})\n\n{}\n\n{number}{evidence}{}\n",
            brief.label(),
            brief.title,
            brief.kind,
            wrapped(brief.objective),
            wrapped(&brief.asked()),
        ))
    }
}

/// Measures, and prints the figures beside the prediction.
fn reveal(part: &dyn Exercise, prediction: &Prediction) -> Result<(), Error> {
    let findings = part.measure(prediction.seed())?;
    print_line(&findings.table.to_string())?;
    print_line(&wrapped(&findings.reconcile(part.brief(), prediction)))
}

fn read_line() -> Result<String, Error> {
    let mut line = String::new();
    let read = io::stdin().read_line(&mut line);
    read.map_err(|error| Error::BadInput(format!("the prediction cannot be read: {error}")))?;
    Ok(line)
}

fn read(line: &str, brief: &Brief) -> Result<Prediction, Error> {
    let prediction = Prediction::read(line, brief);
    prediction.map_err(|error| {
        let how = "type it, or give it with --predict";
        Error::BadInput(format!("{error}: {how}"))
    })
}

/// Asks for a prediction until it is valid.
fn ask(brief: &Brief) -> Result<Prediction, Error> {
    loop {
        print!("Your prediction{}, and why: ", in_unit(brief.unit));
        // A failure is ignored here: printing the answer reports it.
        let _ = io::stdout().flush();
        let line = read_line()?;
        match Prediction::read(&line, brief) {
            Ok(prediction) => {
                print_line("")?;
                return Ok(prediction);
            }
            Err(error) if !line.is_empty() => print_line(&format!("  {error}"))?,
            Err(_) => return read(&line, brief),
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

/// The next step: the next question of this exercise, or the next exercise.
fn next_step(brief: &Brief, unanswered: Option<&'static dyn Exercise>) -> Option<String> {
    if brief.number == RESCUE {
        let how = "Now by hand: ratelab --speed 0.2 --record rescue.rrd, and then\n\
                   ratelab exercise 5 --session rescue.rrd";
        return Some(how.to_owned());
    }
    let next = unanswered.or_else(|| exercises::find(brief.number + 1))?;
    let next = next.brief();
    Some(format!(
        "Next: ratelab exercise {} ({})",
        next.number, next.title
    ))
}

/// Wraps `text` to a readable width.
fn wrapped(text: &str) -> String {
    textwrap::fill(text, WIDTH)
}
