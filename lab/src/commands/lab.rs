//! `ratelab lab`: the dashboard over a running graph.

#[cfg(feature = "network")]
use ratelab_experiment::Config;
use ratelab_experiment::Experiment;
use ratelab_screen::{Guide, ScreenError, SessionSetup};

#[cfg(feature = "network")]
use crate::output::print_recorded;
use crate::{
    cli::LabArgs,
    error::Error,
    first_start,
    options::{self, LAB},
    output::{Outputs, print_line, record_error, write_error},
    program::Program,
    results::{context, destination, plan, print_recordings, print_results},
    screen::{need_terminal, rows_to, screen, sessions},
    summary::text::{self, ReportContext},
};

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
    let guide = if program.course && first_start::is_first() {
        Guide::Offer
    } else {
        Guide::Nobody
    };
    let left = ratelab_screen::show(&config, setup, &screen(&args.screen), guide)
        .map_err(|error| refusal(args, error))?;
    if guide == Guide::Offer {
        first_start::remember();
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
