//! `ratelab run`: the graph without a dashboard.

use ratelab::{ClockKind, Command, Interrupt};
use ratelab_experiment::{Experiment, StepWriter};
use ratelab_real_clock::RealClock;
use ratelab_recording::StopReason;

use super::readings::other_readings;
use crate::{
    cli::PlainRunArgs,
    error::Error,
    options::{self, RUN},
    output::{self, Outputs, note, print_recorded},
    program::Program,
    results::{context, destination, plan, print_results, record},
    signals,
    summary::{
        ages::{PhaseSpread, phase_sweep},
        text::ReportContext,
    },
};

/// Runs the graph, then prints and writes its summary.
pub fn run(program: &Program, plain: &PlainRunArgs) -> Result<(), Error> {
    let args = &plain.run;
    let (config, like) = options::config(program, args, &RUN)?;
    let mut experiment = Experiment::new(program.system.clone(), &config)?;
    let realtime = options::realtime(&args.graph);
    let mut real = RealClock::new(realtime.clone().and_then(Result::ok));
    experiment.check_clock(&real)?;
    if experiment.config().clock == ClockKind::Virtual {
        experiment.tie_notes().iter().for_each(|text| note(text));
    }
    let phases = plain
        .phases
        .map(|count| phase_sweep(&experiment, count))
        .transpose()?;
    let (commands, interrupt) = (experiment.commands(), Interrupt::default());
    let asked = interrupt.clone();
    // The results of what is done are still written.
    let stop = move || {
        asked.ask();
        drop(commands.send(Command::Stop));
    };
    signals::watch(stop, || ());
    let mut outputs = Outputs::prepare(&plan(args, &experiment)?)?;
    experiment.watch_ages();
    let recorder = destination(args)
        .map(|to| record(to, &experiment))
        .transpose()?;
    let mut csv = outputs.csv.take();
    let rows = csv
        .as_mut()
        .map(output::OutputFile::begin)
        .transpose()?
        .map(|file| StepWriter::start(Ok(file), &experiment));
    let outcome = experiment.run_with(&mut real);
    let recorded = recorder.map(|recorder| {
        recorder.end(StopReason::from_outcome(&outcome));
        recorder.finish()
    });
    let written = rows.zip(csv).map(|(rows, csv)| csv.complete(rows.finish()));
    let reported = outcome.map_err(Error::from).and_then(|summary| {
        let csv_lost = written.unwrap_or(Ok(0))?;
        let spread = phases.map(|sweep| PhaseSpread::measure(&sweep, &interrupt));
        let context = ReportContext {
            phases: spread.transpose()?,
            readings: other_readings(program, &config, &interrupt),
            ..context(args, realtime, csv_lost)
        };
        print_results(program, args, outputs, &summary, &context, like.as_ref())?;
        context.phases.map_or(Ok(()), |spread| spread.if_stopped())
    });
    both(
        reported,
        recorded.map_or(Ok(()), |recorded| print_recorded(args.json, &recorded?)),
    )
}

/// Returns one of two errors, and prints the other.
fn both(first: Result<(), Error>, second: Result<(), Error>) -> Result<(), Error> {
    if let (Err(error), Err(_)) = (&first, &second) {
        output::error(error);
    }
    second.and(first)
}
