//! One exercise with a learner: objective, prediction, measurement, and the result of the
//! prediction. The measurement is shown only after a prediction.

use std::{
    io::{self, IsTerminal},
    path::Path,
    thread,
    time::Duration,
};

use exercises::{
    framework::{Answers, Brief, Exercise, Prediction},
    rescue::session::RESCUE,
};

use crate::{
    cli::ExerciseArgs,
    error::Error,
    output::{print_line, prompt},
    wrap::readable,
};

/// Does `asked`, questions of one exercise, with the learner whose predictions are in
/// `file`: shows what was predicted and measured, and asks the next question.
pub fn learn(asked: &[Question], args: &ExerciseArgs, file: &Path) -> Result<(), Error> {
    check_seed(asked, args)?;
    let mut learner = Learner {
        answers: Answers::load(file)?,
        reopened: if args.redo { asked } else { &[] },
        file,
        args,
    };
    if args.hint {
        return learner.hint(asked);
    }
    reopen(&mut learner.answers, learner.reopened);
    match (&args.predict, learner.open(asked)) {
        (Some(text), Some(next)) => learner.predict(next, text),
        (Some(_), None) => Err(learner.already(asked)),
        (None, _) => learner.go_through(asked),
    }?;
    let number = asked.first().map(|part| part.brief().number);
    let whole: Vec<Question> = number.into_iter().flat_map(exercises::parts).collect();
    let next = learner.open(&whole).or(exercises::next(&learner.answers));
    match number.and_then(|number| next_step(number, next)) {
        Some(next) => print_line(&format!("\n{next}")),
        None => Ok(()),
    }
}

/// The most time from the end of a terminal's input to its signal, on a machine that is busy.
const HANG_UP: Duration = Duration::from_secs(5);

/// A question of an exercise.
type Question = &'static Exercise;

/// Refuses a number where nothing is drawn.
fn check_seed(asked: &[Question], args: &ExerciseArgs) -> Result<(), Error> {
    let label = match asked {
        _ if args.seed.is_none() || asked.iter().any(|part| part.draws()) => return Ok(()),
        [only] => only.brief().label(),
        _ => asked[0].brief().number.to_string(),
    };
    let why = format!("exercise {label} is the same for everyone: leave --seed out");
    Err(Error::BadInput(why))
}

/// Asks `questions` again.
fn reopen(answers: &mut Answers, questions: &[Question]) {
    questions
        .iter()
        .for_each(|part| answers.reopen(part.brief()));
}

/// A learner with predictions.
struct Learner<'a> {
    answers: Answers,
    /// The questions that are asked again, until the file has it.
    reopened: &'a [Question],
    file: &'a Path,
    args: &'a ExerciseArgs,
}

impl Learner<'_> {
    /// Returns the first question without a prediction.
    fn open(&self, asked: &[Question]) -> Option<Question> {
        let is_open = |part: &Question| self.answers.get(part.brief()).is_none();
        asked.iter().copied().find(is_open)
    }

    /// Prints the hint for the first open one of `asked`, or else for the last one.
    fn hint(&self, asked: &[Question]) -> Result<(), Error> {
        let part = self.open(asked).or(asked.last().copied());
        part.map_or(Ok(()), |part| {
            let brief = part.brief();
            let hint = format!("Hint for {}: {}", brief.label(), brief.hint);
            print_line(&readable(&hint))
        })
    }

    /// Shows the answered questions, and asks the others: a person all of them, each when the
    /// result before it is read, and a script the first one.
    fn go_through(&mut self, asked: &[Question]) -> Result<(), Error> {
        let is_person = io::stdin().is_terminal();
        for (index, part) in asked.iter().copied().enumerate() {
            let is_later = index > 0;
            if is_person && is_later && !goes_on(part.brief())? {
                return Ok(());
            }
            let is_open = self.answers.get(part.brief()).is_none();
            match (is_open, is_person) {
                (true, true) => self.ask(part)?,
                (true, false) => return self.read_answer(part, is_later),
                (false, _) => {
                    if !is_person && is_later {
                        print_line("")?;
                    }
                    self.show(part)?;
                }
            }
        }
        Ok(())
    }

    /// Asks a person one question.
    fn ask(&mut self, part: Question) -> Result<(), Error> {
        // Checks that the file is writable before the learner types a prediction.
        Answers::try_place(self.file)?;
        self.introduce(part, self.seed(part))?;
        self.keep(part, ask(part.brief())?)?;
        self.reveal(part)
    }

    /// Takes the answer to one question from the input of a script, which may be empty where
    /// something `is_shown` above it.
    fn read_answer(&mut self, part: Question, is_shown: bool) -> Result<(), Error> {
        let line = read_line()?;
        if line.trim().is_empty() {
            if is_shown {
                return Ok(());
            }
            if part.evidence(self.seed(part))?.is_some() {
                self.introduce(part, self.seed(part))?;
            }
        }
        self.keep(part, read(&line, part.brief())?)?;
        self.show(part)
    }

    /// Shows an answered question and its result.
    fn show(&mut self, part: Question) -> Result<(), Error> {
        if let Some(prediction) = self.answers.get(part.brief()) {
            self.check_same(part, prediction)?;
            self.introduce(part, prediction.seed())?;
        }
        self.reveal(part)
    }

    /// Answers one question with the text of `--predict`.
    fn predict(&mut self, part: Question, text: &str) -> Result<(), Error> {
        let prediction = Prediction::read(text, part.brief())
            .map_err(|error| Error::BadInput(format!("--predict: {error}")))?;
        self.keep(part, prediction)?;
        self.show(part)
    }

    /// Returns the learner's number for this question; zero where it does not matter.
    fn seed(&self, part: &Exercise) -> u64 {
        self.args.seed.filter(|_| part.draws()).unwrap_or_default()
    }

    /// Keeps a prediction, with the learner's number where that matters.
    fn keep(&mut self, part: Question, prediction: Prediction) -> Result<(), Error> {
        let prediction = match self.seed(part) {
            0 => prediction,
            seed => prediction.about(seed),
        };
        // Another program may have kept one meanwhile.
        let reopened = std::mem::take(&mut self.reopened);
        self.answers = Answers::change(self.file, |answers| {
            reopen(answers, reopened);
            answers.set(part.brief(), prediction);
        })?;
        Ok(())
    }

    /// Refuses another number than that of the prediction.
    fn check_same(&self, part: &Exercise, prediction: &Prediction) -> Result<(), Error> {
        let (known, given) = (prediction.seed(), self.args.seed);
        match given.filter(|given| part.draws() && *given != known) {
            None => Ok(()),
            Some(_) => Err(Error::BadInput(format!(
                "your prediction is about --seed {known}: --redo predicts again"
            ))),
        }
    }

    /// Returns the refusal of a second prediction.
    fn already(&self, asked: &[Question]) -> Error {
        let known = asked.last().and_then(|last| {
            let (brief, known) = (last.brief(), self.answers.get(last.brief())?);
            Some(format!(
                "{} ({})",
                brief.in_unit(known.number()),
                known.reason()
            ))
        });
        Error::BadInput(format!(
            "you already predicted {}: --redo predicts again",
            known.unwrap_or_default()
        ))
    }

    /// Prints the text before the prediction, with the figures to look at.
    fn introduce(&self, part: &Exercise, seed: u64) -> Result<(), Error> {
        let brief = part.brief();
        let evidence = part
            .evidence(seed)?
            .map_or_else(String::new, |table| format!("{table}\n"));
        let number = if part.draws() {
            format!("Drawn from your number, {seed} (--seed).\n\n")
        } else {
            String::new()
        };
        print_line(&format!(
            "Exercise {}: {} ({})\n\n{}\n\n{number}{evidence}{}\n",
            brief.label(),
            brief.title,
            brief.kind,
            readable(&brief.objective),
            readable(&brief.asked()),
        ))
    }

    /// Measures, and prints the figures beside the prediction, and the first one where it
    /// was made again.
    fn reveal(&mut self, part: Question) -> Result<(), Error> {
        let brief = part.brief();
        let Some(prediction) = self.answers.get(brief).cloned() else {
            return Ok(());
        };
        let findings = part.measure(prediction.seed())?;
        print_line(&findings.drawn(brief, &prediction))?;
        print_line(&readable(&findings.reconcile(brief, &prediction)))?;
        self.answers
            .judge(self.file, brief, &findings, prediction.seed())?;
        let redone = self.answers.redone(brief);
        match redone.and_then(|_| self.answers.first(brief)) {
            Some(first) => print_line(&readable(&format!(
                "\nYour first prediction is kept: {}, {}",
                brief.in_unit(first.number()),
                first.reason()
            ))),
            None => Ok(()),
        }
    }
}

/// Waits until the learner goes on to the question of `brief`; returns whether that
/// happened.
fn goes_on(brief: &Brief) -> Result<bool, Error> {
    let line = prompted(&format!(
        "\nEnter goes on to {} ({}) ",
        brief.label(),
        brief.title
    ))?;
    print_line("")?;
    Ok(!line.is_empty())
}

/// Returns the line that a person types behind `question`.
fn prompted(question: &str) -> Result<String, Error> {
    prompt(question)?;
    let line = read_line();
    // Where the terminal was closed its signal comes, and ends the program. It may have been closed
    // before anything was read.
    if line.is_err() || !io::stdin().is_terminal() {
        thread::sleep(HANG_UP);
    }
    line
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
    let unit = match &*brief.unit {
        "" => String::new(),
        unit => format!(" in {unit}"),
    };
    loop {
        let line = prompted(&format!("Your prediction{unit}, and why: "))?;
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

/// Returns the next step after exercise `number`, with the `next` question: what is left of the
/// path of an hour comes first.
fn next_step(number: u32, next: Option<Question>) -> Option<String> {
    if number == RESCUE {
        let how = "Now by hand: ratelab --speed 0.2 --record rescue.rrd, and then\n\
                   ratelab exercise 5 --session rescue.rrd";
        return Some(how.to_owned());
    }
    let next = next?.brief();
    let what = if next.path || next.number == number {
        "Next"
    } else {
        "The path of an hour is done. More"
    };
    Some(format!(
        "{what}: ratelab exercise {} ({})",
        next.label(),
        next.title
    ))
}
