//! Learned policies: the actor of the course's PPO agent, from a file.
//!
//! Only the six tensors of the actor's mean are read. The critic and the deviation of exploration
//! are ignored; anything else that could change the action ends the load ([`state`]).

mod checkpoint;
mod error;
mod mlp;
mod policy;
mod safetensors;
mod state;
mod tensor;

use crate::{WeightsError, format::FileFormat};
use mlp::LARGEST_WIDTH;
pub use mlp::Mlp;
pub(crate) use policy::Network;

/// Reads the weights from a PyTorch checkpoint or a safetensors file; the content
/// determines the format.
///
/// For any content, time is bounded, memory stays below 64 MB for files of up to
/// [`LARGEST_FILE`](super::LARGEST_FILE), and no code is run.
///
/// # Errors
/// The expected and the actual content, in a line.
pub fn read_weights(content: &[u8]) -> Result<Mlp, WeightsError> {
    match FileFormat::detect(content) {
        FileFormat::Zip => checkpoint::Checkpoint::open(content)?.mlp(),
        FileFormat::Pickle => Err(checkpoint::bare_pickle(content)),
        FileFormat::LfsPointer => Err(WeightsError::Damaged(
            "expected a file of weights, found what Git LFS leaves in its place: git lfs pull \
             fetches the file"
                .to_owned(),
        )),
        FileFormat::Other(name) => Err(WeightsError::Unfit {
            why: format!("expected a PyTorch checkpoint (.pt), safetensors or ONNX, found {name}"),
            program: None,
        }),
        _ => safetensors::read(content),
    }
}
