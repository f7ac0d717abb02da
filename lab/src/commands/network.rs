//! `ratelab node` and `ratelab up`: some nodes of a graph in a process of their own, and all of
//! them in several processes of this machine.

#[cfg(feature = "network")]
pub use crate::network::{node, up};
#[cfg(not(feature = "network"))]
pub use without::{node, up};

/// How to get them.
#[cfg(not(feature = "network"))]
mod without {
    use crate::{
        cli::{NodeArgs, UpArgs},
        error::Error,
        program::Program,
    };

    /// Prints how to get it.
    pub fn node(_: &Program, _: &NodeArgs) -> Result<(), Error> {
        Err(Error::without_network("node"))
    }

    /// Prints how to get it.
    pub fn up(_: &Program, _: &UpArgs) -> Result<(), Error> {
        Err(Error::without_network("up"))
    }
}
