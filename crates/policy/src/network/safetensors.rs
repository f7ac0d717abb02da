//! Weights from a safetensors file.

use safetensors::{Dtype, SafeTensors, tensor::TensorView};

use super::{
    Mlp, error,
    state::{NetworkSettings, StateItems},
    state_item::{StateItem, StateKind},
    tensor::{Float, Tensor, checked_count},
};
use crate::WeightsError;

/// The longest header accepted (bytes): enough for one or two thousand tensors.
const LONGEST_HEADER: u64 = 1 << 18;

/// Reads the actor from a safetensors file.
pub(super) fn read(content: &[u8], settings: NetworkSettings) -> Result<Mlp, WeightsError> {
    check_header(content)?;
    let invalid = |why: safetensors::SafeTensorError| {
        no_format(&format!(
            "as safetensors, {}",
            why.to_string().escape_debug()
        ))
    };
    let file = SafeTensors::deserialize(content).map_err(invalid)?;
    let (_, header) = SafeTensors::read_metadata(content).map_err(invalid)?;
    let tensors = file.names().into_iter().filter_map(|name| {
        let shape = &header.info(name)?.shape;
        let kind = StateKind::Tensor(shape);
        Some(StateItem { name, kind })
    });
    let notes = header.metadata().iter().flatten().map(|(name, text)| {
        let kind = StateKind::Text(text);
        StateItem { name, kind }
    });
    let items = StateItems::new(tensors.chain(notes).collect(), None);
    items.network(settings, |name| match file.tensor(name) {
        Ok(view) => tensor(name, &view),
        Err(_) => Err(items.missing(name)),
    })
}

fn no_format(why: &str) -> WeightsError {
    WeightsError::Damaged(format!(
        "expected a PyTorch checkpoint (.pt), safetensors or ONNX, found none of them: {why}"
    ))
}

/// Checks the length of the header: as JSON it takes many times its length in memory.
fn check_header(content: &[u8]) -> Result<(), WeightsError> {
    let refuse = |why: String| Err(no_format(&why));
    let Some((length, header)) = content.split_first_chunk() else {
        return refuse(format!("{} bytes are all there is", content.len()));
    };
    let length = u64::from_le_bytes(*length);
    if header.first() != Some(&b'{') {
        refuse("it begins like none".to_owned())
    } else if length > LONGEST_HEADER {
        refuse(format!(
            "as safetensors its header has {length} bytes, more than {LONGEST_HEADER}"
        ))
    } else {
        Ok(())
    }
}

/// Reads the tensor called `name`.
fn tensor(name: &str, view: &TensorView) -> Result<Tensor, WeightsError> {
    let float = match view.dtype() {
        Dtype::F16 => Float::F16,
        Dtype::BF16 => Float::BF16,
        Dtype::F32 => Float::F32,
        Dtype::F64 => Float::F64,
        other => return Err(error::kind(name, &format!("{other:?}"))),
    };
    let count = view.data().len() / float.size();
    let count = checked_count(name, view.shape(), Some(count))?;
    // The safetensors reader has checked that data and shape agree.
    let values = (0..count).filter_map(|index| float.at(view.data(), index));
    Ok(Tensor {
        shape: view.shape().to_vec(),
        values: values.collect(),
    })
}
