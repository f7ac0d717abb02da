//! A signal ends the present run, or the program where there is none.

use std::{
    io,
    sync::{
        Arc, Mutex, MutexGuard,
        atomic::{AtomicBool, Ordering},
    },
    thread,
};

use crossbeam_channel::Sender;
use ratelab::{Command, sync::lock};

use super::{end_at_once, watch};

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
        watch(move || at_signal.ask(), || ());
        if child {
            let with_parent = stop.clone();
            thread::spawn(move || {
                let _ = io::copy(&mut io::stdin(), &mut io::sink());
                with_parent.ask();
            });
        }
        stop
    }

    /// Asks the present run to stop; ends the program if there is none.
    fn ask(&self) {
        self.asked.store(true, Ordering::Relaxed);
        match &*self.commands() {
            Some(commands) => drop(commands.send(Command::Stop)),
            None => end_at_once(),
        }
    }

    /// Returns whether a stop was asked for.
    pub fn asked(&self) -> bool {
        self.asked.load(Ordering::Relaxed)
    }

    /// Stops by `commands` from now on; by the end of the program without them.
    pub fn by(&self, commands: Option<Sender<Command>>) {
        *self.commands() = commands;
    }

    fn commands(&self) -> MutexGuard<'_, Option<Sender<Command>>> {
        lock(&self.commands)
    }
}
