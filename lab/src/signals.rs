//! Signals that stop the program, and the one for the limit of file sizes.

use std::{
    ops::ControlFlow,
    sync::{Arc, atomic::AtomicBool},
    thread,
    time::Duration,
};

use ratelab::Interrupt;
use ratelab_cart_pole::policy::end_programs;
use signal_hook::{
    consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ},
    flag,
    iterator::Signals,
    low_level,
};

use crate::{
    output::{note, remove_unfinished},
    stop_signal,
};

/// Time for the answer of a policy in a program, when the command is to stop.
const GRACE: Duration = Duration::from_millis(100);

/// From now on the first SIGINT, SIGTERM or SIGHUP calls `first`, which should end the
/// program normally; the next one calls `last` and ends the program at once. A second
/// SIGHUP is ignored: a closing terminal may send several.
pub fn watch(first: impl FnOnce() + Send + 'static, last: impl FnOnce() + Send + 'static) {
    let mut signals = match Signals::new([SIGINT, SIGTERM, SIGHUP]) {
        Ok(signals) => signals,
        Err(error) => return note(&format!("Ctrl-C will end the program at once: {error}")),
    };
    thread::spawn(move || {
        let mut arriving = signals.forever();
        if let Some(signal) = arriving.next() {
            stop_signal::received(signal);
            first();
            thread::spawn(|| {
                thread::sleep(GRACE);
                end_programs();
            });
        }
        if let Some(signal) = arriving.find(|signal| *signal != SIGHUP) {
            stop_signal::received(signal);
            last();
            end_at_once();
        }
    });
}

/// Returns an interrupt that the first signal asks for; the next signal ends the program at
/// once.
pub fn interrupt() -> Interrupt {
    let interrupt = Interrupt::default();
    let asked = interrupt.clone();
    watch(move || asked.ask(), || ());
    interrupt
}

/// Whether what goes on is to go on, or somebody has asked for a stop.
pub fn unless(asked: &Interrupt) -> ControlFlow<()> {
    match asked.is_asked() {
        true => ControlFlow::Break(()),
        false => ControlFlow::Continue(()),
    }
}

/// Ends the program immediately after a signal.
pub fn end_at_once() -> ! {
    end_programs();
    let _no_more = remove_unfinished();
    // Skips exit handlers, because other threads are still running.
    low_level::exit(stop_signal::exit_code().unwrap_or(1).into())
}

/// Turns the limit of file sizes (`ulimit -f`) into a write error, like a full disk, in
/// place of a fatal signal.
pub fn outlive_size_limit() {
    // An empty handler: the viewer would inherit an ignored signal.
    let _ = flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)));
}
