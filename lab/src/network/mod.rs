//! Runs in several processes: `node`, `up`, and the dashboard over them.

mod again;
mod node;
mod up;

use std::{
    path::PathBuf,
    sync::{Arc, Mutex},
    time::Duration,
};

use ratelab::sync::lock;
use ratelab_experiment::{Config, Experiment, Summary};
use ratelab_network::{Follower, NetworkError, Recordings, RemoteRun, SessionEnd, Settings, USUAL};
use ratelab_recording::{Destination, FinishedRecording, RecordError};
use ratelab_screen::Options;

use crate::{
    error::Error,
    output::{note, record_error},
    program::Program,
};

pub use node::node;
pub use up::up;

impl From<NetworkError> for Error {
    fn from(error: NetworkError) -> Self {
        match error {
            NetworkError::Setting(why) => Self::BadInput(why),
            NetworkError::Taken(why) | NetworkError::Network(why) => Self::Network(why),
        }
    }
}

/// Returns the connection of a dashboard to the process that listens at `address`.
pub fn attached(address: &str, file: Option<PathBuf>, wait: Option<Duration>) -> Settings {
    let end = SessionEnd::Connect(vec![address.to_owned()]);
    Settings {
        file,
        wait,
        ..Settings::new(end, note)
    }
}

/// Returns the address of the process that listens.
fn address(settings: &Settings) -> &str {
    let (SessionEnd::Connect(addresses) | SessionEnd::Listen(addresses)) = &settings.end;
    addresses.first().map_or(USUAL, String::as_str)
}

/// What a dashboard leaves.
pub struct SeenRuns {
    /// The summary of the last run, and whether that run ended.
    pub last: Option<(Summary, bool)>,
    /// The recordings.
    pub recorded: Vec<Result<FinishedRecording, RecordError>>,
}

/// Opens the dashboard until the person leaves; the run goes on. Records what it shows to
/// `destination`, if there is one.
pub fn show(
    program: &Program,
    settings: Settings,
    destination: Option<Destination>,
    options: &Options,
) -> Result<SeenRuns, Error> {
    let experiment = Experiment::new(Arc::clone(&program.system), &Config::default())?;
    let follower = Follower::connect(&settings, program.system.name())?;
    let recordings = Arc::new(Mutex::new(Recordings::new(destination)));
    let commands = again::CommandLines::new(address(&settings), program.built_in.name());
    let run = RemoteRun::new(
        follower,
        &experiment,
        recordings.clone(),
        Box::new(commands),
    );
    drop(experiment);
    let left = ratelab_screen::watch(run, options).map_err(Error::from);
    let mut recordings = lock(&recordings);
    let recorded = recordings.finish().map_err(record_error)?;
    left.map(|()| SeenRuns {
        last: recordings.last.take(),
        recorded,
    })
}
