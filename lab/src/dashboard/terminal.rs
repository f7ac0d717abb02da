//! The terminal: taken over with care, given back in any case.

use std::{
    io::{self, IsTerminal, Stdout, stdin, stdout},
    panic,
    sync::Once,
    thread,
    time::Duration,
};

use crossbeam_channel::{Receiver, RecvTimeoutError, bounded};
use crossterm::{
    cursor::Show,
    event::{self, DisableBracketedPaste, EnableBracketedPaste, Event},
    execute,
    terminal::{EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode},
};
use ratatui::{Terminal, backend::CrosstermBackend};

use super::jobs::{Jobs, Turn};

/// Keys that may wait to be obeyed.
const BACKLOG: usize = 1024;

/// Whether there is a terminal to draw on and to read keys from.
pub fn is_there() -> bool {
    stdin().is_terminal() && stdout().is_terminal()
}

/// The terminal while the dashboard has it; dropping gives it back.
pub struct Screen(pub Terminal<CrosstermBackend<Stdout>>);

impl Screen {
    /// Takes the terminal over.
    ///
    /// # Errors
    /// If the terminal refuses; it is then as it was.
    pub fn open() -> io::Result<Self> {
        restore_on_panic();
        let screen = take().and_then(|()| Terminal::new(CrosstermBackend::new(stdout())));
        if screen.is_err() {
            restore();
        }
        screen.map(Self)
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        restore();
    }
}

/// Takes the terminal over.
fn take() -> io::Result<()> {
    enable_raw_mode()?;
    // A paste comes as one event then, not as keys.
    execute!(stdout(), EnterAlternateScreen, EnableBracketedPaste)
}

/// Gives the terminal back; errors cannot be shown then.
pub fn restore() {
    let _ = disable_raw_mode();
    let _ = execute!(stdout(), DisableBracketedPaste, LeaveAlternateScreen, Show);
}

/// A panic of the dashboard gives the terminal back before the report. A panic in a
/// node's thread becomes a fault, which is printed after the dashboard.
fn restore_on_panic() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let dashboard = thread::current().id();
        let report = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
            if thread::current().id() == dashboard {
                restore();
                report(panic);
            }
        }));
    });
}

/// The source of keys, and of the shell's requests.
pub trait Input {
    /// The next event, if one comes within `timeout`.
    ///
    /// # Errors
    /// If the source fails.
    fn next(&mut self, timeout: Duration) -> io::Result<Option<Event>>;

    /// The newest request of the shell.
    fn turn(&mut self) -> Turn {
        Turn::Stay
    }

    /// Asks the shell to stop the program, as Ctrl-Z does.
    fn ask_to_stop(&mut self) {}

    /// Gives the terminal back, stops until the shell continues the program, and
    /// takes the terminal again.
    ///
    /// # Errors
    /// If the terminal refuses.
    fn stop(&mut self) -> io::Result<()> {
        Ok(())
    }

    /// Takes the terminal again after a stop without notice.
    ///
    /// # Errors
    /// If the terminal refuses.
    fn retake(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Keys from the terminal, and signals from the shell.
pub struct Keyboard {
    events: Receiver<io::Result<Event>>,
    jobs: Jobs,
}

impl Keyboard {
    /// Reads keys from now on, on a thread of its own: reading blocks within a key of
    /// which only the beginning has arrived.
    ///
    /// # Errors
    /// If there can be no thread, or no handler of signals.
    pub fn open() -> io::Result<Self> {
        let (sender, events) = bounded(BACKLOG);
        let reader = thread::Builder::new().name("keys".to_owned());
        reader.spawn(move || {
            loop {
                let event = event::read();
                let failed = event.is_err();
                if sender.send(event).is_err() || failed {
                    return;
                }
            }
        })?;
        let jobs = Jobs::watch()?;
        Ok(Self { events, jobs })
    }
}

impl Input for Keyboard {
    fn next(&mut self, timeout: Duration) -> io::Result<Option<Event>> {
        match self.events.recv_timeout(timeout) {
            Ok(event) => event.map(Some),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err(io::ErrorKind::UnexpectedEof.into()),
        }
    }

    fn turn(&mut self) -> Turn {
        self.jobs.turn()
    }

    fn ask_to_stop(&mut self) {
        Jobs::ask_to_stop();
    }

    fn stop(&mut self) -> io::Result<()> {
        restore();
        self.jobs.stop()?;
        take()
    }

    fn retake(&mut self) -> io::Result<()> {
        // The shell may have set modes of its own meanwhile.
        restore();
        take()
    }
}
