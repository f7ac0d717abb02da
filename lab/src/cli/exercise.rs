//! What can be asked of the exercises.

use std::{path::PathBuf, str::FromStr};

use clap::Args;

/// Which exercise, and what is predicted.
#[derive(Debug, Args)]
#[command(override_usage = "ratelab exercise [N] [OPTIONS]\n       ratelab exercise check [N]")]
pub struct ExerciseArgs {
    /// The number of an exercise, or check; without it they are listed.
    #[arg(value_name = "N | check")]
    pub what: Option<Wanted>,

    /// The one exercise to check.
    #[arg(value_name = "N", hide = true, value_parser = number)]
    pub number: Option<u32>,

    /// Your prediction, such as "30 because …", where nobody can type it.
    #[arg(long, value_name = "TEXT", allow_hyphen_values = true)]
    pub predict: Option<String>,

    /// Predict anew what you predicted before.
    #[arg(long)]
    pub redo: bool,

    /// Judge this recording of a rescue by hand (exercise 5).
    #[arg(long, value_name = "FILE", conflicts_with_all = ["predict", "redo"])]
    pub session: Option<PathBuf>,

    /// Keep predictions in this file [default: exercises/answers.toml in a clone;
    /// elsewhere one of yours, which ratelab exercise names]
    #[arg(long, value_name = "FILE")]
    pub answers: Option<PathBuf>,
}

/// What is wanted of the exercises.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// To do one.
    Exercise(u32),
    /// To have what they promise checked.
    Check,
}

impl FromStr for Wanted {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "check" {
            return Ok(Self::Check);
        }
        let number = text.parse().map(Self::Exercise);
        number.map_err(|_| "expected the number of an exercise, or check".to_owned())
    }
}

fn number(text: &str) -> Result<u32, String> {
    let number = text.parse();
    number.map_err(|_| "expected the number of an exercise".to_owned())
}
