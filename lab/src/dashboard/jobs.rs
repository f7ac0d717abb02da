//! The shell's job control: stopping, and going on in the foreground.

use std::{
    io,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use rustix::process::{Signal, getpgrp, getsid, kill_current_process_group};
use signal_hook::{
    consts::{SIGCONT, SIGTSTP},
    flag,
    low_level::emulate_default_handler,
};

/// A request of the shell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShellRequest {
    /// Nothing.
    Stay,
    /// To stop.
    Stop,
    /// To go on: the program was stopped, and the terminal in other hands.
    GoOn,
}

/// The signals of job control, as flags.
pub struct Jobs {
    stop: Arc<AtomicBool>,
    go_on: Arc<AtomicBool>,
}

impl Jobs {
    /// Takes note of them from now on.
    ///
    /// # Errors
    /// If the system allows no handler.
    pub fn watch() -> io::Result<Self> {
        let jobs = Self {
            stop: Arc::default(),
            go_on: Arc::default(),
        };
        flag::register(SIGTSTP, jobs.stop.clone())?;
        flag::register(SIGCONT, jobs.go_on.clone())?;
        Ok(jobs)
    }

    /// The request since the last call. Without a shell that could continue the
    /// program, it does not stop.
    pub fn turn(&self) -> ShellRequest {
        if self.stop.swap(false, Ordering::Relaxed) && has_shell() {
            ShellRequest::Stop
        } else if self.go_on.swap(false, Ordering::Relaxed) {
            ShellRequest::GoOn
        } else {
            ShellRequest::Stay
        }
    }

    /// Does what the terminal does on Ctrl-Z: the whole pipeline is to stop.
    pub fn ask_to_stop() {
        if has_shell() {
            // The process itself may always be sent a signal.
            let _ = kill_current_process_group(Signal::TSTP);
        }
    }

    /// Stops the program; returns when it is continued.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn stop(&self) -> io::Result<()> {
        emulate_default_handler(SIGTSTP)?;
        self.go_on.store(false, Ordering::Relaxed);
        Ok(())
    }
}

/// Whether a shell with job control started the program: it gives each job a
/// process group of its own, which then is not that of the session's first
/// process.
fn has_shell() -> bool {
    getsid(None).is_ok_and(|session| session != getpgrp())
}
