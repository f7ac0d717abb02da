//! Signals: those that ask the program to end, and the one of a file that may
//! not grow.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicI32, Ordering},
    },
    thread,
};

use signal_hook::{
    consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ},
    flag,
    iterator::Signals,
    low_level,
};

use crate::output::{note, remove_unfinished};

/// The last signal that asked the program to end; 0 before the first.
static RECEIVED: AtomicI32 = AtomicI32::new(0);

/// From now on the first of SIGINT, SIGTERM and SIGHUP calls `first`, which is to
/// end the program in order; the next one calls `last` and ends it at once. A
/// second SIGHUP does not: a terminal that goes away may send several.
pub fn watch(first: impl FnOnce() + Send + 'static, last: impl FnOnce() + Send + 'static) {
    let mut signals = match Signals::new([SIGINT, SIGTERM, SIGHUP]) {
        Ok(signals) => signals,
        Err(error) => return note(&format!("Ctrl-C will end the program at once: {error}")),
    };
    thread::spawn(move || {
        let mut arriving = signals.forever();
        if let Some(signal) = arriving.next() {
            RECEIVED.store(signal, Ordering::Relaxed);
            first();
        }
        if let Some(signal) = arriving.find(|signal| *signal != SIGHUP) {
            RECEIVED.store(signal, Ordering::Relaxed);
            last();
            end_at_once();
        }
    });
}

/// Set by the first signal that asks the program to end; the next one ends it at
/// once.
pub fn stop_flag() -> Arc<AtomicBool> {
    let flag = Arc::<AtomicBool>::default();
    let stop = flag.clone();
    watch(move || stop.store(true, Ordering::Relaxed), || ());
    flag
}

/// Ends the program without waiting for anything, as a signal asked for.
pub fn end_at_once() -> ! {
    remove_unfinished();
    // No exit handlers: other threads are still at work.
    low_level::exit(exit_code().unwrap_or(1).into())
}

/// 128 + n after signal n, as a shell reports it; `None` without a signal.
pub fn exit_code() -> Option<u8> {
    let signal = RECEIVED.load(Ordering::Relaxed);
    let code = u8::try_from(128 + signal).ok();
    code.filter(|_| signal != 0)
}

/// Makes a limit on the size of files (`ulimit -f`) an error of writing, as a
/// full disk is one, instead of the program's end.
pub fn outlive_size_limit() {
    // A handler that does nothing: ignoring would be inherited by the viewer.
    let _ = flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)));
}
