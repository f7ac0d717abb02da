//! The terminal as options and surroundings have it.

use crate::{
    cli::ScreenArgs,
    dashboard::{self, Options, view::theme::Theme},
    error::Error,
};

/// Refuses with `why` if there is nothing to draw on.
pub fn need_terminal(why: &str) -> Result<(), Error> {
    if dashboard::terminal_is_there() {
        Ok(())
    } else {
        Err(Error::BadInput(why.to_owned()))
    }
}

/// How a dashboard is drawn.
pub fn screen(args: &ScreenArgs) -> Options {
    Options {
        fps: args.fps,
        theme: theme(args.ascii),
    }
}

/// Colours unless the person wants none (<https://no-color.org>).
pub fn theme(ascii: bool) -> Theme {
    let no_color = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    Theme {
        colour: !no_color,
        ascii,
    }
}
