//! `ratelab sweep`: many runs at once, and how often the pole stayed up.

use std::{
    io::{IsTerminal, stdout},
    ops::ControlFlow,
    sync::atomic::Ordering,
};

use ratelab::{
    experiment::sweep::{Sweep, Swept, all_cores},
    policy::PolicyCache,
};

use crate::{
    cli::SweepArgs,
    error::Error,
    output::{OutputPlan, Outputs, print_line},
    results::policy_files,
    screen::theme,
    signals,
    sweep::{
        csv, json,
        map::{self, MapStyle},
        progress::Bar,
        record::Record,
        summary::SweepSummary,
        theory::Theory,
    },
};

/// Name of the file in `--out`.
const FILE: &str = "sweep.json";

/// Runs every cell, prints and writes what came of them. Ctrl-C keeps what is
/// done.
pub fn sweep(args: &SweepArgs) -> Result<(), Error> {
    let policies = PolicyCache::default();
    let sweep = args.sweep(&policies)?;
    let cells = sweep.cells()?;
    // No further cell begins once it is set.
    let asked = signals::stop_flag();
    let outputs = Outputs::prepare(&plan(args, &sweep))?;
    let record = args.record.as_deref().map(Record::create).transpose()?;
    let bar = Bar::new(cells, theme(args.ascii).glyph("█▌░", "#>-"), args.json);
    let threads = args.threads.unwrap_or_else(all_cores);
    let swept = sweep.run_with(policies, threads, |_, _| {
        bar.advance();
        if asked.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    })?;
    bar.finish();
    print_results(args, &swept, outputs, record)?;
    match swept.finished().count() {
        done if done < cells => Err(Error::Stopped { done, cells }),
        _ => Ok(()),
    }
}

/// What `args` ask to be written, and what `sweep` reads.
fn plan<'a>(args: &'a SweepArgs, sweep: &'a Sweep) -> OutputPlan<'a> {
    OutputPlan {
        out: args.out.as_deref(),
        metrics: FILE,
        csv: args.csv.as_deref(),
        header: csv::HEADER,
        record: args.record.as_deref(),
        inputs: policy_files(sweep.policies.iter()),
    }
}

/// Writes the files that were asked for, and prints.
fn print_results(
    args: &SweepArgs,
    swept: &Swept,
    mut outputs: Outputs,
    record: Option<Record>,
) -> Result<(), Error> {
    let wanted = args.theory || record.is_some();
    let theory = Theory::of(swept.sweep(), wanted)?;
    let summary = SweepSummary::of(swept, &theory);
    if let Some(mut csv) = outputs.take_csv() {
        let file = csv.begin()?;
        csv.complete(csv::write(file, swept))?;
    }
    let json = json::text(&summary, swept, args.theory);
    outputs.write(&json)?;
    if args.json {
        print_line(&json)?;
    } else {
        print_line(&map::text(&summary, args.theory, &style(args)))?;
    }
    match record {
        Some(record) => record.write(&summary),
        None => Ok(()),
    }
}

/// How the map is drawn: in colour only where somebody sees it.
fn style(args: &SweepArgs) -> MapStyle {
    let mut theme = theme(args.ascii);
    let terminal = stdout().is_terminal();
    theme.colour &= terminal;
    let size = crossterm::terminal::size().ok().filter(|_| terminal);
    MapStyle {
        theme,
        width: size.map_or(80, |(columns, _)| usize::from(columns)),
    }
}
