//! A placeholder without ONNX Runtime, for builds without the feature `onnx`.

use super::OnnxError;
use crate::policy::Policy;

/// A type without values.
#[derive(Clone, Debug)]
pub(in crate::policy) enum OnnxModel {}

impl OnnxModel {
    pub(in crate::policy) fn open(_: &[u8]) -> Result<Self, OnnxError> {
        Err(OnnxError::NotBuilt)
    }

    pub(in crate::policy) fn policy(&self, _: &str) -> Box<dyn Policy> {
        match *self {}
    }
}
