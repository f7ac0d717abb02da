//! The knobs of a node: of its schedule, and of the node itself.

use super::{
    command::Command, knob::Knob, local_clock::LocalClock, record::TickTimes, seat::Seat,
    task::Task, time::Time,
};

/// Checks that the node has this knob and that everything its value needs is loaded.
///
/// # Errors
/// The reason.
pub(crate) fn check(task: &Task, seat: &Seat, knob: &Knob) -> Result<(), String> {
    seat.check(knob)?;
    task.check(knob)?;
    match knob.draw().and_then(|draw| draw.missing()) {
        Some(recorded) => Err(format!(
            "the durations in {} were not loaded: name a recording that the command can read",
            recorded.file()
        )),
        None => Ok(()),
    }
}

/// Carries out a command for a node at run time `at`; returns the previous value.
///
/// # Errors
/// The reason and a remedy.
pub(crate) fn obey(
    task: &mut Task,
    seat: &mut Seat,
    command: &Command,
    at: Time,
) -> Result<String, String> {
    let Command::Set(knob) = command else {
        return Err(format!("{command} is not for a node"));
    };
    check(task, seat, knob)?;
    match knob {
        Knob::Send { text, .. } => seat.send(text),
        Knob::Crash { .. } => Ok(state(crash(task, seat, at)).to_owned()),
        Knob::Restart { .. } => restart(task, seat, at),
        Knob::Clock { error, .. } => {
            let clock = LocalClock::new(at, *error);
            seat.set_clock(clock);
            Ok(task.set_clock(clock, at).error.to_string())
        }
        knob => {
            let before = task.turn(knob, at);
            before.ok_or_else(|| format!("{command} is not for a node"))
        }
    }
}

/// Stops the node's ticks at run time `at`; returns whether they had stopped before. Messages
/// it has not released are lost.
fn crash(task: &mut Task, seat: &mut Seat, at: Time) -> bool {
    task.overrun_before(at);
    cut_off(task, seat);
    seat.clear();
    task.crash()
}

/// Restarts the node at run time `at`.
fn restart(task: &mut Task, seat: &mut Seat, at: Time) -> Result<String, String> {
    let was = state(task.is_crashed()).to_owned();
    if seat.again.is_some() {
        crash(task, seat, at);
    }
    seat.begin_anew()?;
    if !task.is_crashed() {
        crash(task, seat, at);
    }
    task.restart(at);
    Ok(was)
}

/// Records a tick that was unfinished at the end of the run, or when its node crashed.
pub(crate) fn cut_off(task: &mut Task, seat: &Seat) {
    if let Some((at, lateness)) = task.cut_off() {
        let (took, ends) = (None, None);
        seat.record(TickTimes {
            at,
            lateness,
            took,
            ends,
        });
    }
}

fn state(crashed: bool) -> &'static str {
    if crashed { "crashed" } else { "running" }
}
