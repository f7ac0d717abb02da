//! `ratelab sweep`: many runs at once, and their survival.

use std::{
    io::{IsTerminal, stdout},
    ops::ControlFlow,
};

use ratelab_experiment::sweep::{Sweep, Swept, all_cores};

use crate::{
    cli::{ByArg, SweepArgs},
    error::Error,
    output::{OutputPlan, Outputs, ProgressLine, note, print_coloured, print_data},
    program::Program,
    results::input_files,
    screen::theme,
    signals,
    sweep::{
        cliff::AgeTable,
        data,
        map::{self, MapStyle},
        record::Record,
        summary::SweepSummary,
        svg,
    },
};

/// Name of the file in `--out`.
const FILE: &str = "sweep.json";

/// Runs every cell, then prints and writes the results. Ctrl-C keeps the finished ones.
pub fn sweep(program: &Program, args: &SweepArgs) -> Result<(), Error> {
    let sweep = args.sweep(program)?;
    let cells = sweep.cells()?;
    let topics = data::topics(&sweep)?;
    let header = data::header(&sweep, &topics);
    let interrupt = signals::interrupt();
    let outputs = Outputs::prepare(&plan(args, &sweep, &header))?;
    note_overload(&sweep, cells);
    let record = args.record.as_deref().map(Record::create).transpose()?;
    let bar = ProgressLine::for_runs(cells, args.ascii, args.json);
    let threads = args.threads.unwrap_or_else(all_cores);
    let swept = sweep.run_until(&interrupt, threads, |_, _| {
        bar.advance();
        ControlFlow::Continue(())
    })?;
    drop(bar);
    note_without_data(&swept);
    print_results(program, args, &swept, &topics, outputs, record)?;
    Error::if_stopped(swept.finished().count(), cells, "runs")
}

/// The most cells that are looked at for an overload.
const LOOKED_AT: usize = 1_000;

/// Prints the first overload among the values of the axes, if any.
fn note_overload(sweep: &Sweep, cells: usize) {
    let settings = sweep.system.about().setup();
    let indices = (0..cells).step_by(sweep.seeds.len().max(1)).take(LOOKED_AT);
    let overload = indices
        .filter_map(|index| sweep.cell(index))
        .find_map(|cell| {
            let mut setup = settings.clone();
            setup.extend(sweep.config(&cell).setup.iter().cloned());
            let warning = sweep
                .system
                .warnings(&setup)
                .into_iter()
                .chain(sweep.system.overloads(&setup))
                .next()?;
            Some(
                cell.values
                    .iter()
                    .filter(|value| !value.knobs.is_empty())
                    .map(|value| format!("{} {}: ", value.axis, value.text))
                    .collect::<String>()
                    + &warning,
            )
        });
    overload.iter().for_each(|text| note(text));
}

/// Prints how many runs had a chain without data, and why the first one had, if there are such runs.
fn note_without_data(swept: &Swept) {
    let runs = swept.finished().count();
    let mut silent = swept
        .finished()
        .filter_map(|(_, run)| run.without_data.as_deref())
        .peekable();
    if let Some(first) = silent.peek().copied() {
        let count = silent.count();
        note(&format!(
            "a chain without data is lost, as in {count} of {runs} runs: {first}"
        ));
    }
}

/// Returns the files to write according to `args`, with `header` above the rows, and the files that
/// `sweep` reads.
fn plan<'a>(args: &'a SweepArgs, sweep: &Sweep, header: &str) -> OutputPlan<'a> {
    let values = sweep.axes.iter().flat_map(|axis| &axis.values);
    let knobs = values
        .flat_map(|value| &value.knobs)
        .chain(sweep.base.setup.iter());
    OutputPlan {
        out: args.out.as_deref(),
        metrics: FILE,
        csv: args.csv.as_deref(),
        svg: args.svg.as_deref(),
        header: header.to_owned(),
        record: args.record.as_deref(),
        inputs: input_files(&*sweep.system, knobs),
    }
}

/// Writes the requested files, and prints the results.
fn print_results(
    program: &Program,
    args: &SweepArgs,
    swept: &Swept,
    topics: &[String],
    mut outputs: Outputs,
    record: Option<Record>,
) -> Result<(), Error> {
    let theory = args.system.theory;
    let wanted = theory || (record.is_some() && program.course);
    let mut summary = SweepSummary::new(swept, wanted)?;
    summary.theory = theory;
    if let Some(mut csv) = outputs.csv.take() {
        let file = csv.begin()?;
        let header = data::header(swept.sweep(), topics);
        csv.complete(data::write(file, &header, swept))?;
    }
    if let Some(file) = outputs.svg.take() {
        file.write(svg::svg(&summary).as_bytes())?;
    }
    let by_age = args.by.map(|ByArg::Age| AgeTable::new(swept, &summary));
    let json = data::json_text(&summary, swept, topics, by_age.as_ref());
    outputs.write(&json)?;
    if args.json {
        print_data(&json)?;
    } else if args.markdown && by_age.is_none() {
        print_data(&svg::markdown(&summary, &style(args).theme))?;
    } else {
        let style = style(args);
        print_coloured(&match by_age {
            Some(table) => map::by_age(&summary, &table, &style),
            None => map::text(&summary, &style),
        })?;
    }
    match record {
        Some(record) => record.write(&summary),
        None => Ok(()),
    }
}

/// Style of the map: with colour on a terminal only.
fn style(args: &SweepArgs) -> MapStyle {
    let mut theme = theme(args.ascii, None);
    let terminal = stdout().is_terminal();
    theme.colour &= terminal;
    let size = crossterm::terminal::size().ok().filter(|_| terminal);
    MapStyle {
        theme,
        width: size.map_or(80, |(columns, _)| usize::from(columns)),
    }
}
