//! `ratelab hunt`: a short list of faults that loses a run.

mod text;

use ratelab::Command;
use ratelab_experiment::{
    Config, Experiment,
    hunt::{Budget, Hunt, Hunted},
};
use ratelab_recording::StopReason;
use ratelab_system::names::good;
use serde_json::json;

use crate::{
    cli::HuntArgs,
    error::Error,
    options::{self, Defaults},
    output::{OutputFile, print_line, print_recorded, print_result, refuse_existing, try_new},
    program::Program,
    results::{destination_of, read_topics, record},
    signals,
    summary::text::line,
};

/// Defaults of the run.
const DEFAULTS: Defaults =
    Defaults::virtual_only("a hunt runs on the virtual clock: leave --clock real out");

/// Runs the hunt; prints and writes its outcome. Ctrl-C keeps the best list so far.
pub fn hunt(program: &Program, args: &HuntArgs) -> Result<(), Error> {
    let (config, _) = options::graph(program, &args.graph, &DEFAULTS)?;
    let budget = budget(program, args, &config)?;
    let save = prepare_outputs(args)?;
    let mut hunt = Hunt::new(program.system.clone(), config);
    hunt.threads = args.threads.unwrap_or(hunt.threads);
    hunt.interrupt = signals::interrupt();
    let hunted = hunt.run(&budget, &|| false)?;
    if !args.json {
        print_line(&line("hunt", &text::budget(&budget)))?;
    }
    match hunted {
        Hunted::Held { runs, stopped } => print_held(program, args, runs, stopped),
        Hunted::Lost(found) => {
            let config = hunt.with(&found.knobs);
            let system = &*program.system;
            let outcome = text::outcome(system, &found);
            print_result(args.json, &text::json(system, &found), &outcome)?;
            if let Some(file) = save {
                file.write(text::file(system, &found, &config.knobs).as_bytes())?;
            }
            record_run(program, args, &config)
        }
    }
}

/// Checks the files to write, because the hunt takes long, and must not overwrite a file. Returns
/// that of `--save`.
fn prepare_outputs(args: &HuntArgs) -> Result<Option<OutputFile>, Error> {
    if args.save.is_some() && args.save == args.record {
        let why = "--save and --record name the same file: choose another name for one of them";
        return Err(Error::BadInput(why.to_owned()));
    }
    for (option, path) in [("--save", &args.save), ("--record", &args.record)] {
        path.as_deref()
            .map_or(Ok(()), |path| refuse_existing(option, path))?;
    }
    let record = args.record.as_deref();
    record.map_or(Ok(()), |path| try_new("--record", path))?;
    let save = args.save.as_deref();
    save.map(|path| OutputFile::open("--save", path))
        .transpose()
}

fn budget(program: &Program, args: &HuntArgs, config: &Config) -> Result<Budget, Error> {
    let experiment = Experiment::new(program.system.clone(), config)?;
    // The last topic that is read, in the order in which nodes were added.
    let last = || read_topics(&experiment).pop().unwrap_or_default();
    let topic = args.topic.clone().unwrap_or_else(last);
    let offset = args
        .shift
        .as_ref()
        .and_then(|(node, _)| config.setup.offset(node));
    let budget = Budget {
        topic,
        lose: args.lose,
        delay: args.delay_ms.unwrap_or_default(),
        hang: args.hang.clone(),
        shift: args.shift.clone(),
        offset: offset.unwrap_or_default(),
        ..Budget::default()
    };
    let mut setup = program.system.about().setup();
    setup.extend(config.setup.iter().cloned());
    Ok(budget.fitted(&experiment.observer().topology(), &setup))
}

fn print_held(program: &Program, args: &HuntArgs, runs: usize, stopped: bool) -> Result<(), Error> {
    let good = good(&*program.system);
    let data = json!({ "found": false, "lists_tried": runs, "stopped": stopped });
    let text = if stopped {
        format!("nothing in the {runs} lists of faults tried until the stop")
    } else {
        format!("none of {runs} lists of faults is enough: the run {good} with each; allow more")
    };
    print_result(args.json, &data, &line("found", &text))
}

/// Records the run of `config`, if it is to be recorded.
fn record_run(program: &Program, args: &HuntArgs, config: &Config) -> Result<(), Error> {
    let Some(path) = &args.record else {
        return Ok(());
    };
    let experiment = Experiment::new(program.system.clone(), config)?;
    let recorder = record(destination_of(Some(path.clone()), None), &experiment)?;
    let commands = experiment.commands();
    // The run of a hunt that was stopped is recorded whole: the next signal ends the program.
    signals::watch(move || drop(commands.send(Command::Stop)), || ());
    let outcome = experiment.run();
    recorder.end(StopReason::from_outcome(&outcome));
    print_recorded(args.json, &recorder.finish()?)?;
    outcome.map(drop).map_err(Error::from)
}
