//! The way out for a policy that is not read here: a program.

use strum::{Display, EnumString, VariantNames};

/// A program that `ratelab new --policy` writes: what it loads the policy with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Display, EnumString, VariantNames)]
#[strum(serialize_all = "lowercase")]
pub enum ProgramKind {
    /// A model of Stable-Baselines3.
    Sb3,
    /// A TorchScript file, or an exported program.
    TorchScript,
    /// An ONNX file.
    Onnx,
    /// A module of PyTorch and its state dictionary.
    Module,
}

impl ProgramKind {
    /// The names of all kinds, in texts.
    pub const NAMES: &[&str] = <Self as VariantNames>::VARIANTS;
}

/// Returns what to do with a policy that a program of this kind can run, or one written from
/// nothing: the end of a sentence.
pub(super) fn way_out(kind: Option<ProgramKind>) -> String {
    match kind {
        Some(kind) => format!(
            "a short program can run it: ratelab new policy.py --policy {kind} (docs/policies.md)"
        ),
        None => "a program of your own can run it (docs/policies.md)".to_owned(),
    }
}
