//! `ratelab up`: a graph in several processes of this machine.

use crate::{cli::UpArgs, error::Error, program::Program};

/// Runs the parts of the graph as processes, with the dashboard over all of them.
#[cfg(feature = "network")]
pub fn up(program: &Program, args: &UpArgs) -> Result<(), Error> {
    crate::network::up(program, args)
}

/// Prints how to get it.
#[cfg(not(feature = "network"))]
pub fn up(_: &Program, _: &UpArgs) -> Result<(), Error> {
    Err(Error::without_network("up"))
}
