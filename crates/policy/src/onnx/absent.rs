//! A placeholder without ONNX Runtime, for builds without the feature `onnx`.

use crate::{PolicyFault, RowPolicy};

/// A type without values.
#[derive(Clone, Debug)]
pub(crate) enum OnnxModel {}

impl OnnxModel {
    pub(crate) fn open(_: &[u8]) -> Result<Self, PolicyFault> {
        let why =
            "it takes the ONNX Runtime, without which this was built: build with --features onnx";
        Err(PolicyFault::Other(why.to_owned()))
    }

    pub(crate) fn inputs(&self) -> Option<usize> {
        match *self {}
    }

    pub(crate) fn outputs(&self, _: usize) -> Result<usize, PolicyFault> {
        match *self {}
    }

    pub(crate) fn policy(&self, _: usize, _: usize) -> Box<dyn RowPolicy> {
        match *self {}
    }
}
