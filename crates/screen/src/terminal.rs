//! The terminal: taken over with care, given back in any case; and the shell's job control:
//! stopping, and going on in the foreground.

use std::{
    collections::VecDeque,
    io::{self, IsTerminal, Stdout, stdin, stdout},
    mem::ManuallyDrop,
    panic,
    sync::{
        Arc, Once,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use crossbeam_channel::{Receiver, RecvTimeoutError, bounded};
use crossterm::{
    cursor::Show,
    event::{self, DisableBracketedPaste, EnableBracketedPaste, Event},
    execute,
    style::Print,
    terminal::{EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode},
};
use ratatui::{Terminal, backend::CrosstermBackend};
use rustix::process::{Signal, getpgrp, getsid, kill_current_process_group};
use signal_hook::{
    consts::{SIGCONT, SIGTSTP},
    flag,
    low_level::emulate_default_handler,
};

use super::background::{QUERY, Reply, Sifted};
use crate::theme::Look;

/// Events that may wait to be obeyed.
pub const BACKLOG: usize = 1024;

/// Maximum wait for the colour of the background before the first frame. A terminal that
/// replies later changes the colours of a later frame.
const PATIENCE: Duration = Duration::from_millis(100);

/// Returns whether there is a terminal to draw on and to read keys from.
pub fn is_there() -> bool {
    stdin().is_terminal() && stdout().is_terminal()
}

/// The terminal while the dashboard has it; dropping gives it back.
///
/// Ratatui's own terminal is never dropped: where it cannot show the cursor it prints that to
/// standard error, and printing to a terminal that is gone panics.
pub struct Screen(pub ManuallyDrop<Terminal<CrosstermBackend<Stdout>>>);

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
        screen.map(|screen| Self(ManuallyDrop::new(screen)))
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
    /// Returns the next event, if one comes within `timeout`.
    ///
    /// # Errors
    /// If the source fails.
    fn next(&mut self, timeout: Duration) -> io::Result<Option<Event>>;

    /// Returns the look for the terminal's background, if the terminal has reported it since the
    /// last call.
    fn look(&mut self) -> Option<Look> {
        None
    }

    /// Returns the newest request of the shell.
    fn request(&mut self) -> ShellRequest {
        ShellRequest::Stay
    }

    /// Asks the shell to stop the program, as Ctrl-Z does.
    fn ask_to_stop(&mut self) {}

    /// Stops the program at the shell's request until it is continued, with the terminal given
    /// back, or takes the terminal again after a stop without notice.
    ///
    /// # Errors
    /// If the terminal refuses.
    fn obey(&mut self, _request: ShellRequest) -> io::Result<()> {
        Ok(())
    }
}

/// Keys from the terminal, and signals from the shell.
pub struct Keyboard {
    events: Receiver<io::Result<Event>>,
    /// Events ready to be obeyed.
    ready: VecDeque<Event>,
    /// A report of the background that is arriving, and its result.
    reply: Reply,
    look: Option<Look>,
    /// The signals of job control.
    stop: Arc<AtomicBool>,
    go_on: Arc<AtomicBool>,
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
        let keyboard = Self {
            events,
            ready: VecDeque::new(),
            reply: Reply::default(),
            look: None,
            stop: Arc::default(),
            go_on: Arc::default(),
        };
        flag::register(SIGTSTP, keyboard.stop.clone())?;
        flag::register(SIGCONT, keyboard.go_on.clone())?;
        Ok(keyboard)
    }

    /// Asks the terminal for its background, and waits a moment for the reply. All keys
    /// that are typed meanwhile stay.
    ///
    /// # Errors
    /// If the terminal fails.
    pub fn ask_background(&mut self) -> io::Result<()> {
        execute!(stdout(), Print(QUERY))?;
        let deadline = Instant::now() + PATIENCE;
        while self.look.is_none() && self.ready.len() < BACKLOG {
            let left = deadline.saturating_duration_since(Instant::now());
            match self.events.recv_timeout(left) {
                Ok(event) => self.sift(event?),
                Err(_) => return Ok(()),
            }
        }
        Ok(())
    }

    fn sift(&mut self, event: Event) {
        match self.reply.next(event) {
            Sifted::Held => {}
            Sifted::Keys(keys) => self.ready.extend(keys),
            Sifted::Look(look) => self.look = Some(look),
        }
    }
}

impl Input for Keyboard {
    fn next(&mut self, timeout: Duration) -> io::Result<Option<Event>> {
        if let Some(event) = self.ready.pop_front() {
            return Ok(Some(event));
        }
        match self.events.recv_timeout(timeout) {
            Ok(event) => {
                self.sift(event?);
                Ok(self.ready.pop_front())
            }
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err(io::ErrorKind::UnexpectedEof.into()),
        }
    }

    fn look(&mut self) -> Option<Look> {
        self.look.take()
    }

    fn request(&mut self) -> ShellRequest {
        // Without a shell that could continue the program, it does not stop.
        if self.stop.swap(false, Ordering::Relaxed) && has_shell() {
            ShellRequest::Stop
        } else if self.go_on.swap(false, Ordering::Relaxed) {
            ShellRequest::GoOn
        } else {
            ShellRequest::Stay
        }
    }

    /// Does what the terminal does on Ctrl-Z: the whole pipeline is to stop.
    fn ask_to_stop(&mut self) {
        if has_shell() {
            // The process itself may always be sent a signal.
            let _ = kill_current_process_group(Signal::TSTP);
        }
    }

    fn obey(&mut self, request: ShellRequest) -> io::Result<()> {
        // The shell may have set modes of its own meanwhile.
        restore();
        if request == ShellRequest::Stop {
            // Returns when the program is continued.
            emulate_default_handler(SIGTSTP)?;
            self.go_on.store(false, Ordering::Relaxed);
        }
        take()
    }
}

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

/// Returns whether a shell with job control started the program: it gives each job a process group
/// of its own, which then is not that of the session's first process.
fn has_shell() -> bool {
    getsid(None).is_ok_and(|session| session != getpgrp())
}
