//! Policies that were learned: the actor of the course's PPO agent, from a file.
//!
//! Of a file only the six tensors of the actor's mean are read; whatever else
//! it holds (the critic, the deviation of exploration) is left alone.

mod checkpoint;
mod error;
mod mlp;
mod safetensors;
mod tensor;

pub use error::WeightsError;
pub use mlp::{LARGEST_WIDTH, Mlp, Network};

/// The signature of a zip's local header.
const ZIP: &[u8] = b"PK\x03\x04";

/// The first byte of a pickle of protocol 2 or later.
const PICKLE: u8 = 0x80;

/// The weights in the content of a PyTorch checkpoint or of a safetensors file;
/// which of the two it is, is seen from the content.
///
/// Whatever the content, this ends soon, takes less than 64 MB for files of up
/// to [`LARGEST_FILE`](super::LARGEST_FILE), and runs no code.
///
/// # Errors
/// [`WeightsError`] names what was expected and what was found.
pub fn read_weights(content: &[u8]) -> Result<Mlp, WeightsError> {
    if content.starts_with(ZIP) {
        checkpoint::Checkpoint::open(content)?.mlp()
    } else if content.first() == Some(&PICKLE) {
        Err(WeightsError::Legacy)
    } else {
        safetensors::read(content)
    }
}
