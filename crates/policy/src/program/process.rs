//! The process of a program.

use std::{
    io::{BufRead, BufReader, Error, ErrorKind, Read, Write},
    os::unix::process::{CommandExt, ExitStatusExt},
    path::Path,
    process::{Child, ChildStdin, Command, ExitStatus, Stdio},
    sync::{
        Arc, Mutex, Weak,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded};
use ratelab::sync::lock;
use rustix::process::{Pid, Signal, kill_process_group};

use super::recorded::ProcessMark;
use crate::ProgramError;

/// The longest line of an answer (bytes).
const LONGEST_LINE: u64 = 64 << 10;

/// The longest line of standard error that is shown (bytes).
const LONGEST_ERROR: usize = 200;

/// Time to end after the end of its input, and for the last line of its standard error.
const GRACE: Duration = Duration::from_millis(200);

/// All processes that may run.
static RUNNING: Mutex<Vec<Weak<Mutex<MarkedChild>>>> = Mutex::new(Vec::new());

/// Whether the whole command ends.
static ENDED: AtomicBool = AtomicBool::new(false);

/// Ends all programs at once, and starts no more: for the end of a command that must not wait
/// for an answer.
pub fn end_programs() {
    let running = lock(&RUNNING);
    ENDED.store(true, Ordering::SeqCst);
    for child in running.iter().filter_map(Weak::upgrade) {
        lock(&child).kill();
    }
}

/// A process, and the mark by which what it has started is known.
struct MarkedChild {
    child: Child,
    mark: ProcessMark,
}

impl MarkedChild {
    fn kill(&mut self) {
        self.kill_started();
        let _ = self.child.kill(); // It may have ended.
        let _ = self.child.wait();
    }

    /// Ends what it has started.
    fn kill_started(&self) {
        // Its group may be empty.
        let _ = kill_process_group(Pid::from_child(&self.child), Signal::KILL);
        self.mark.kill_all();
    }
}

/// A line of a program, or why there is none.
type Line = Result<String, ProgramError>;

/// A running program, ended when this is dropped.
pub struct PolicyProcess {
    child: Arc<Mutex<MarkedChild>>,
    input: Option<ChildStdin>,
    lines: Receiver<Line>,
    /// The last line of its standard error, and the end of that.
    error: Arc<Mutex<Vec<u8>>>,
    errors_ended: Receiver<()>,
}

impl PolicyProcess {
    /// Starts the program at `path`.
    ///
    /// # Errors
    /// What is wrong, as the end of a sentence about it.
    pub fn start(path: &str) -> Result<Self, ProgramError> {
        // A name without a folder would be looked for elsewhere.
        let mut command = Command::new(Path::new(".").join(path));
        command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        // A group of its own: Ctrl-C in the terminal is for the lab, and what the program has
        // started ends with it.
        command.process_group(0);
        let mark = ProcessMark::new();
        mark.put_on(&mut command);
        let mut running = lock(&RUNNING);
        if ENDED.load(Ordering::SeqCst) {
            return Err(ProgramError::CommandEnds);
        }
        let mut child = command.spawn().map_err(|why| not_started(&why))?;
        let input = child.stdin.take();
        let (output, errors) = (child.stdout.take(), child.stderr.take());
        let child = Arc::new(Mutex::new(MarkedChild { child, mark }));
        running.retain(|child| child.strong_count() > 0);
        running.push(Arc::downgrade(&child));
        drop(running);
        let ((put, lines), (ended, errors_ended)) = (bounded(1), bounded(0));
        let error = Arc::<Mutex<Vec<u8>>>::default();
        let last = error.clone();
        thread::spawn(move || output.map(|output| read_lines(output, &put)));
        thread::spawn(move || {
            let _ended = ended; // With the thread.
            errors.map(|errors| keep_last_line(errors, &last))
        });
        Ok(Self {
            child,
            input,
            lines,
            error,
            errors_ended,
        })
    }

    /// Sends a line, and returns the next one of the program.
    ///
    /// # Errors
    /// Why there is none within `limit`, as the end of a sentence about the program.
    pub fn ask(&mut self, line: &str, limit: Duration) -> Result<String, ProgramError> {
        if self.lines.try_recv().is_ok() {
            return Err(ProgramError::NoQuestion);
        }
        let sent = self.input.as_mut().map(|input| {
            input.write_all(line.as_bytes())?;
            input.flush()
        });
        // A program that reads no more has ended, or will not answer.
        drop(sent);
        match self.lines.recv_timeout(limit) {
            Ok(line) => line,
            Err(RecvTimeoutError::Timeout) => {
                self.end(Duration::ZERO);
                Err(ProgramError::Timeout(limit))
            }
            Err(RecvTimeoutError::Disconnected) => Err(ProgramError::Ended(self.end_text())),
        }
    }

    /// Returns how it ended, with the last line of its standard error.
    fn end_text(&mut self) -> String {
        let status = self.end(GRACE);
        let _ = self.errors_ended.recv_timeout(GRACE);
        let how = status.map_or_else(|| "closed its output".to_owned(), how_it_ended);
        match String::from_utf8_lossy(&lock(&self.error)).trim() {
            "" => how,
            error => format!("{how}, saying {error:?}"),
        }
    }

    /// Ends its input, and after the `grace` the program itself; `None` if it had not ended.
    fn end(&mut self, grace: Duration) -> Option<ExitStatus> {
        self.input = None;
        let until = Instant::now() + grace;
        loop {
            let mut child = lock(&self.child);
            if let Ok(Some(status)) = child.child.try_wait() {
                child.kill_started();
                return Some(status);
            }
            if Instant::now() >= until {
                child.kill();
                return None;
            }
            drop(child);
            thread::sleep(Duration::from_millis(1));
        }
    }
}

impl Drop for PolicyProcess {
    fn drop(&mut self) {
        self.end(GRACE);
    }
}

/// Puts the lines of `output`, up to its end or to one that is none.
fn read_lines(output: impl Read, lines: &Sender<Line>) {
    let mut output = BufReader::new(output);
    loop {
        let mut line = Vec::new();
        let read = output
            .by_ref()
            .take(LONGEST_LINE)
            .read_until(b'\n', &mut line);
        if !read.is_ok_and(|bytes| bytes > 0) {
            return;
        }
        let is_long = line.len() as u64 == LONGEST_LINE && line.last() != Some(&b'\n');
        let line = match String::from_utf8(line) {
            _ if is_long => Err(ProgramError::LongLine),
            Ok(line) => Ok(line.trim_end().to_owned()),
            Err(_) => Err(ProgramError::NotText),
        };
        if lines.send(line).is_err() {
            return;
        }
    }
}

/// Reads all of `errors`, and keeps the beginning of the last line that is not empty.
fn keep_last_line(errors: impl Read, last: &Mutex<Vec<u8>>) {
    let mut errors = BufReader::new(errors);
    loop {
        let mut line = Vec::new();
        let most = LONGEST_ERROR as u64;
        match errors.by_ref().take(most).read_until(b'\n', &mut line) {
            Ok(0) | Err(_) => return,
            Ok(_) if line.ends_with(b"\n") => {}
            Ok(_) => drop(errors.skip_until(b'\n')), // At its end the next read fails.
        }
        if !line.trim_ascii().is_empty() {
            *lock(last) = line;
        }
    }
}

fn not_started(why: &Error) -> ProgramError {
    match why.kind() {
        ErrorKind::NotFound => ProgramError::InterpreterMissing,
        _ => ProgramError::NotStarted(why.to_string()),
    }
}

fn how_it_ended(status: ExitStatus) -> String {
    if let Some(signal) = status.signal() {
        return format!("was ended by signal {signal}");
    }
    let code = status
        .code()
        .map_or("none".to_owned(), |code| code.to_string());
    format!("ended with exit code {code}")
}
