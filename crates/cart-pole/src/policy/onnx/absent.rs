//! A placeholder without ONNX Runtime, for builds without the feature `onnx`.

use crate::policy::{Policy, PolicyFault};

/// A type without values.
#[derive(Clone, Debug)]
pub(in crate::policy) enum OnnxModel {}

impl OnnxModel {
    pub(in crate::policy) fn open(_: &[u8]) -> Result<Self, PolicyFault> {
        let why =
            "it takes the ONNX Runtime, without which this was built: build with --features onnx";
        Err(PolicyFault::Other(why.to_owned()))
    }

    pub(in crate::policy) fn policy(&self, _: &str) -> Box<dyn Policy> {
        match *self {}
    }
}
