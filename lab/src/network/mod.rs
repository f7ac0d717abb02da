//! Runs in several processes: `node`, `up`, and the dashboard over them.

mod gathered;
mod line;
mod node;
mod numbering;
mod parts;
mod recordings;
mod relay;
mod remote;
mod show;
mod stop;
mod up;

pub use node::node;
pub use show::{attached, show};
pub use up::up;

use ratelab_wire::WireError;

use crate::error::Error;

/// An error of the connection as one of a command.
fn wire_error(error: WireError) -> Error {
    match error {
        WireError::Setting(why) => Error::BadInput(why),
        WireError::Taken(why) | WireError::Network(why) => Error::Network(why),
    }
}
