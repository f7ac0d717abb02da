//! Weights from a safetensors file.

use safetensors::{Dtype, SafeTensors};

use super::{
    Mlp, WeightsError,
    tensor::{Float, Tensor, checked_count},
};

/// The longest header accepted (bytes): enough for one or two thousand tensors.
const LONGEST_HEADER: u64 = 1 << 18;

/// Reads the actor from a safetensors file.
pub(super) fn read(content: &[u8]) -> Result<Mlp, WeightsError> {
    check_header(content)?;
    let file = SafeTensors::deserialize(content).map_err(|why| {
        WeightsError::Format(format!(
            "as safetensors, {}",
            why.to_string().escape_debug()
        ))
    })?;
    Mlp::from_tensors(|name| tensor(&file, name))
}

/// Checks the length of the header: as JSON it takes many times its length in memory.
fn check_header(content: &[u8]) -> Result<(), WeightsError> {
    let refuse = |why: String| Err(WeightsError::Format(why));
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

fn tensor(file: &SafeTensors, name: &'static str) -> Result<Tensor, WeightsError> {
    let view = file
        .tensor(name)
        .map_err(|_| WeightsError::missing(name, file.names().into_iter()))?;
    let float = match view.dtype() {
        Dtype::F16 => Float::F16,
        Dtype::F32 => Float::F32,
        Dtype::F64 => Float::F64,
        other => {
            let found = format!("{other:?}");
            return Err(WeightsError::Kind { name, found });
        }
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
