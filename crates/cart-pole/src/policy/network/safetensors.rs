//! Weights from a safetensors file.

use safetensors::{Dtype, SafeTensors};

use super::{
    Mlp, error,
    tensor::{Float, Tensor, checked_count},
};

/// The longest header accepted (bytes): enough for one or two thousand tensors.
const LONGEST_HEADER: u64 = 1 << 18;

/// Reads the actor from a safetensors file.
pub(super) fn read(content: &[u8]) -> Result<Mlp, String> {
    check_header(content)?;
    let file = SafeTensors::deserialize(content);
    let file = file.map_err(|why| {
        let why = why.to_string();
        no_format(&format!("as safetensors, {}", why.escape_debug()))
    })?;
    Mlp::from_tensors(|name| tensor(&file, name))
}

fn no_format(why: &str) -> String {
    format!("expected a PyTorch checkpoint (.pt), safetensors or ONNX, found none of them: {why}")
}

/// Checks the length of the header: as JSON it takes many times its length in memory.
fn check_header(content: &[u8]) -> Result<(), String> {
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

fn tensor(file: &SafeTensors, name: &'static str) -> Result<Tensor, String> {
    let view = file
        .tensor(name)
        .map_err(|_| error::missing_among(name, file.names().into_iter()))?;
    let float = match view.dtype() {
        Dtype::F16 => Float::F16,
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
