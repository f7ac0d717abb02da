//! `ratelab sweep`: many runs at once, and how often the pole stayed up.
//!
//! ```text
//! options ──► Sweep ──► cells on all cores ──► survey ──► map, JSON, .rrd
//!                                        └──────────────► CSV
//! ```

mod cliff;
mod csv;
mod json;
mod map;
mod options;
mod progress;
mod record;
pub mod shade;
mod survey;
mod theory;

use std::{
    io::{IsTerminal, stdout},
    ops::ControlFlow,
    path::PathBuf,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use ratelab::experiment::sweep::{Swept, all_cores};

use crate::{
    cli::SweepArgs,
    error::Error,
    lab::theme,
    run::{Outputs, say},
};
use progress::Bar;
use record::Record;
use survey::Survey;
use theory::Theory;

/// Name of the file in `--out`.
const FILE: &str = "sweep.json";

/// Runs every cell, prints and writes what came of them. Ctrl-C keeps what is
/// done.
pub fn sweep(args: &SweepArgs) -> Result<(), Error> {
    let sweep = args.sweep()?;
    let cells = sweep.cells()?;
    let asked = stop_on_signal();
    let outputs = Outputs::open(args.out.as_deref(), FILE, args.csv.as_deref())?;
    let record = args.record.as_deref().map(Record::create).transpose()?;
    let bar = Bar::new(cells, theme(args.ascii).glyph("█▌░", "#>-"), args.json);
    let swept = sweep.run(args.threads.unwrap_or_else(all_cores), |_, _| {
        bar.advance();
        if asked.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    })?;
    bar.finish();
    tell(args, &swept, outputs, record)?;
    match swept.finished().count() {
        done if done < cells => Err(Error::Stopped { done, cells }),
        _ => Ok(()),
    }
}

/// Writes the files that were asked for, and prints.
fn tell(
    args: &SweepArgs,
    swept: &Swept,
    mut outputs: Outputs,
    record: Option<Record>,
) -> Result<(), Error> {
    let wanted = args.theory || record.is_some();
    let theory = Theory::of(swept.sweep(), wanted)?;
    let survey = Survey::of(swept, &theory);
    if let Some((file, path)) = outputs.take_csv() {
        csv::write(file, swept).map_err(|why| write_error(path, why))?;
    }
    let json = json::text(&survey, swept, args.theory);
    outputs.write(&json)?;
    if args.json {
        say(&json)?;
    } else {
        say(&map::text(&survey, args.theory, &picture(args)))?;
    }
    match record {
        Some(record) => record.write(&survey),
        None => Ok(()),
    }
}

/// How the map is drawn: in colour only where somebody sees it.
fn picture(args: &SweepArgs) -> map::Picture {
    let mut theme = theme(args.ascii);
    let terminal = stdout().is_terminal();
    theme.colour &= terminal;
    let size = crossterm::terminal::size().ok().filter(|_| terminal);
    map::Picture {
        theme,
        width: size.map_or(80, |(columns, _)| usize::from(columns)),
    }
}

fn write_error(path: PathBuf, why: std::io::Error) -> Error {
    let what = path.display().to_string();
    Error::Write { what, why }
}

/// The first Ctrl-C (or SIGTERM) has no further cell begin, the second ends at
/// once: a cell may be long.
fn stop_on_signal() -> Arc<AtomicBool> {
    let asked = Arc::new(AtomicBool::new(false));
    let stop = asked.clone();
    let installed = ctrlc::set_handler(move || {
        if stop.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
    if let Err(error) = installed {
        eprintln!("note: Ctrl-C will end the sweep without a result: {error}");
    }
    asked
}
