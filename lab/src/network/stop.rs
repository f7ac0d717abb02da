//! A signal ends the present run, or the program where there is none.

use std::{
    io::{self, Read},
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    thread,
};

use crossbeam_channel::Sender;
use ratelab::Command;

use crate::signals;

/// The request to stop.
#[derive(Default)]
pub struct Stop {
    asked: AtomicBool,
    /// The commands of the present run.
    commands: Mutex<Option<Sender<Command>>>,
}

impl Stop {
    /// Stops at the first signal; with `child` also when the parent is gone.
    pub fn watch(child: bool) -> Arc<Self> {
        let stop = Arc::<Self>::default();
        let at_signal = stop.clone();
        signals::watch(move || at_signal.ask(), || ());
        if child {
            let with_parent = stop.clone();
            thread::spawn(move || {
                let _ = io::stdin().read_to_end(&mut Vec::new());
                with_parent.ask();
            });
        }
        stop
    }

    /// Asks the present run to stop; ends the program if there is none.
    fn ask(&self) {
        self.asked.store(true, Ordering::Relaxed);
        match &*self.lock() {
            Some(commands) => drop(commands.send(Command::Stop)),
            None => signals::end_at_once(),
        }
    }

    /// Whether it was asked for.
    pub fn asked(&self) -> bool {
        self.asked.load(Ordering::Relaxed)
    }

    /// Stops by `commands` from now on; by the end of the program without them.
    pub fn by(&self, commands: Option<Sender<Command>>) {
        *self.lock() = commands;
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Option<Sender<Command>>> {
        self.commands.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
