//! One experiment on a thread of its own, with its handles for the dashboard.

use std::{
    io::{self, Write},
    iter,
    path::PathBuf,
    sync::Arc,
    time::{Duration, Instant},
};

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded};
use ratelab::{Clock, Command, Fault, Knob};
use ratelab_experiment::{Config, Experiment, StepWriter, Summary};
use ratelab_metrics::{Lineage, Observer};
use ratelab_re_execution::RunLog;
use ratelab_real_clock::{RealClock, RealtimePriority};
use ratelab_recording::{Branch, Destination, Recorder, Recording, Source, StopReason};
use ratelab_system::System;

use super::{
    lineage_taps::LineageTaps,
    run::{RunDigest, RunSource, StatusExtra, WatchedRows},
};
use crate::{course::Course, error::ScreenError};

/// Opens a file for rows without changing it, so that no session begins in vain.
pub type OpenRows = Arc<dyn Fn() -> io::Result<BeginRows>>;

/// Empties the file when its session begins. A new file is removed if none does.
pub type BeginRows = Box<dyn FnOnce() -> io::Result<Box<dyn Write + Send>>>;

/// The settings of every session.
#[derive(Clone)]
pub struct SessionSetup {
    /// The system.
    pub system: Arc<dyn System>,
    /// The course, if its exercises apply to this system.
    pub course: Option<Arc<dyn Course>>,
    /// Whether the limits of the push age are hidden, because a learner is to find them.
    pub hides_limits: bool,
    /// Priority of the node threads, if it was granted.
    pub realtime: Option<RealtimePriority>,
    /// Opens the file for the plant's steps; it keeps the steps of the last session.
    pub csv: Option<OpenRows>,
    /// Destination of recordings, from the first session on.
    pub record: Option<Destination>,
}

impl SessionSetup {
    /// Creates sessions of `system` without priorities and files; with a `course`, if its
    /// exercises apply.
    pub fn new(system: Arc<dyn System>, course: Option<Arc<dyn Course>>) -> Self {
        Self {
            system,
            course,
            hides_limits: false,
            realtime: None,
            csv: None,
            record: None,
        }
    }
}

/// The result of a session.
#[derive(Debug)]
pub struct SessionResult {
    /// Its summary.
    pub summary: Summary,
    /// Rows that the CSV writer lost.
    pub csv_lost: u64,
}

/// An experiment ready to begin. No file is changed before it begins.
pub struct Prepared {
    experiment: Experiment,
    source: Source,
    csv: Option<BeginRows>,
    /// The clock while it is under the real one.
    real: Box<dyn Clock + Send>,
}

impl Prepared {
    /// Prepares an experiment.
    ///
    /// # Errors
    /// [`ScreenError`] if the setup fails, or the file of rows cannot be opened.
    pub fn new(config: &Config, setup: &SessionSetup) -> Result<Self, ScreenError> {
        let mut experiment = Experiment::new(setup.system.clone(), config)?;
        let real = RealClock::new(setup.realtime.clone());
        experiment.check_clock(&real)?;
        Self::with_clock(experiment, Box::new(real), setup)
    }

    /// Prepares a branch of a recorded run.
    ///
    /// # Errors
    /// [`ScreenError`] if the file of rows cannot be opened.
    pub fn for_branch(branch: Branch, setup: &SessionSetup) -> Result<Self, ScreenError> {
        Self::with_clock(branch.experiment, Box::new(branch.clock), setup)
    }

    fn with_clock(
        experiment: Experiment,
        real: Box<dyn Clock + Send>,
        setup: &SessionSetup,
    ) -> Result<Self, ScreenError> {
        // The previous session may still be writing to it.
        let csv = setup.csv.as_ref().map(|open| open()).transpose();
        Ok(Self {
            source: Source::for_experiment(&experiment),
            experiment,
            csv: csv.map_err(ScreenError::Csv)?,
            real,
        })
    }

    /// Creates a recorder from the first tick on, to a new file at `destination`.
    ///
    /// # Errors
    /// [`ScreenError::Record`] with the system's error for the file.
    pub fn record(&self, destination: &mut Destination) -> Result<Recorder, ScreenError> {
        Recorder::from_the_start(destination, &self.source).map_err(ScreenError::Record)
    }

    /// Starts the experiment, with its recorder if any.
    pub fn begin(self, recorder: Option<Recorder>) -> Session {
        let (experiment, mut real) = (self.experiment, self.real);
        let csv = self
            .csv
            .map(|begin| StepWriter::start(begin(), &experiment));
        let (system, config) = (experiment.system().clone(), experiment.config().clone());
        let (observer, commands) = (experiment.observer(), experiment.commands());
        let taps = LineageTaps::new(&experiment);
        let (sender, outcome) = bounded(1);
        std::thread::spawn(move || {
            // The dashboard may be gone.
            let _ = sender.send(experiment.run_with(&mut *real));
        });
        Session {
            system,
            config,
            observer,
            commands,
            taps,
            outcome: Some(outcome),
            summary: None,
            csv,
            source: Some(self.source),
            recorder,
            outside: 0,
            began: Instant::now(),
        }
    }
}

/// A running experiment: commands in, counters and messages out.
pub struct Session {
    system: Arc<dyn System>,
    config: Config,
    observer: Observer,
    commands: Sender<Command>,
    /// Its messages and the chains behind its actions, until it is to end.
    taps: LineageTaps,
    /// Receiver of the result; `None` after it has arrived.
    outcome: Option<Receiver<Result<Summary, Fault>>>,
    summary: Option<Summary>,
    csv: Option<StepWriter>,
    /// `None` when the session is to end.
    source: Option<Source>,
    /// Its current recorder.
    pub recorder: Option<Recorder>,
    /// Number of writes from outside of the graph that were returned.
    outside: usize,
    began: Instant,
}

impl Session {
    /// Sends a command, and what follows from it for other nodes; ignored after the end of the
    /// run.
    pub fn send(&self, command: Command) {
        let followers: Vec<Knob> = match &command {
            Command::Set(knob) => self.system().about().followers(knob).collect(),
            _ => Vec::new(),
        };
        for command in iter::once(command).chain(followers.into_iter().map(Command::Set)) {
            let _ = self.commands.send(command);
        }
    }

    /// Returns what threads outside of the graph wrote to since the last call.
    pub fn written_from_outside(&mut self) -> Vec<Arc<str>> {
        let mut names = RunLog::attach(&self.observer).written_from_outside();
        let new = names.split_off(self.outside);
        self.outside += new.len();
        new
    }

    /// Waits at most `patience` for the end of the run; returns whether it has ended.
    ///
    /// # Errors
    /// [`ScreenError`] if a node failed or the clock panicked.
    pub fn wait(&mut self, patience: Duration) -> Result<bool, ScreenError> {
        let Some(outcome) = &self.outcome else {
            return Ok(true);
        };
        match outcome.recv_timeout(patience) {
            Ok(outcome) => self.end(outcome).map(|()| true),
            Err(RecvTimeoutError::Timeout) => Ok(false),
            // Panics of nodes are faults already; this is a panic of the clock.
            Err(RecvTimeoutError::Disconnected) => Err(ScreenError::Panicked),
        }
    }

    /// Stops the run as soon as no node is in a tick.
    pub fn stop(&mut self) {
        self.send(Command::Stop);
        // Virtual time waits for a full tap, and nothing empties it any more.
        self.taps.let_go();
    }

    /// Returns the nodes in a tick, for which the end of the run waits, in a sentence.
    pub fn busy(&self) -> String {
        let busy = self
            .observer
            .snapshot()
            .nodes
            .into_iter()
            .filter(|node| node.busy)
            .map(|node| node.name);
        match &busy.collect::<Vec<_>>()[..] {
            [] => "a node".to_owned(),
            names => names.join(" and "),
        }
    }

    /// Stops the run and waits for its end.
    ///
    /// # Errors
    /// [`ScreenError`] if a node failed, the clock panicked, or rows could not be written.
    pub fn finish(&mut self) -> Result<SessionResult, ScreenError> {
        self.stop();
        if let Some(outcome) = &self.outcome {
            self.end(outcome.recv().map_err(|_| ScreenError::Panicked)?)?;
        }
        let csv_lost = self.finish_csv()?;
        let summary = self.summary.take().ok_or(ScreenError::Panicked)?;
        Ok(SessionResult { summary, csv_lost })
    }

    /// Abandons a run that does not end; its recording is completed.
    pub fn abandon(&mut self) -> ScreenError {
        let stuck = ScreenError::Stuck(self.busy());
        if let Some(recorder) = &self.recorder {
            recorder.end(StopReason::Fault(stuck.to_string()));
        }
        stuck
    }

    /// Stores the result of the run, and ends the recorder.
    fn end(&mut self, outcome: Result<Summary, Fault>) -> Result<(), ScreenError> {
        self.outcome = None;
        if let Some(recorder) = &self.recorder {
            recorder.end(StopReason::from_outcome(&outcome));
        }
        match outcome {
            Ok(summary) => self.summary = Some(summary),
            Err(fault) => {
                // The fault has priority over rows that cannot be written.
                let _ = self.finish_csv();
                return Err(fault.into());
            }
        }
        Ok(())
    }

    /// Waits until all rows are written; returns the number of lost ones.
    fn finish_csv(&mut self) -> Result<u64, ScreenError> {
        // Its tap ends with the topic, held by this.
        self.source = None;
        let lost = self.csv.take().map_or(Ok(0), StepWriter::finish);
        lost.map_err(ScreenError::Csv)
    }

    /// Starts a recording to a new file at `destination`; returns its path.
    ///
    /// # Errors
    /// The system's error for the file.
    pub fn record(&mut self, destination: &mut Destination) -> Result<PathBuf, ScreenError> {
        let source = self.source.as_ref().ok_or(ScreenError::Panicked)?;
        let recorder = Recorder::midway(destination, source).map_err(ScreenError::Record)?;
        Ok(self.recorder.insert(recorder).path().to_owned())
    }

    /// Returns the run so far, to be executed again; `None` at its end.
    pub fn so_far(&self) -> Option<Recording> {
        let end = match &self.summary {
            Some(summary) => StopReason::Run(Box::new(summary.clone())),
            None => StopReason::Off,
        };
        let source = self.source.as_ref()?;
        Some(source.so_far(&end))
    }
}

impl RunSource for Session {
    fn shared_system(&self) -> &Arc<dyn System> {
        &self.system
    }

    fn config(&self) -> &Config {
        &self.config
    }

    fn observer(&self) -> &Observer {
        &self.observer
    }

    fn wall_time(&self) -> Duration {
        self.summary
            .as_ref()
            .map(|summary| summary.wall_time)
            .unwrap_or_else(|| self.began.elapsed())
    }

    fn new_rows(&mut self) -> Vec<WatchedRows> {
        self.taps.new_rows()
    }

    fn lineage(&self) -> &Lineage {
        &self.taps.lineage
    }

    fn update_lineage(&mut self) {
        self.taps.update();
    }

    fn digest(&self) -> Option<&RunDigest> {
        Some(&self.taps.digest)
    }

    fn lost(&self) -> u64 {
        self.taps.lost()
    }

    fn summary(&self) -> Option<&Summary> {
        self.summary.as_ref()
    }

    fn status(&self) -> StatusExtra {
        StatusExtra {
            ended: self.summary.is_some(),
            recording: self.recorder.as_ref().map(Recorder::lost),
            ..StatusExtra::default()
        }
    }
}
