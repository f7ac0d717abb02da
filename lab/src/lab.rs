//! `ratelab lab`: the dashboard over a running graph.

use ratelab::runtime::{ClockKind, Speed, Time};

use crate::{
    cli::LabArgs,
    dashboard::{self, Options, Setup, keys, view::theme::Theme},
    error::Error,
    options::{self, Usual},
    run::{Outputs, say},
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
    if !dashboard::terminal_is_there() {
        let why = "the lab needs a terminal to draw on: try ratelab run";
        return Err(Error::BadInput(why.to_owned()));
    }
    let outputs = Outputs::prepare(&args.run)?;
    let realtime = options::realtime(&args.run.graph);
    let options = Options {
        fps: args.fps,
        theme: theme(args.ascii),
        setup: Setup {
            realtime: realtime.clone().and_then(Result::ok),
            csv: args.run.csv.clone(),
        },
    };
    let ended = dashboard::show(&config, &options)?;
    outputs.tell(&args.run, &ended.summary, realtime, ended.csv_lost)
}

/// Colours unless the person wants none (<https://no-color.org>).
fn theme(ascii: bool) -> Theme {
    let no_color = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    Theme {
        colour: !no_color,
        ascii,
    }
}

/// Prints the keys of the lab.
pub fn keys() -> Result<(), Error> {
    say(keys::text().trim_end())
}
