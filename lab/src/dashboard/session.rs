//! One experiment running on a thread of its own, as the dashboard holds it.

use std::{
    path::PathBuf,
    thread::JoinHandle,
    time::{Duration, Instant},
};

use crossbeam_channel::Sender;
use ratelab::{
    cartpole::ControlStep,
    experiment::{Config, Experiment, Summary},
    runtime::{Command, Fault, Message, Observer, RealClock, Tap, Tapped, clock::Realtime},
};

use super::{error::LabError, sampler::Watched};
use crate::{
    csv,
    output::Live,
    recording::{Destination, Ending, Recorder, Source},
};

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
    /// Where sessions are recorded to, from the first one on.
    pub record: Option<Destination>,
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
    steps: Option<Tap<Tapped<ControlStep>>>,
    thread: Option<JoinHandle<Result<Summary, Fault>>>,
    summary: Option<Summary>,
    csv: Option<csv::Writer>,
    /// Gone when the session is to end.
    source: Option<Source>,
    recorder: Option<Recorder>,
    began: Instant,
}

impl Session {
    /// Starts an experiment; records it to a new file at `record`, if there is to
    /// be one.
    ///
    /// # Errors
    /// [`LabError`] if it cannot be set up, or a file that it is to be written to
    /// cannot be opened.
    pub fn start(
        config: &Config,
        setup: &Setup,
        record: Option<&mut Destination>,
    ) -> Result<Self, LabError> {
        let experiment = Experiment::new(config)?;
        let csv = setup.csv.as_deref().map(Live::open).transpose();
        let mut csv = csv.map_err(LabError::Csv)?;
        let source = Source::of(&experiment, config);
        let recorder = record.map(|record| {
            let begun = record.claim(config, |path| Recorder::from_the_start(path, &source));
            begun.map_err(|(path, why)| LabError::Record { path, why })
        });
        let recorder = recorder.transpose()?.map(|(_, recorder)| recorder);
        let csv = csv.as_mut().map(Live::begin).transpose();
        let csv = csv.map_err(LabError::Csv)?;
        let csv = csv.map(|file| csv::Writer::start(file, &experiment));
        let session = Self::begin(experiment, config, source, setup.realtime.clone());
        Ok(Self {
            csv,
            recorder,
            ..session
        })
    }

    /// Starts `experiment`, which was made from `config`.
    #[cfg(test)]
    pub fn of(experiment: Experiment, config: &Config, realtime: Option<Realtime>) -> Self {
        let source = Source::of(&experiment, config);
        Self::begin(experiment, config, source, realtime)
    }

    fn begin(
        experiment: Experiment,
        config: &Config,
        source: Source,
        realtime: Option<Realtime>,
    ) -> Self {
        let observer = experiment.observer();
        let commands = experiment.commands();
        let steps = Some(experiment.taps().steps(BACKLOG));
        let mut real = RealClock::new(realtime);
        let thread = std::thread::spawn(move || experiment.run_with(&mut real));
        Self {
            config: config.clone(),
            observer,
            commands,
            steps,
            thread: Some(thread),
            summary: None,
            csv: None,
            source: Some(source),
            recorder: None,
            began: Instant::now(),
        }
    }

    /// Gives a command; a run that is over ignores it.
    pub fn send(&self, command: Command) {
        let _ = self.commands.send(command);
    }

    /// Sees whether the run is over.
    ///
    /// # Errors
    /// [`LabError`] if a node failed or the clock panicked.
    pub fn poll(&mut self) -> Result<(), LabError> {
        match self.thread.take_if(|thread| thread.is_finished()) {
            Some(thread) => self.end(thread),
            None => Ok(()),
        }
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
        if let Some(thread) = self.thread.take() {
            self.end(thread)?;
        }
        let csv_lost = self.finish_csv()?;
        let summary = self.summary.take().ok_or(LabError::Panicked)?;
        Ok(Ended { summary, csv_lost })
    }

    /// Notes what the run came to, and tells the recorder.
    fn end(&mut self, thread: JoinHandle<Result<Summary, Fault>>) -> Result<(), LabError> {
        // Nodes' panics are faults already; this would be one of the clock.
        let outcome = thread.join().map_err(|_| LabError::Panicked)?;
        if let Some(recorder) = &self.recorder {
            recorder.end(Ending::of(&outcome));
        }
        match outcome {
            Ok(summary) => self.summary = Some(summary),
            Err(fault) => {
                self.finish_csv()?;
                return Err(fault.into());
            }
        }
        Ok(())
    }

    /// Waits until all rows are written; says how many were lost.
    fn finish_csv(&mut self) -> Result<u64, LabError> {
        // Its tap ends with the topic, which these hold.
        (self.source, self.steps) = (None, None);
        let lost = self.csv.take().map_or(Ok(0), csv::Writer::finish);
        lost.map_err(LabError::Csv)
    }

    /// Records from now on to a new file at `destination`; which that is.
    ///
    /// # Errors
    /// What the system says of the file.
    pub fn record(&mut self, destination: &mut Destination) -> Result<PathBuf, LabError> {
        let source = self.source.as_ref().ok_or(LabError::Panicked)?;
        let begun = destination.claim(&self.config, |path| Recorder::midway(path, source));
        let (path, recorder) = begun.map_err(|(path, why)| LabError::Record { path, why })?;
        self.recorder = Some(recorder);
        Ok(path)
    }

    /// The recording that is being made.
    pub fn recorder(&self) -> Option<&Recorder> {
        self.recorder.as_ref()
    }

    /// The recorder, if it is on its way to its end, or was told to be.
    pub fn take_recorder(&mut self) -> Option<Recorder> {
        self.recorder.take_if(|recorder| recorder.is_ending())
    }
}

impl Watched for Session {
    fn config(&self) -> &Config {
        &self.config
    }

    fn observer(&self) -> &Observer {
        &self.observer
    }

    fn wall_time(&self) -> Duration {
        let taken = self.summary.as_ref().map(|summary| summary.wall_time);
        taken.unwrap_or_else(|| self.began.elapsed())
    }

    fn new_steps(&mut self) -> Vec<Message<ControlStep>> {
        let taps = self.steps.iter();
        let tapped = taps.flat_map(|tap| tap.items().try_iter());
        tapped.map(|tapped| tapped.message).collect()
    }

    fn lost(&self) -> u64 {
        self.steps.as_ref().map_or(0, Tap::lost)
    }

    fn summary(&self) -> Option<&Summary> {
        self.summary.as_ref()
    }
}
