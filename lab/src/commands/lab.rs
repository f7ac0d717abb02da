//! The lab on the screen, with the tour or without it, and pictures of it.

use std::{path::PathBuf, slice, sync::Arc};

use ratelab_experiment::Experiment;
use ratelab_screen::{Guide, ScreenError, SessionSetup, picture as pictures};

use crate::{
    cli::{LabArgs, PictureArgs, ScreenArgs},
    error::Error,
    options::{self, Defaults, LAB},
    output::{OutputKind, Outputs, print_line, record_error, write_error},
    predictions,
    program::{self, Program},
    reading,
    results::{context, destination, plan, print_recordings, print_results},
    screen::{need_terminal, pictured, rows_to, screen, sessions, theme},
    summary::text::{self, ReportContext},
};

#[cfg(feature = "network")]
use crate::output::print_recorded;
#[cfg(feature = "network")]
use ratelab_experiment::Config;

/// Opens the dashboard; on exit writes and prints the summary of the last run.
pub fn lab(program: &Program, args: &LabArgs) -> Result<(), Error> {
    if let Some(address) = &args.attach {
        return attach(program, args, address);
    }
    let (config, like) = options::config(program, &args.run, &LAB)?;
    let experiment = Experiment::new(program.system.clone(), &config)?;
    need_terminal("the lab needs a terminal to draw on", "run")?;
    let outputs = Outputs::beside_csv(&plan(&args.run, &experiment)?)?;
    // A policy that is a program ran for the check alone.
    drop(experiment);
    let realtime = options::realtime(&args.run.graph);
    let setup = SessionSetup {
        realtime: realtime.clone().and_then(Result::ok),
        csv: args.run.csv.clone().map(rows_to),
        record: destination(&args.run),
        ..sessions(program, args.screen.limits)
    };
    let guide = if program.course && predictions::is_first() {
        Guide::Offer
    } else {
        Guide::Nobody
    };
    let left = ratelab_screen::show(&config, setup, &screen(&args.screen), guide)
        .map_err(|error| refusal(args, error))?;
    if guide == Guide::Offer {
        predictions::remember();
    }
    print_recordings(args.run.json, &left.recorded)?;
    let ended = left.ended.map_err(|error| unfinished(args, error))?;
    let context = ReportContext {
        covered: left.covered,
        ..context(&args.run, realtime, ended.csv_lost)
    };
    print_results(
        program,
        &args.run,
        outputs,
        &ended.summary,
        &context,
        like.as_ref(),
    )?;
    if let Some(so) = left.change.filter(|_| !args.run.json) {
        print_line(&text::line("so", &so))?;
    }
    left.unrecorded.map_or(Ok(()), |error| Err(error.into()))
}

/// Opens the dashboard over the run of other processes; on exit writes and prints the
/// summary of the last run that it showed.
#[cfg(feature = "network")]
fn attach(program: &Program, args: &LabArgs, address: &str) -> Result<(), Error> {
    need_terminal("the lab needs a terminal to draw on", "run")?;
    let experiment = Experiment::new(program.system.clone(), &Config::default())?;
    let outputs = Outputs::prepare(&plan(&args.run, &experiment)?)?;
    drop(experiment);
    let end = crate::network::attached(address, args.zenoh_config.clone(), args.wait_s);
    let destination = destination(&args.run);
    let seen = crate::network::show(program, end, destination, &screen(&args.screen))?;
    for recorded in seen.recorded {
        print_recorded(args.run.json, &recorded?)?;
    }
    let Some((summary, ended)) = seen.last else {
        return Ok(());
    };
    let context = ReportContext {
        open: (!ended).then(|| "its dashboard was closed then, and the run went on".to_owned()),
        ..ReportContext::default()
    };
    print_results(program, &args.run, outputs, &summary, &context, None)
}

/// Prints how to get it.
#[cfg(not(feature = "network"))]
fn attach(_: &Program, _: &LabArgs, _: &str) -> Result<(), Error> {
    Err(Error::without_network("lab --attach"))
}

/// Adds the name of the file to an error of writing rows.
fn unfinished(args: &LabArgs, error: ScreenError) -> Error {
    match (error, &args.run.csv) {
        (ScreenError::Csv(why), Some(path)) => write_error(path, why),
        (error, _) => error.into(),
    }
}

/// Turns errors of creating files into errors of the input.
fn refusal(args: &LabArgs, error: ScreenError) -> Error {
    match (error, &args.run.csv) {
        (ScreenError::Record(error), _) => record_error(error),
        (ScreenError::Csv(why), Some(path)) => Error::unwritable("--csv", path, &why),
        (error, _) => error.into(),
    }
}

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

/// Defaults of the run: on the virtual clock, the same picture bit for bit.
const DEFAULTS: Defaults = Defaults::virtual_only(
    "a picture is of the virtual clock: leave --clock real out, or name a recording",
);

/// Draws a recording or a run, and writes the picture.
pub fn picture(program: &Program, args: &PictureArgs) -> Result<(), Error> {
    let theme = theme(args.ascii, Some(args.theme));
    let output = |picture: &str, read: &[PathBuf]| {
        OutputKind::Drawing.write("--output", &args.output, read, picture.as_bytes())
    };
    if let Some(file) = &args.file {
        refuse_options(args)?;
        let recording = Arc::new(reading::read(file)?);
        let at = args.at.unwrap_or(recording.until);
        Error::if_after_end(at, &recording)?;
        let (setup, size) = (
            pictured(&program.for_recording(&recording), args.limits),
            args.size,
        );
        let picture = match args.animate {
            None => pictures::draw_recording(recording.clone(), setup, at, size, &theme),
            Some(speed) => pictures::moving(recording.clone(), setup, at, speed, size, &theme),
        }?;
        output(&picture, slice::from_ref(file))?;
        return Error::if_damaged(&recording);
    }
    let end = args.at.unwrap_or(DEFAULTS.end);
    let defaults = Defaults { end, ..DEFAULTS };
    let (config, _) = options::graph(program, &args.graph, &defaults)?;
    let picture = pictures::draw_run(&config, pictured(program, args.limits), args.size, &theme)?;
    output(&picture, &[])
}

/// Refuses options of a run beside a recording, whose run is given.
fn refuse_options(args: &PictureArgs) -> Result<(), Error> {
    let graph = &args.graph;
    let given = !graph.system.given.is_empty()
        || graph.system.broken
        || !graph.knob.is_empty()
        || graph.knobs.is_some()
        || graph.clock.is_some()
        || graph.duration_s.is_some()
        || graph.seed.is_some()
        || graph.like.is_some()
        || graph.speed.is_some()
        || graph.realtime
        || graph.timing.world.is_some()
        || graph.timing.world_step_ms.is_some()
        || !graph.timing.takes.is_empty()
        || !graph.timing.offset.is_empty();
    if given {
        let why = "the run of a recording is what it was: leave the options of the graph out";
        Err(Error::BadInput(why.to_owned()))
    } else {
        Ok(())
    }
}
