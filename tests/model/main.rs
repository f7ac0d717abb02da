//! Invariants under any schedule of threads, tested over many schedules by the shuttle
//! model checker.
//!
//! With the feature `model` the library's locks, atomics, threads and wall clock are the
//! checker's: every use of one is a point at which another thread may run. A thread that
//! is never woken shows up as a deadlock, one that never ends as too many steps.

#[path = "../support/graphs.rs"]
mod support;

mod clock;
mod executor;
mod meter;
mod rerun;
mod topic;

/// Tries two kinds of schedules: random ones, and ones with a few well-placed switches
/// between threads.
fn explore(schedules: usize, check: impl Fn() + Send + Sync + Clone + 'static) {
    shuttle::check_random(check.clone(), schedules);
    shuttle::check_pct(check, schedules, 3);
}

/// A person who gives `commands` while other threads run.
fn person(
    commander: crossbeam_channel::Sender<ratelab::Command>,
    commands: &'static str,
) -> shuttle::thread::JoinHandle<()> {
    shuttle::thread::spawn(move || {
        for text in commands.split("; ").filter(|text| !text.is_empty()) {
            shuttle::thread::yield_now();
            // The run may be over by now.
            let _ = commander.send(support::command(text));
        }
    })
}

/// Schedules for a check of one topic or meter.
const MANY: usize = 2_000;

/// Schedules for a check of a whole graph.
const SOME: usize = 500;
