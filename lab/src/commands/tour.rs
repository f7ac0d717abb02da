//! `ratelab tour`: the lab with a guide.

use ratelab_screen::Guide;

use crate::{
    cli::ScreenArgs,
    error::Error,
    options::LAB,
    output::print_line,
    program::{self, Program},
    results::print_recordings,
    screen::{need_terminal, screen, sessions},
};

/// Opens the lab at the beginning of the tour.
pub fn tour(program: &Program, args: &ScreenArgs) -> Result<(), Error> {
    need_terminal("the tour needs a terminal to draw on", "run")?;
    let setup = sessions(program, args.limits);
    let left = ratelab_screen::show(&LAB.config(), setup, &screen(args), Guide::Tour)?;
    print_recordings(false, &left.recorded)?;
    left.ended?;
    let name = program::name();
    print_line(&format!(
        "Next: {name} exercise 1, which asks for a prediction first; {name} opens the lab."
    ))?;
    left.unrecorded.map_or(Ok(()), |error| Err(error.into()))
}
