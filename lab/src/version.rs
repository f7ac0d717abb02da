//! The version and origin of this program, for bug reports.

use ratelab_cart_pole::{mujoco_version, policy::RUNS_ONNX};
use ratelab_recording::rrd::rerun_version;

use crate::{program::Program, summary::text::line};

const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The commit, such as `1a2b3c4 + changes`, if it is known.
const COMMIT: Option<&str> = option_env!("RATELAB_COMMIT");

/// The day of the commit, such as `2026-03-14`, if it is known.
pub const DATE: Option<&str> = option_env!("RATELAB_DATE");

/// Returns a line to follow the name.
pub fn short(program: &Program) -> String {
    let version = version(program);
    match (COMMIT, DATE) {
        (Some(commit), Some(date)) => format!("{version} ({commit}, {date})"),
        _ => version,
    }
}

/// Programs other than ratelab have their own versions.
fn version(program: &Program) -> String {
    let with = if program.course { "" } else { "with ratelab " };
    format!("{with}{VERSION}")
}

/// Several lines to follow the name.
pub fn long(program: &Program) -> String {
    let onnx = if RUNS_ONNX {
        "yes, where the ONNX Runtime is installed"
    } else {
        "no: built without the feature onnx"
    };
    let unknown = "unknown";
    let facts = [
        ("commit", COMMIT.unwrap_or(unknown)),
        ("date", DATE.unwrap_or(unknown)),
        ("target", env!("RATELAB_TARGET")),
        ("profile", env!("RATELAB_PROFILE")),
        ("rustc", option_env!("RATELAB_RUSTC").unwrap_or(unknown)),
        ("MuJoCo", mujoco_version()),
        ("rerun", &rerun_version()),
        ("ONNX", onnx),
    ]
    .map(|(name, fact)| line(name, fact));
    format!("{}\n{}", version(program), facts.join("\n"))
}
