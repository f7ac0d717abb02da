//! The signal that stops the program.

use std::sync::atomic::{AtomicI32, Ordering};

/// The last one; 0 before the first.
static RECEIVED: AtomicI32 = AtomicI32::new(0);

/// Notes that `signal` has come.
pub fn received(signal: i32) {
    RECEIVED.store(signal, Ordering::Relaxed);
}

/// 128 + n after signal n, as a shell reports it; `None` without a signal.
pub fn exit_code() -> Option<u8> {
    let signal = RECEIVED.load(Ordering::Relaxed);
    let code = u8::try_from(128 + signal).ok();
    code.filter(|_| signal != 0)
}
