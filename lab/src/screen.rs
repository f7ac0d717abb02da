//! Settings of the terminal, from options and environment.

use crate::{
    cli::ScreenArgs,
    dashboard::{self, Options, view::theme::Theme},
    error::Error,
    program,
};

/// Refuses with `why` if there is no terminal; `instead` is a command to try.
pub fn need_terminal(why: &str, instead: &str) -> Result<(), Error> {
    if dashboard::terminal_is_there() {
        return Ok(());
    }
    let program = program::name();
    Err(Error::BadInput(format!("{why}: try {program} {instead}")))
}

/// How a dashboard is drawn.
pub fn screen(args: &ScreenArgs) -> Options {
    Options {
        fps: args.fps,
        theme: theme(args.ascii),
    }
}

/// Uses colours unless the environment disables them (<https://no-color.org>).
pub fn theme(ascii: bool) -> Theme {
    let no_color = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    Theme {
        colour: !no_color,
        ascii,
    }
}
