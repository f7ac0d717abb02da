//! The arguments of the exercises.

use std::{path::PathBuf, str::FromStr};

use clap::Args;

/// The choice of an exercise, and the prediction.
#[derive(Debug, Args)]
#[command(override_usage = "ratelab exercise [N] [OPTIONS]\n       ratelab exercise check [N]")]
pub struct ExerciseArgs {
    /// The number of an exercise, or check; without it they are listed.
    #[arg(value_name = "N | check")]
    pub what: Option<Wanted>,

    /// The exercise to check, if it is only one.
    #[arg(value_name = "N", hide = true, value_parser = number)]
    pub number: Option<u32>,

    /// Your prediction, such as "30 because …", for scripts.
    #[arg(long, value_name = "TEXT", allow_hyphen_values = true)]
    pub predict: Option<String>,

    /// Replace your earlier prediction.
    #[arg(long)]
    pub redo: bool,

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
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// Do an exercise.
    Exercise(u32),
    /// Check the promises of the exercises.
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
