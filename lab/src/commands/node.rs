//! `ratelab node`: some nodes of a graph, in a process of their own.

use crate::{cli::NodeArgs, error::Error, program::Program};

/// Runs the nodes until the run ends; the process with the plant prints its summary.
#[cfg(feature = "network")]
pub fn node(program: &Program, args: &NodeArgs) -> Result<(), Error> {
    crate::network::node(program, args)
}

/// Prints how to get it.
#[cfg(not(feature = "network"))]
pub fn node(_: &Program, _: &NodeArgs) -> Result<(), Error> {
    Err(Error::without_network("node"))
}
