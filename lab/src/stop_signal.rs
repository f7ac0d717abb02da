//! The signal that stops the program.

use std::{
    sync::{
        OnceLock,
        atomic::{AtomicI32, Ordering},
    },
    time::{Duration, Instant},
};

use signal_hook::low_level::signal_name;

/// The last one; 0 before the first.
static RECEIVED: AtomicI32 = AtomicI32::new(0);

/// When the first one came.
static FIRST: OnceLock<Instant> = OnceLock::new();

/// Time after a signal for what a command can do without.
const PATIENCE: Duration = Duration::from_millis(300);

/// Notes that `signal` has come.
pub fn received(signal: i32) {
    FIRST.get_or_init(Instant::now);
    RECEIVED.store(signal, Ordering::Relaxed);
}

/// 128 + n after signal n, as a shell reports it; `None` without a signal.
pub fn exit_code() -> Option<u8> {
    let signal = RECEIVED.load(Ordering::Relaxed);
    let code = u8::try_from(128 + signal).ok();
    code.filter(|_| signal != 0)
}

/// Returns whether a signal came so long ago that only what must be done is to be done.
pub fn is_overdue() -> bool {
    age() > PATIENCE
}

/// Time since the first one; zero before it.
pub fn age() -> Duration {
    FIRST.get().map(Instant::elapsed).unwrap_or_default()
}

/// Returns the name of `signal`, such as `SIGTERM`.
pub fn name(signal: i32) -> &'static str {
    signal_name(signal).unwrap_or("a signal")
}
