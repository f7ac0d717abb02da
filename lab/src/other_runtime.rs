//! A run on another runtime, shown in the dashboard and compared with the same run on ours.

use std::{ops::ControlFlow, sync::Arc};

use ratelab_recording::{OtherRun, Recording, VerifyWith, verify};
use ratelab_screen::{Options, SessionSetup};
use ratelab_system::System;

use crate::{
    error::Error,
    output::print_line,
    screen::{quit_on_signal, theme},
};
use ratelab_recording::printable::shown;

/// Maximum frames per second.
const FPS: u32 = 30;

/// Plays `run` in the dashboard if there is a terminal; then compares every message and tick
/// with the run on our runtime, and prints the result.
pub fn show(system: &Arc<dyn System>, run: OtherRun) -> Result<(), Error> {
    let recording = Arc::new(Recording::from_other_runtime(run, system)?);
    if ratelab_screen::terminal_is_there() {
        let options = Options {
            fps: FPS,
            theme: theme(false, None),
            ask_background: false,
            quit_on_signal,
        };
        let setup = SessionSetup::new(system.clone(), None);
        ratelab_screen::play(recording.clone(), setup, &options)?;
    }
    let name = shown(&recording.path);
    let identical = verify(&recording, system, VerifyWith::default(), |_| {
        ControlFlow::Continue(())
    })
    .map_err(|why| Error::unverified(&name, why))?;
    print_line(&format!("{name}: {identical}"))
}
