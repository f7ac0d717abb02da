//! Tensors from files.

use half::{bf16, f16};

use super::error;
use crate::WeightsError;

/// Maximum number of elements in a tensor: a square of the largest width.
const LARGEST_TENSOR: usize = super::LARGEST_WIDTH * super::LARGEST_WIDTH;

/// A tensor, its numbers row by row.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tensor {
    pub(super) shape: Vec<usize>,
    pub(super) values: Vec<f32>,
}

/// Returns the number of elements of the tensor `name`, unless it has too many.
pub(super) fn checked_count(
    name: &str,
    shape: &[usize],
    count: Option<usize>,
) -> Result<usize, WeightsError> {
    let few = count.filter(|count| *count <= LARGEST_TENSOR);
    few.ok_or_else(|| error::shape(name, &format!("{LARGEST_TENSOR} numbers at most"), shape))
}

/// Kinds of floating-point numbers in files, little-endian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Float {
    F16,
    BF16,
    F32,
    F64,
}

impl Float {
    /// Bytes of one number.
    pub(super) fn size(self) -> usize {
        match self {
            Self::F16 | Self::BF16 => 2,
            Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Returns the number `index` of `bytes`, rounded to single precision.
    pub(super) fn at(self, bytes: &[u8], index: usize) -> Option<f32> {
        let begin = index.checked_mul(self.size())?;
        let bytes = bytes.get(begin..begin.checked_add(self.size())?)?;
        Some(match self {
            Self::F16 => f16::from_le_bytes(bytes.try_into().ok()?).to_f32(),
            Self::BF16 => bf16::from_le_bytes(bytes.try_into().ok()?).to_f32(),
            Self::F32 => f32::from_le_bytes(bytes.try_into().ok()?),
            Self::F64 => f64::from_le_bytes(bytes.try_into().ok()?) as f32,
        })
    }
}
