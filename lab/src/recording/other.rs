//! A system in a recording that is unknown to this program.

use ratelab_study::system::{BuildError, Builder, System};

/// A placeholder for a system of another program: all its views come from the recording.
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
