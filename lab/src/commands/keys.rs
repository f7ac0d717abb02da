//! `ratelab keys`: the keys of the lab.

use ratelab_experiment::{Config, own_world};
use ratelab_screen::keys::{self, Need};

use crate::{error::Error, output::print_line, program::Program};

/// Prints the keys of the lab that have an effect for the system.
pub fn print_keys(program: &Program) -> Result<(), Error> {
    let own_world = own_world(&program.system, &Config::default()).is_some();
    let has = |need| match need {
        Need::Course => program.course,
        Need::Breakable => program.system.knobs().broken().is_some(),
        Need::OwnWorld => own_world,
        Need::Nothing | Need::Choices | Need::SecondRate => true,
    };
    print_line(&format!(
        "{}\nwhile the cliff map is open:\n{}\nwhile a recording plays:\n{}",
        keys::LAB.text(has),
        keys::MAP.text(|_| true),
        keys::REPLAY.text(|_| true).trim_end()
    ))
}
