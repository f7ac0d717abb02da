//! A terminal with ratelab in it, controlled by a test.

use std::{
    fs,
    io::{self, Read, Write},
    path::Path,
    sync::mpsc::{Receiver, RecvTimeoutError, channel},
    thread,
    time::{Duration, Instant},
};

use portable_pty::{Child, CommandBuilder, ExitStatus, MasterPty, PtySize, native_pty_system};

use super::{RATELAB, assert_outside, heed_signals, words};

/// Time limit for output that usually takes a fraction of a second.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// A terminal with ratelab in it.
pub struct Lab {
    pub child: Box<dyn Child + Send + Sync>,
    master: Box<dyn MasterPty + Send>,
    keys: Box<dyn Write + Send>,
    output: Receiver<Vec<u8>>,
    pub parser: vt100::Parser,
    /// The line modes of the terminal before any program ran in it.
    pub first_modes: String,
}

impl Lab {
    /// Opens ratelab with the options in `line`.
    pub fn open(line: &str, rows: u16, cols: u16) -> Self {
        assert_outside();
        Self::open_in(&std::env::temp_dir(), line, rows, cols)
    }

    pub fn open_in(folder: &Path, line: &str, rows: u16, cols: u16) -> Self {
        Self::start(command_in(folder, line), rows, cols)
    }

    /// Starts a program that draws on a terminal.
    pub fn start(mut command: CommandBuilder, rows: u16, cols: u16) -> Self {
        let size = size(rows, cols);
        let pair = native_pty_system().openpty(size).expect("a pty");
        let first_modes = modes(&*pair.master);
        command.env("TERM", "xterm-256color");
        let child = pair.slave.spawn_command(command).expect("ratelab starts");
        drop(pair.slave);
        let mut reader = pair.master.try_clone_reader().expect("output");
        let keys = pair.master.take_writer().expect("input");
        let (sender, output) = channel();
        thread::spawn(move || {
            let mut chunk = [0; 4096];
            while let Ok(length @ 1..) = reader.read(&mut chunk) {
                if sender.send(chunk[..length].to_vec()).is_err() {
                    return;
                }
            }
        });
        Self {
            child,
            master: pair.master,
            keys,
            output,
            parser: vt100::Parser::new(rows, cols, 0),
            first_modes,
        }
    }

    pub fn type_keys(&mut self, keys: &str) {
        self.send(keys.as_bytes()).expect("typed");
    }

    /// Sends bytes; fails after the end of the program.
    pub fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.keys.write_all(bytes)?;
        self.keys.flush()
    }

    /// The line modes of the terminal, in a comparable form.
    pub fn modes(&self) -> String {
        modes(&*self.master)
    }

    pub fn resize(&mut self, rows: u16, cols: u16) {
        self.tell_size(rows, cols);
        self.parser.screen_mut().set_size(rows, cols);
    }

    /// Resizes the terminal, but not the test's copy of the screen.
    pub fn tell_size(&self, rows: u16, cols: u16) {
        self.master.resize(size(rows, cols)).expect("resized");
    }

    pub fn screen(&self) -> String {
        self.parser.screen().contents()
    }

    /// Reads the screen until it shows `text`.
    pub fn wait_for(&mut self, text: &str) {
        let came = self.read_until(|screen| screen.contains(text));
        let screen = self.screen();
        assert!(came, "{text:?} never came; the screen shows\n{screen}");
    }

    /// For each of `moments`, presses its keys and waits for its text.
    pub fn play(&mut self, moments: &[(&str, &str)]) {
        for (keys, text) in moments {
            self.type_keys(keys);
            self.wait_for(text);
        }
    }

    /// Reads the screen until `text` is gone.
    pub fn wait_without(&mut self, text: &str) {
        let went = self.read_until(|screen| !screen.contains(text));
        assert!(went, "{text:?} stayed; the screen shows\n{}", self.screen());
    }

    /// Reads until the screen is as `wanted`; `false` after the time limit.
    pub fn read_until(&mut self, wanted: impl Fn(&str) -> bool) -> bool {
        let deadline = Instant::now() + PATIENCE;
        while !wanted(&self.screen()) {
            let left = deadline.saturating_duration_since(Instant::now());
            match self.output.recv_timeout(left) {
                Ok(chunk) if !left.is_zero() => self.parser.process(&chunk),
                _ => return false,
            }
        }
        true
    }

    /// Reads more output within `patience`; `false` at the end of the output.
    pub fn read_more(&mut self, patience: Duration) -> bool {
        match self.output.recv_timeout(patience) {
            Ok(chunk) => self.parser.process(&chunk),
            Err(RecvTimeoutError::Disconnected) => return false,
            Err(RecvTimeoutError::Timeout) => {}
        }
        true
    }

    /// Presses `keys`, with which it ends successfully and gives the terminal back; returns what
    /// is on the screen then.
    pub fn quit(mut self, keys: &str) -> String {
        self.type_keys(keys);
        let (status, parser) = self.close();
        assert!(status.success(), "{status:?} after {keys:?}");
        assert_given_back(&parser);
        parser.screen().contents()
    }

    /// Reads the remaining output and waits for the end.
    pub fn close(mut self) -> (ExitStatus, vt100::Parser) {
        let deadline = Instant::now() + PATIENCE;
        // Output ends with the program: its children are not waited for.
        while let Some(chunk) = self.chunk(deadline) {
            self.parser.process(&chunk);
        }
        let parser = std::mem::replace(&mut self.parser, vt100::Parser::new(1, 1, 0));
        (self.child.wait().expect("ended"), parser)
    }

    /// More output; `None` at its end.
    ///
    /// # Panics
    /// If there is neither more output nor an end by `deadline`.
    fn chunk(&self, deadline: Instant) -> Option<Vec<u8>> {
        let left = deadline.saturating_duration_since(Instant::now());
        match self.output.recv_timeout(left) {
            Ok(chunk) if !left.is_zero() => Some(chunk),
            Err(RecvTimeoutError::Disconnected) => None,
            _ => panic!("it does not end; the screen shows\n{}", self.screen()),
        }
    }
}

/// Checks that a program left the terminal as a shell needs it.
pub fn assert_given_back(parser: &vt100::Parser) {
    let screen = parser.screen();
    assert!(!screen.alternate_screen(), "still on the other screen");
    assert!(!screen.hide_cursor(), "the cursor is hidden");
    assert!(!screen.bracketed_paste(), "pastes are still bracketed");
}

/// Ratelab with the words of `line`, in `folder`.
pub fn command_in(folder: &Path, line: &str) -> CommandBuilder {
    heed_signals();
    let mut command = CommandBuilder::new(RATELAB);
    command.args(words(line));
    command.cwd(folder);
    // Protects the predictions of the user who runs the test.
    command.env("HOME", folder);
    command.env_remove("XDG_DATA_HOME");
    command.env_remove("XDG_STATE_HOME");
    command.env("TERM", "xterm-256color");
    started_before(folder);
    command
}

fn size(rows: u16, cols: u16) -> PtySize {
    PtySize {
        rows,
        cols,
        ..PtySize::default()
    }
}

fn modes(terminal: &dyn MasterPty) -> String {
    format!("{:?}", terminal.get_termios())
}

impl Drop for Lab {
    /// Stops the lab even when a test fails.
    fn drop(&mut self) {
        let _ = self.child.kill();
    }
}

/// Makes it not the first start of the user with the home folder `home`, to whom a tour is
/// offered.
fn started_before(home: &Path) {
    let folder = home.join(".local/state/ratelab");
    fs::create_dir_all(&folder).expect("folder");
    fs::write(folder.join("started"), "").expect("written");
}
