//! Runs in several processes: `node`, `up`, and the dashboard over them.

mod again;
mod line;
mod node;
mod parts;
mod recordings;
mod remote;
mod show;
mod stop;
mod up;

pub use node::node;
pub use show::{attached, show};
pub use up::up;

use ratelab_wire::WireError;

use crate::error::Error;

impl From<WireError> for Error {
    fn from(error: WireError) -> Self {
        match error {
            WireError::Setting(why) => Self::BadInput(why),
            WireError::Taken(why) | WireError::Network(why) => Self::Network(why),
        }
    }
}
