//! One experiment running on a thread of its own, as the dashboard holds it.

use std::{
    fs::File,
    path::PathBuf,
    thread::JoinHandle,
    time::{Duration, Instant},
};

use crossbeam_channel::Sender;
use ratelab::{
    cartpole::ControlStep,
    experiment::{Config, Experiment, Summary},
    runtime::{Command, Fault, Message, Observer, RealClock, Tap, clock::Realtime},
};

use super::app::LabError;
use crate::csv;

/// Control steps that may wait for the next frame: at full speed the virtual
/// clock makes some thousands in the time of one.
const BACKLOG: usize = 65_536;

/// What every session is started with.
#[derive(Clone, Debug, Default)]
pub struct Setup {
    /// Priority of the node threads, if it was granted.
    pub realtime: Option<Realtime>,
    /// Where control steps are written, those of the last session.
    pub csv: Option<PathBuf>,
}

/// What a session came to.
#[derive(Debug)]
pub struct Ended {
    /// Its summary.
    pub summary: Summary,
    /// Rows that the CSV writer lost.
    pub csv_lost: u64,
}

/// A running experiment: commands go in, counters and control steps come out.
pub struct Session {
    config: Config,
    observer: Observer,
    commands: Sender<Command>,
    /// Gone when the session is to end.
    steps: Option<Tap<ControlStep>>,
    thread: Option<JoinHandle<Result<Summary, Fault>>>,
    summary: Option<Summary>,
    csv: Option<csv::Writer>,
    began: Instant,
}

impl Session {
    /// Starts an experiment.
    ///
    /// # Errors
    /// [`LabError`] if it cannot be set up, or the file for its control steps
    /// cannot be opened.
    pub fn start(config: &Config, setup: &Setup) -> Result<Self, LabError> {
        let experiment = Experiment::new(config)?;
        let csv = setup.csv.as_ref().map(File::create).transpose();
        let csv = csv.map_err(LabError::Csv)?;
        let csv = csv.map(|file| csv::Writer::start(file, &experiment));
        let session = Self::of(experiment, config, setup.realtime.clone());
        Ok(Self { csv, ..session })
    }

    /// Starts `experiment`, which was made from `config`.
    pub fn of(experiment: Experiment, config: &Config, realtime: Option<Realtime>) -> Self {
        let observer = experiment.observer();
        let commands = experiment.commands();
        let steps = Some(experiment.tap_steps(BACKLOG));
        let mut real = RealClock::new(realtime);
        let thread = std::thread::spawn(move || experiment.run(&mut real));
        Self {
            config: config.clone(),
            observer,
            commands,
            steps,
            thread: Some(thread),
            summary: None,
            csv: None,
            began: Instant::now(),
        }
    }

    /// What the run was started with.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// Reads the graph.
    pub fn observer(&self) -> &Observer {
        &self.observer
    }

    /// Wall time since it was started, or that it took.
    pub fn wall_time(&self) -> Duration {
        let taken = self.summary.as_ref().map(|summary| summary.wall_time);
        taken.unwrap_or_else(|| self.began.elapsed())
    }

    /// Gives a command; a run that is over ignores it.
    pub fn send(&self, command: Command) {
        let _ = self.commands.send(command);
    }

    /// The control steps since the last call.
    pub fn new_steps(&self) -> impl Iterator<Item = Message<ControlStep>> {
        let taps = self.steps.iter();
        taps.flat_map(|tap| tap.messages().try_iter())
    }

    /// Control steps that found the backlog full.
    pub fn lost(&self) -> u64 {
        self.steps.as_ref().map_or(0, Tap::lost)
    }

    /// What the run came to, if it is over.
    pub fn summary(&self) -> Option<&Summary> {
        self.summary.as_ref()
    }

    /// Sees whether the run is over.
    ///
    /// # Errors
    /// [`LabError`] if a node failed or the clock panicked.
    pub fn poll(&mut self) -> Result<(), LabError> {
        if let Some(thread) = self.thread.take_if(|thread| thread.is_finished()) {
            self.summary = Some(ended(thread)?);
        }
        Ok(())
    }

    /// Stops the run and waits for its end.
    ///
    /// # Errors
    /// [`LabError`] if a node failed, the clock panicked, or control steps could
    /// not be written.
    pub fn finish(&mut self) -> Result<Ended, LabError> {
        self.send(Command::Stop);
        // Virtual time waits for a full tap, and nobody will empty it any more.
        self.steps = None;
        let summary = match self.thread.take() {
            Some(thread) => ended(thread)?,
            None => self.summary.take().ok_or(LabError::Panicked)?,
        };
        let csv_lost = self.csv.take().map_or(Ok(0), csv::Writer::finish);
        let csv_lost = csv_lost.map_err(LabError::Csv)?;
        Ok(Ended { summary, csv_lost })
    }
}

/// What the run came to.
fn ended(thread: JoinHandle<Result<Summary, Fault>>) -> Result<Summary, LabError> {
    // Nodes' panics are faults already; this would be one of the clock.
    let ended = thread.join().map_err(|_| LabError::Panicked)?;
    Ok(ended?)
}
