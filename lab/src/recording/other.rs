//! The system of a recording that this program does not have.

use ratelab::system::{BuildError, Builder, System};

/// Stands for a system of another program: what there is to see of it is in the
/// recording.
pub struct OtherSystem;

impl System for OtherSystem {
    fn name(&self) -> &'static str {
        "other"
    }

    fn build(&self, _: &mut Builder<'_>) -> Result<(), BuildError> {
        let why = "the system of this recording is in another program: run it there";
        Err(BuildError::Setting(why.to_owned()))
    }
}
