//! Settings of the terminal, from options and environment.

use std::{
    path::PathBuf,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::Duration,
};

use ratelab_screen::{
    Look, OpenRows, Options, SessionSetup, Theme, restore_terminal, terminal_is_there,
};

use crate::{
    cli::ScreenArgs,
    course::CartPoleCourse,
    error::Error,
    output::{self, Live},
    predictions::answers_file,
    program::{self, Program},
    signals,
};

/// Returns the error `why` without a terminal; `instead` is a command to try.
pub fn need_terminal(why: &str, instead: &str) -> Result<(), Error> {
    if terminal_is_there() {
        return Ok(());
    }
    let program = program::name();
    Err(Error::BadInput(format!("{why}: try {program} {instead}")))
}

/// Display options of a dashboard.
pub fn screen(args: &ScreenArgs) -> Options {
    let theme = theme(args.ascii, args.theme);
    let term = std::env::var("TERM").unwrap_or_default();
    Options {
        fps: args.fps,
        theme,
        ask_background: args.theme.is_none() && theme.colour && !SIMPLE.contains(&&*term),
        quit_on_signal,
    }
}

/// Sessions of the program's system; in the course, with the learner's predictions. The limits
/// of the push age are `shown`, or hidden until the learner has predicted them.
pub fn sessions(program: &Program, shown: bool) -> SessionSetup {
    let system = program.system.clone();
    if !program.course {
        return SessionSetup::new(system, None);
    }
    let course = CartPoleCourse::new(answers_file(None));
    SessionSetup {
        hides_limits: !shown && !course.has_found_limits(),
        ..SessionSetup::new(system, Some(Arc::new(course)))
    }
}

/// Sessions for a picture, the same for every learner: in the course the limits of the push age
/// are hidden unless they are `shown`.
pub fn pictured(program: &Program, shown: bool) -> SessionSetup {
    SessionSetup {
        hides_limits: program.course && !shown,
        ..sessions(program, true)
    }
}

/// Opens the file at `path` for the rows of a session, each time that one begins.
pub fn rows_to(path: PathBuf) -> OpenRows {
    Arc::new(move || {
        let mut file = Live::open(&path)?;
        Ok(Box::new(move || Ok(Box::new(file.begin()?) as _)))
    })
}

/// Time for an orderly end after a signal, before the program ends at once.
const GRACE: Duration = Duration::from_secs(2);

/// SIGTERM and similar signals end the screen as the key does. If the terminal is
/// blocked or a node is stuck, the program ends at once, as it does at a second signal.
pub fn quit_on_signal() -> Arc<AtomicBool> {
    let quit = Arc::new(AtomicBool::new(false));
    let asked = quit.clone();
    let first = move || {
        asked.store(true, Ordering::Relaxed);
        thread::spawn(|| {
            thread::sleep(GRACE);
            signals::await_recordings(|| true);
            restore_terminal();
            output::error(&"the run did not end in order: a node is still busy");
            signals::end_at_once();
        });
    };
    signals::watch(first, restore_terminal);
    quit
}

/// Terminals that would print the query for their background.
const SIMPLE: [&str; 2] = ["linux", "dumb"];

/// Uses colours unless the environment disables them (<https://no-color.org>).
///
/// Without an option the background is guessed from `COLORFGBG`, which some terminals
/// set: two or three numbers of colours, the last of them that of the background.
pub fn theme(ascii: bool, look: Option<Look>) -> Theme {
    let no_color = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    Theme {
        colour: !no_color,
        ascii,
        look: look.unwrap_or_else(|| guessed(std::env::var("COLORFGBG").ok().as_deref())),
    }
}

/// Returns the background that a terminal states; dark without a statement.
fn guessed(colours: Option<&str>) -> Look {
    let background = colours.and_then(|colours| colours.rsplit(';').next()?.parse().ok());
    match background {
        Some(7 | 9..=15) => Look::Light,
        _ => Look::Dark,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_background_is_guessed_from_the_last_number() {
        for (colours, look) in [
            (None, Look::Dark),
            (Some("15;0"), Look::Dark),
            (Some("0;15"), Look::Light),
            (Some("0;default;15"), Look::Light),
            (Some("7;8"), Look::Dark),
            (Some("0;default"), Look::Dark),
            (Some(""), Look::Dark),
        ] {
            assert_eq!(guessed(colours), look, "{colours:?}");
        }
    }
}
