//! The dashboard over a run of other processes.

use std::{path::PathBuf, sync::Arc};

use ratelab::experiment::{Config, Experiment};
use ratelab_wire::{End, Follower, Settings};

use super::{remote::RemoteRun, wire_error};
use crate::{
    dashboard::{self, Options},
    error::Error,
    output::note,
    program::Program,
};

/// The connection of a dashboard to the process that listens at `address`.
pub fn attached(address: &str, file: Option<PathBuf>) -> Settings {
    Settings {
        end: End::Connect(vec![address.to_owned()]),
        insecure: false,
        file,
    }
}

/// Opens the dashboard until the person leaves. The run goes on.
pub fn show(program: &Program, settings: Settings, options: &Options) -> Result<(), Error> {
    settings.check().map_err(wire_error)?;
    if let End::Connect(addresses) = &settings.end {
        note(&format!("connecting to {}", addresses.join(", ")));
    }
    let experiment = Experiment::new(Arc::clone(&program.system), &Config::default())?;
    let follower = Follower::connect(&settings, program.system.name()).map_err(wire_error)?;
    let run = RemoteRun::new(follower, &experiment);
    drop(experiment);
    dashboard::watch(run, options).map_err(Error::from)
}
