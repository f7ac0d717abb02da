//! The terminal: taken over with care, given back whatever happens.

use std::{
    io::{self, IsTerminal, Stdout, stdin, stdout},
    panic,
    sync::Once,
    thread,
    time::Duration,
};

use crossterm::{
    cursor::Show,
    event::{self, Event},
    execute,
    terminal::{EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode},
};
use ratatui::{Terminal, backend::CrosstermBackend};

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
        enable_raw_mode()?;
        let screen = execute!(stdout(), EnterAlternateScreen)
            .and_then(|()| Terminal::new(CrosstermBackend::new(stdout())));
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

/// Gives the terminal back. There is nobody to tell if that fails.
pub fn restore() {
    let _ = disable_raw_mode();
    let _ = execute!(stdout(), LeaveAlternateScreen, Show);
}

/// A panic of the dashboard gives the terminal back before it is reported. One
/// in a node's thread is no reason to: it becomes a fault, which the dashboard
/// tells when it has left the screen.
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

/// Where keys come from.
pub trait Input {
    /// The next event, if one comes within `timeout`.
    ///
    /// # Errors
    /// If the source fails.
    fn next(&mut self, timeout: Duration) -> io::Result<Option<Event>>;
}

/// Keys from the terminal.
pub struct Keyboard;

impl Input for Keyboard {
    fn next(&mut self, timeout: Duration) -> io::Result<Option<Event>> {
        if event::poll(timeout)? {
            event::read().map(Some)
        } else {
            Ok(None)
        }
    }
}
