//! No ONNX Runtime: the feature `onnx` is off.

use super::OnnxError;
use crate::policy::Policy;

/// There is none.
#[derive(Clone, Debug)]
pub(in crate::policy) enum Model {}

impl Model {
    pub(in crate::policy) fn open(_: &[u8]) -> Result<Self, OnnxError> {
        Err(OnnxError::NotBuilt)
    }

    pub(in crate::policy) fn policy(&self, _: &str) -> Box<dyn Policy> {
        match *self {}
    }
}
