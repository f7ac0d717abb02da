//! `ratelab replay`: a recording in the rerun viewer, or in the dashboard.

use std::{
    env,
    ffi::OsString,
    path::Path,
    process::{Command, Stdio},
    sync::Arc,
};

use ratelab_recording::{ReadError, Recording, rrd::rerun_version};
use ratelab_screen::LabOutcome;

use crate::{
    cli::ReplayArgs,
    error::Error,
    output::{note, print_line},
    program::{self, Program},
    reading,
    results::print_recordings,
    screen::{need_terminal, screen, sessions},
    summary::text,
};

/// The viewer's command.
const VIEWER: &str = "rerun";

/// Shows a recording in the viewer, or in the terminal where there is none; of a damaged
/// one, the intact part.
pub fn replay(program: &Program, args: &ReplayArgs) -> Result<(), Error> {
    let recording = match reading::read(&args.file) {
        // The viewer can show these, but the terminal cannot.
        Err(ReadError::Sweep { path }) if !args.terminal => {
            check_viewer()?;
            return open_viewer(&path);
        }
        read => Arc::new(read?),
    };
    if args.terminal {
        need_terminal("replay --terminal needs a terminal to draw on", "info")?;
        play(program, args, &recording)?;
    } else {
        match check_viewer() {
            Ok(()) => open_viewer(&args.file)?,
            Err(why) if ratelab_screen::terminal_is_there() => {
                note(&format!("{why}; it played in this terminal"));
                play(program, args, &recording)?;
            }
            Err(why) => return Err(why),
        }
    }
    Error::if_damaged(&recording)
}

/// Plays a recording in the panes of the lab.
fn play(program: &Program, args: &ReplayArgs, recording: &Arc<Recording>) -> Result<(), Error> {
    let setup = sessions(&program.for_recording(recording), args.screen.limits);
    let branch = ratelab_screen::play(recording.clone(), setup, &screen(&args.screen))?;
    branch.map_or(Ok(()), print_branch)
}

/// Prints what a branch of the recording changed.
fn print_branch(left: LabOutcome) -> Result<(), Error> {
    print_recordings(false, &left.recorded)?;
    let verdict = left.ended?.summary.verdict;
    print_line(&text::line("branch", &verdict.to_string()))?;
    if let Some(so) = &left.change {
        print_line(&text::line("so", so))?;
    }
    left.unrecorded.map_or(Ok(()), |error| Err(error.into()))
}

/// Prefers the viewer beside this program, where pip installs both and which may be
/// outside of the search path.
fn viewer() -> OsString {
    let program = env::current_exe().and_then(|program| program.canonicalize());
    let beside = program.map(|program| program.with_file_name(VIEWER));
    match beside {
        Ok(viewer) if viewer.is_file() => viewer.into(),
        _ => VIEWER.into(),
    }
}

/// Returns how to install the viewer.
fn advice() -> String {
    let (rerun, program) = (rerun_version(), program::name());
    format!(
        "python3 -m pip install rerun-sdk=={rerun} brings it; {program} replay --terminal needs none"
    )
}

/// Looks for the viewer. Prints a note for one of another version, which may be unable to
/// show everything; refuses a program without a version.
fn check_viewer() -> Result<(), Error> {
    let (ours, advice) = (rerun_version(), advice());
    let refused = |why: String| Error::Unfinished(format!("{why}: {advice}"));
    let asked = Command::new(viewer()).arg("--version").output();
    let answer = asked.map_err(|why| refused(format!("the rerun viewer was not found ({why})")))?;
    let said = String::from_utf8_lossy(&answer.stdout);
    let version = said.split_whitespace().nth(1).unwrap_or_default();
    if !version.starts_with(|c: char| c.is_ascii_digit()) {
        return Err(refused(format!(
            "the command {VIEWER} is not the rerun viewer"
        )));
    }
    if version != ours {
        note(&format!(
            "this viewer is rerun {version}, recordings are made for {ours}: {advice}"
        ));
    }
    Ok(())
}

fn open_viewer(file: &Path) -> Result<(), Error> {
    let ran = Command::new(viewer())
        .arg(file)
        .stdin(Stdio::null())
        .status();
    match ran {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(Error::Unfinished(format!(
            "the rerun viewer ended with {status}: {} replay --terminal needs none",
            program::name()
        ))),
        Err(why) => Err(Error::Unfinished(format!("the rerun viewer: {why}"))),
    }
}
