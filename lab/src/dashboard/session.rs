//! One experiment running on a thread of its own, as the dashboard holds it.

use std::{
    thread::JoinHandle,
    time::{Duration, Instant},
};

use crossbeam_channel::Sender;
use ratelab::{
    cartpole::ControlStep,
    experiment::{Config, Experiment, SetupError, Summary},
    runtime::{Command, Fault, Message, Observer, RealClock, Tap, clock::Realtime},
};

use super::app::LabError;

/// Control steps that may wait for the next frame: at full speed the virtual
/// clock makes some thousands in the time of one.
const BACKLOG: usize = 65_536;

/// A running experiment: commands go in, counters and control steps come out.
pub struct Session {
    config: Config,
    observer: Observer,
    commands: Sender<Command>,
    steps: Tap<ControlStep>,
    thread: Option<JoinHandle<Result<Summary, Fault>>>,
    summary: Option<Summary>,
    began: Instant,
}

impl Session {
    /// Starts an experiment.
    pub fn start(config: &Config, realtime: Option<Realtime>) -> Result<Self, SetupError> {
        Ok(Self::of(Experiment::new(config)?, config, realtime))
    }

    /// Starts `experiment`, which was made from `config`.
    pub fn of(experiment: Experiment, config: &Config, realtime: Option<Realtime>) -> Self {
        let observer = experiment.observer();
        let commands = experiment.commands();
        let steps = experiment.tap_steps(BACKLOG);
        let mut real = RealClock::new(realtime);
        let thread = std::thread::spawn(move || experiment.run(&mut real));
        Self {
            config: config.clone(),
            observer,
            commands,
            steps,
            thread: Some(thread),
            summary: None,
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
        self.steps.messages().try_iter()
    }

    /// Control steps that found the backlog full.
    pub fn lost(&self) -> u64 {
        self.steps.lost()
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
    /// [`LabError`] if a node failed or the clock panicked.
    pub fn finish(self) -> Result<Option<Summary>, LabError> {
        self.send(Command::Stop);
        // Virtual time waits for a full tap, and nobody will empty it any more.
        drop(self.steps);
        self.thread
            .map_or(Ok(self.summary), |thread| ended(thread).map(Some))
    }
}

/// What the run came to.
fn ended(thread: JoinHandle<Result<Summary, Fault>>) -> Result<Summary, LabError> {
    // Nodes' panics are faults already; this would be one of the clock.
    let ended = thread.join().map_err(|_| LabError::Panicked)?;
    Ok(ended?)
}
