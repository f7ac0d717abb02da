//! Learned policies: a chain of linear layers, from a file.
//!
//! Only the layers of the policy are read ([`chain`]). The critic and the deviation of exploration
//! are ignored; anything else that could change the action ends the load ([`state`]).

mod activation;
mod chain;
mod checkpoint;
mod error;
mod mlp;
mod normaliser;
mod policy;
mod safetensors;
mod sb3;
mod state;
mod state_item;
mod tensor;

use crate::{WeightsError, format::FileFormat};
pub use activation::Activation;
use mlp::LARGEST_WIDTH;
pub use mlp::Mlp;
pub(crate) use policy::Network;
use state::NetworkSettings;

/// Reads the weights from a PyTorch checkpoint or a safetensors file; the content
/// determines the format.
///
/// For any content, time is bounded, memory stays below 64 MB for files of up to
/// [`LARGEST_FILE`](super::LARGEST_FILE), and no code is run.
///
/// # Errors
/// The expected and the actual content, in a line.
pub fn read_weights(content: &[u8]) -> Result<Mlp, WeightsError> {
    read_with(content, None)
}

/// Reads the weights of a network with another `activation` than its file names, if one is given.
pub(crate) fn read_with(
    content: &[u8],
    activation: Option<Activation>,
) -> Result<Mlp, WeightsError> {
    let settings = NetworkSettings {
        activation,
        is_in_model: false,
    };
    match FileFormat::detect(content) {
        FileFormat::Zip => match sb3::read(content, settings) {
            Some(read) => read,
            None => checkpoint::Checkpoint::open(content)?.mlp(settings),
        },
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
        _ => safetensors::read(content, settings),
    }
}
