//! What no schedule of threads may break, tried over many of them by the
//! shuttle model checker.
//!
//! With the feature `model` the library's locks, atomics, threads and wall
//! clock are the checker's: every use of one is a point at which another thread
//! may go on. A thread that is never woken is found as a deadlock, one that
//! never ends as too many steps.

#[path = "../support/mod.rs"]
mod support;

mod clock;
mod meter;
mod topic;

/// Tries schedules of both kinds: any at all, and those with a few well-placed
/// switches between threads that otherwise run on.
fn explore(schedules: usize, check: impl Fn() + Send + Sync + Clone + 'static) {
    shuttle::check_random(check.clone(), schedules);
    shuttle::check_pct(check, schedules, 3);
}

/// Schedules for a check of one topic or meter.
const MANY: usize = 2_000;

/// Schedules for a check of a whole graph.
const SOME: usize = 500;
