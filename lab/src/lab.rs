//! `ratelab lab`: the dashboard over a running graph.

use ratelab::runtime::{ClockKind, Speed, Time};

use crate::{
    cli::{LabArgs, ScreenArgs},
    dashboard::{self, LabError, Options, Setup, keys, view::theme::Theme},
    error::Error,
    options::{self, Usual},
    recording::Destination,
    run::{Outputs, record_error, say, tell_recorded},
};

/// What is done here can be done again, so virtual time is what it starts with.
const USUAL: Usual = Usual {
    clock: ClockKind::Virtual,
    end: Time::MAX,
    speed: Speed::REAL_TIME,
};

/// Opens the dashboard; writes and prints what the last run came to when it is
/// left.
pub fn lab(args: &LabArgs) -> Result<(), Error> {
    let config = options::config(&args.run, &USUAL)?;
    need_terminal("the lab needs a terminal to draw on: try ratelab run")?;
    let outputs = Outputs::prepare(&args.run)?;
    let realtime = options::realtime(&args.run.graph);
    let setup = Setup {
        realtime: realtime.clone().and_then(Result::ok),
        csv: args.run.csv.clone(),
        record: args.run.record.clone().map(Destination::new),
    };
    let left = dashboard::show(&config, setup, &screen(&args.screen)).map_err(refusal)?;
    for recorded in &left.recorded {
        tell_recorded(args.run.json, recorded)?;
    }
    let ended = left.ended?;
    outputs.tell(&args.run, &ended.summary, realtime, ended.csv_lost)?;
    left.unrecorded.map_or(Ok(()), |error| Err(error.into()))
}

/// Refuses with `why` if there is nothing to draw on.
pub fn need_terminal(why: &str) -> Result<(), Error> {
    if dashboard::terminal_is_there() {
        Ok(())
    } else {
        Err(Error::BadInput(why.to_owned()))
    }
}

/// A recording that cannot begin is the fault of what was asked for.
fn refusal(error: LabError) -> Error {
    match error {
        LabError::Record { path, why } => record_error(&path, &why),
        error => error.into(),
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

/// Prints the keys of the lab.
pub fn keys() -> Result<(), Error> {
    let replay = keys::REPLAY.text();
    say(&format!(
        "{}\nwhile the cliff map is open:\n{}\nwhile a recording plays:\n{}",
        keys::LAB.text(),
        keys::MAP.text(),
        replay.trim_end()
    ))
}
