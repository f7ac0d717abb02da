//! Learned policies: the actor of the course's PPO agent, from a file.
//!
//! Only the six tensors of the actor's mean are read; all others (the critic, the
//! deviation of exploration) are ignored.

mod checkpoint;
mod error;
mod mlp;
mod safetensors;
mod tensor;

use mlp::LARGEST_WIDTH;
pub use mlp::{Mlp, Network};

/// The signature of a zip's local header.
const ZIP: &[u8] = b"PK\x03\x04";

/// The first byte of a pickle of protocol 2 or later.
const PICKLE: u8 = 0x80;

/// Reads the weights from a PyTorch checkpoint or a safetensors file; the content
/// determines the format.
///
/// For any content, time is bounded, memory stays below 64 MB for files of up to
/// [`LARGEST_FILE`](super::LARGEST_FILE), and no code is run.
///
/// # Errors
/// The expected and the actual content, in a line.
pub fn read_weights(content: &[u8]) -> Result<Mlp, String> {
    if content.starts_with(ZIP) {
        checkpoint::Checkpoint::open(content)?.mlp()
    } else if content.first() == Some(&PICKLE) {
        let legacy = "expected a PyTorch checkpoint that is a zip, found a bare pickle, as PyTorch \
                      wrote before 1.6: load it there and save it again";
        Err(legacy.to_owned())
    } else {
        safetensors::read(content)
    }
}
