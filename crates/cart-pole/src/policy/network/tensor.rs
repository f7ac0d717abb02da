//! Tensors from files.

use super::error;

/// Maximum number of elements in a tensor: a square of the largest width.
const LARGEST_TENSOR: usize = super::LARGEST_WIDTH * super::LARGEST_WIDTH;

/// A tensor, its numbers row by row.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tensor {
    pub(super) shape: Vec<usize>,
    pub(super) values: Vec<f32>,
}

/// The number of elements of the tensor `name`, unless it has too many.
pub(super) fn checked_count(
    name: &'static str,
    shape: &[usize],
    count: Option<usize>,
) -> Result<usize, String> {
    let few = count.filter(|count| *count <= LARGEST_TENSOR);
    few.ok_or_else(|| error::shape(name, &format!("{LARGEST_TENSOR} numbers at most"), shape))
}

/// Kinds of floating-point numbers in files, little-endian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Float {
    F16,
    F32,
    F64,
}

impl Float {
    /// Bytes of one number.
    pub(super) fn size(self) -> usize {
        match self {
            Self::F16 => 2,
            Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Number `index` of `bytes`, rounded to single precision.
    pub(super) fn at(self, bytes: &[u8], index: usize) -> Option<f32> {
        let begin = index.checked_mul(self.size())?;
        let bytes = bytes.get(begin..begin.checked_add(self.size())?)?;
        Some(match self {
            Self::F16 => half(u16::from_le_bytes(bytes.try_into().ok()?)),
            Self::F32 => f32::from_le_bytes(bytes.try_into().ok()?),
            Self::F64 => f64::from_le_bytes(bytes.try_into().ok()?) as f32,
        })
    }
}

/// Converts half precision (IEEE 754 binary16).
fn half(bits: u16) -> f32 {
    let (exponent, fraction) = (bits >> 10 & 0x1f, bits & 0x3ff);
    let magnitude = match exponent {
        0 => f32::from(fraction) * 2f32.powi(-24),
        0x1f if fraction == 0 => f32::INFINITY,
        0x1f => f32::NAN,
        _ => (1.0 + f32::from(fraction) * 2f32.powi(-10)) * 2f32.powi(i32::from(exponent) - 15),
    };
    if bits >> 15 == 0 {
        magnitude
    } else {
        -magnitude
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_precision_follows_ieee_754() {
        let cases = [
            (0x0000, 0.0),
            (0x8000, -0.0),
            (0x0001, 5.960_464_5e-8),
            (0x03ff, 6.097_555e-5),
            (0x0400, 6.103_515_6e-5),
            (0x3555, 0.333_251_95),
            (0x3c00, 1.0),
            (0xc000, -2.0),
            (0x7bff, 65_504.0),
            (0xfc00, f32::NEG_INFINITY),
        ];
        for (bits, value) in cases {
            assert_eq!(half(bits).to_bits(), f32::to_bits(value), "{bits:#06x}");
        }
        assert!(half(0x7e00).is_nan());
    }
}
