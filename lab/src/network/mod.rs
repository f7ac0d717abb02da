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

use ratelab_network::NetworkError;

use crate::error::Error;

impl From<NetworkError> for Error {
    fn from(error: NetworkError) -> Self {
        match error {
            NetworkError::Setting(why) => Self::BadInput(why),
            NetworkError::Taken(why) | NetworkError::Network(why) => Self::Network(why),
        }
    }
}
