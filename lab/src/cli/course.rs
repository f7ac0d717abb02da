//! The arguments of the exercises, and of grading.

use std::{path::PathBuf, str::FromStr};

use clap::Args;

use super::{heading, values::ValueError};

/// The choice of an exercise, and the prediction.
#[derive(Debug, Args)]
#[command(override_usage = "ratelab exercise [N] [OPTIONS]\n       ratelab exercise check [N]")]
pub struct ExerciseArgs {
    /// The number of an exercise (1 to 14), one of its questions (6a to 6d, 7a, 7b, 8a, 8b,
    /// 9a, 9b, 13a to 13c, 14a, 14b), or check; without it they are listed.
    #[arg(value_name = "N | check")]
    pub what: Option<Wanted>,

    /// The exercise to check, if it is only one.
    #[arg(value_name = "N", hide = true)]
    pub number: Option<Label>,

    /// Your prediction, such as "30 because …", for scripts.
    #[arg(long, value_name = "TEXT", allow_hyphen_values = true)]
    pub predict: Option<String>,

    /// Predict again. Your first prediction is kept beside the new one, and is the one that counts.
    #[arg(long)]
    pub redo: bool,

    /// Print a hint for the next open question, without the answer.
    #[arg(long, conflicts_with_all = ["predict", "redo", "session"])]
    pub hint: bool,

    /// Your number: exercises that draw what they measure draw it from this one.
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,

    /// Judge this recording of a rescue by hand (exercise 5).
    #[arg(long, value_name = "FILE", conflicts_with_all = ["predict", "redo", "seed"])]
    pub session: Option<PathBuf>,

    /// Keep predictions in this file [default: exercises/answers.toml in a clone;
    /// elsewhere one of yours, which ratelab exercise names]
    #[arg(long, value_name = "FILE")]
    pub answers: Option<PathBuf>,
}

/// The action to take.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// Do an exercise.
    Exercise(Label),
    /// Check the promises of the exercises.
    Check,
}

/// An exercise, such as `6`, or one of its questions, such as `6b`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Label(pub String);

impl FromStr for Wanted {
    type Err = ValueError;

    fn from_str(text: &str) -> Result<Self, ValueError> {
        match text {
            "check" => Ok(Self::Check),
            _ => text
                .parse()
                .map(Self::Exercise)
                .map_err(|_: ValueError| ValueError::ExerciseOrCheck(exercises::labels())),
        }
    }
}

impl FromStr for Label {
    type Err = ValueError;

    fn from_str(text: &str) -> Result<Self, ValueError> {
        let label = text.to_lowercase();
        let number = label.trim_end_matches(|c: char| c.is_ascii_lowercase());
        let letters = label.len() - number.len();
        match number.parse::<u32>() {
            Ok(number) if letters <= 1 => {
                let letter = &label[label.len() - letters..];
                Ok(Self(format!("{number}{letter}")))
            }
            _ => Err(ValueError::Exercise(exercises::labels())),
        }
    }
}

/// The hand-ins, and where the result goes.
#[derive(Debug, Args)]
pub struct GradeArgs {
    /// The folder with one folder per learner, named after the learner. A hand-in is the
    /// file answers.toml of ratelab exercise, and any recordings (.rrd) of a rescue.
    #[arg(value_name = "DIR")]
    pub dir: PathBuf,

    /// Check the learners' numbers (--seed) against this file: a name and a number per
    /// line, such as anna,17.
    #[arg(long, value_name = "FILE")]
    pub roster: Option<PathBuf>,

    /// Write one row per prediction and per recording to this file.
    #[arg(long, value_name = "FILE", help_heading = heading::OUTPUT)]
    pub csv: Option<PathBuf>,

    /// Print the result as JSON and nothing else.
    #[arg(long, help_heading = heading::OUTPUT)]
    pub json: bool,
}
