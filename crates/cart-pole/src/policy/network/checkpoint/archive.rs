//! Zips other than checkpoints, by the names of their entries.

use super::super::error::{WeightsError, listed};
use crate::policy::way_out::ProgramKind;

/// Returns the error for a zip with these `names` that is known to be something else.
pub(super) fn other_archive(names: &[&str]) -> Option<WeightsError> {
    let among = |wanted: &str| names.contains(&wanted);
    let ends = |end: &str| names.iter().any(|name| name.ends_with(end));
    let (what, program) = if among("policy.pth") || among("_stable_baselines3_version") {
        let found = ["policy.pth", "_stable_baselines3_version"]
            .into_iter()
            .filter(|name| among(name));
        let found: Vec<&str> = found.collect();
        let what = format!(
            "a Stable-Baselines3 model ({} in the zip)",
            found.join(" and ")
        );
        (what, Some(ProgramKind::Sb3))
    } else if ends("/constants.pkl") {
        let what = "TorchScript, which is code (constants.pkl in the zip)";
        (what.to_owned(), Some(ProgramKind::TorchScript))
    } else if ends("/archive_format") || ends("serialized_exported_program.json") {
        let what = "a program exported by torch.export (.pt2)";
        (what.to_owned(), Some(ProgramKind::TorchScript))
    } else if ends(".weights.h5") {
        (
            "a model of Keras (model.weights.h5 in the zip)".to_owned(),
            None,
        )
    } else if !names.is_empty() && names.iter().all(|name| name.ends_with(".npy")) {
        let what = format!("arrays of NumPy (.npz): {}", listed(names.iter().copied()));
        (what, None)
    } else {
        return None;
    };
    Some(WeightsError::Unfit {
        why: format!("expected a PyTorch checkpoint with a state_dict alone, found {what}"),
        program,
    })
}
