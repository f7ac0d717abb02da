//! `ratelab run`: the graph without a dashboard.

use std::{
    fs::{self, File},
    io::{self, Write},
    path::{Path, PathBuf},
    sync::atomic::{AtomicBool, Ordering},
};

use crossbeam_channel::Sender;
use ratelab::{
    experiment::{Config, Experiment, Summary},
    runtime::{ClockKind, Command, RealClock, Speed, Time, clock::Realtime},
};
use tempfile::NamedTempFile;

use crate::{
    cli::RunArgs,
    csv,
    error::Error,
    metrics,
    options::{self, Usual},
    recording::{Destination, Ending, Recorded, Recorder, Source},
    report,
};

/// What an ordinary run is.
const USUAL: Usual = Usual {
    clock: ClockKind::Real,
    end: Time::from_nanos(10_000_000_000),
    speed: Speed::FlatOut,
};

/// Name of the file in `--out`.
const METRICS: &str = "metrics.json";

/// What is to be said of a run beside its summary.
#[derive(Default)]
pub struct Notes {
    /// `--break` was given.
    pub break_bug: bool,
    /// `--smoke` was given.
    pub smoke: bool,
    /// What became of `--realtime`; `None` if it was not given.
    pub realtime: Option<Result<(), String>>,
    /// Rows that the CSV writer lost.
    pub csv_lost: u64,
    /// Why it is not known how the run ended, if it is not.
    pub open: Option<String>,
}

/// Runs the graph as asked, prints and writes what it came to.
pub fn run(args: &RunArgs) -> Result<(), Error> {
    let config = options::config(args, &USUAL)?;
    let experiment = Experiment::new(&config)?;
    stop_on_signal(experiment.commands());
    let mut outputs = Outputs::prepare(args)?;
    let recorder = record(args, &experiment, &config)?;
    let realtime = options::realtime(&args.graph);
    let mut real = RealClock::new(realtime.clone().and_then(Result::ok));
    let csv = outputs.take_csv();
    let csv = csv.map(|(file, path)| (csv::Writer::start(file, &experiment), path));
    let outcome = experiment.run_with(&mut real);
    let recorded = recorder.map(|recorder| {
        recorder.end(Ending::of(&outcome));
        recorder.finish()
    });
    let csv_lost = csv.map_or(Ok(0), |(writer, path)| {
        writer.finish().map_err(|why| write_error(&path, why))
    });
    let told = outcome
        .map_err(Error::from)
        .and_then(|summary| outputs.tell(args, &summary, realtime, csv_lost?));
    let recorded = recorded.map_or(Ok(()), |recorded| tell_recorded(args.json, &recorded?));
    both(told, recorded)
}

/// One of two failures, and the other printed.
fn both(first: Result<(), Error>, second: Result<(), Error>) -> Result<(), Error> {
    if let (Err(error), Err(_)) = (&first, &second) {
        eprintln!("error: {error}");
    }
    second.and(first)
}

/// Begins to record, if that was asked for.
fn record(
    args: &RunArgs,
    experiment: &Experiment,
    config: &Config,
) -> Result<Option<Recorder>, Error> {
    let Some(file) = &args.record else {
        return Ok(None);
    };
    let source = Source::of(experiment, config);
    let begin = |path: &Path| Recorder::from_the_start(path, &source);
    let begun = Destination::new(file.clone()).claim(config, begin);
    let (_, recorder) = begun.map_err(|(path, why)| record_error(&path, &why))?;
    Ok(Some(recorder))
}

/// A recording that cannot begin.
pub fn record_error(path: &Path, why: &io::Error) -> Error {
    match why.kind() {
        io::ErrorKind::AlreadyExists if path.exists() => Error::BadInput(format!(
            "--record {}: there is such a file, and recordings overwrite none: \
             choose another name",
            path.display()
        )),
        _ => Error::unwritable("--record", path, why),
    }
}

/// Says where a recording went: beside metrics that are to be all there is, on
/// standard error.
pub fn tell_recorded(json: bool, recorded: &Recorded) -> Result<(), Error> {
    let line = report::recorded(recorded);
    if json {
        eprintln!("{line}");
        Ok(())
    } else {
        say(&line)
    }
}

/// The first Ctrl-C (or SIGTERM) ends the run in order, the second at once: a
/// node may be stuck.
fn stop_on_signal(commands: Sender<Command>) {
    let asked = AtomicBool::new(false);
    let installed = ctrlc::set_handler(move || {
        // A run that is over is being written down, which the first one lets be.
        let _ = commands.send(Command::Stop);
        if asked.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
    if let Err(error) = installed {
        eprintln!("note: Ctrl-C will end the run without a summary: {error}");
    }
}

/// Files that are opened before the run, so that a run is never made in vain.
pub struct Outputs {
    metrics: Option<(NamedTempFile, PathBuf)>,
    csv: Option<(File, PathBuf)>,
}

impl Outputs {
    /// Opens what is asked for; refuses, and leaves nothing behind, if it cannot.
    pub fn prepare(args: &RunArgs) -> Result<Self, Error> {
        Self::open(args.out.as_deref(), METRICS, args.csv.as_deref())
    }

    /// The same for metrics called `name` in the folder `out`, and rows in `csv`.
    pub fn open(out: Option<&Path>, name: &str, csv: Option<&Path>) -> Result<Self, Error> {
        let folders = out.into_iter().flat_map(Path::ancestors);
        let made: Vec<&Path> = folders.take_while(|folder| !folder.exists()).collect();
        let metrics = out
            .map(|folder| prepare_metrics(folder, name))
            .transpose()?;
        let csv = match csv {
            None => None,
            Some(path) => match File::create(path) {
                Ok(file) => Some((file, path.to_owned())),
                Err(why) => {
                    drop(metrics);
                    // Bad input leaves nothing behind, not even empty folders.
                    for folder in made {
                        let _ = fs::remove_dir(folder);
                    }
                    return Err(Error::unwritable("--csv", path, &why));
                }
            },
        };
        Ok(Self { metrics, csv })
    }

    /// Writes and prints what a run came to.
    pub fn tell(
        self,
        args: &RunArgs,
        summary: &Summary,
        realtime: Option<Result<Realtime, String>>,
        csv_lost: u64,
    ) -> Result<(), Error> {
        let notes = Notes {
            break_bug: args.graph.break_bug,
            smoke: args.smoke,
            realtime: realtime.map(|asked| asked.map(drop)),
            csv_lost,
            open: None,
        };
        let metrics = metrics::json(summary, &notes);
        self.write(&metrics)?;
        if args.json {
            say(&metrics)
        } else {
            say(&report::text(summary, &notes))
        }
    }

    /// The file for rows, once.
    pub fn take_csv(&mut self) -> Option<(File, PathBuf)> {
        self.csv.take()
    }

    /// Writes `metrics`, if there is a file for them.
    pub fn write(self, metrics: &str) -> Result<(), Error> {
        self.metrics
            .map_or(Ok(()), |(file, path)| write_metrics(file, &path, metrics))
    }
}

/// Makes the folder and a hidden file in it, which becomes the metrics when
/// they are complete.
fn prepare_metrics(folder: &Path, name: &str) -> Result<(NamedTempFile, PathBuf), Error> {
    fs::create_dir_all(folder)
        .and_then(|()| NamedTempFile::new_in(folder))
        .map(|file| (file, folder.join(name)))
        .map_err(|why| Error::unwritable("--out", folder, &why))
}

fn write_metrics(mut file: NamedTempFile, path: &Path, metrics: &str) -> Result<(), Error> {
    let written = writeln!(file, "{metrics}").and_then(|()| readable(file.as_file()));
    written
        .and_then(|()| file.persist(path).map(drop).map_err(|error| error.error))
        .map_err(|why| write_error(path, why))
}

/// Gives a file that was made for one user's eyes the rights of any other.
#[cfg(unix)]
fn readable(file: &File) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn readable(_: &File) -> io::Result<()> {
    Ok(())
}

fn write_error(path: &Path, why: io::Error) -> Error {
    let what = path.display().to_string();
    Error::Write { what, why }
}

/// Prints to standard output, which may have been closed by a reader that has
/// seen enough.
pub fn say(text: &str) -> Result<(), Error> {
    match writeln!(io::stdout(), "{text}") {
        Err(why) if why.kind() != io::ErrorKind::BrokenPipe => {
            let what = "to standard output".to_owned();
            Err(Error::Write { what, why })
        }
        _ => Ok(()),
    }
}
