//! Signals that stop a run or the program, and the one for the limit of file sizes.

#[cfg(feature = "network")]
mod stop;

use std::{
    fs, io,
    ops::ControlFlow,
    sync::{
        Arc, Mutex, OnceLock,
        atomic::{AtomicBool, AtomicI32, Ordering},
        mpsc::{RecvTimeoutError, channel},
    },
    thread,
    time::{Duration, Instant},
};

use ratelab::{Interrupt, sync::lock};
use ratelab_cart_pole::policy::end_programs;
use ratelab_recording::Recorder;
use ratelab_system::file::remove_unfinished;
use signal_hook::{
    consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ},
    flag,
    iterator::Signals,
    low_level::{self, signal_name},
};

/// Time for the answer of a policy in a program, when the command is to stop.
const GRACE: Duration = Duration::from_millis(100);

/// Time between two looks at whether a stop was asked for.
const LOOK: Duration = Duration::from_millis(20);

/// The last signal; 0 before the first.
static RECEIVED: AtomicI32 = AtomicI32::new(0);

/// When the first signal came.
static FIRST: OnceLock<Instant> = OnceLock::new();

/// Time after a signal for what a command can do without.
const PATIENCE: Duration = Duration::from_millis(300);

#[cfg(feature = "network")]
pub use stop::Stop;

/// How the handler of signals reaches the person.
#[derive(Clone, Copy)]
pub struct Messages {
    /// Prints a note.
    pub note: fn(&str),
    /// Prints an error.
    pub error: fn(&str),
    /// Prints which signal ended the command.
    pub stopped_by: fn(&str),
    /// Returns whether a reader is awaited, whose error says more.
    pub waits_for_reader: fn() -> bool,
}

/// What a command does at a signal.
struct Response {
    /// At the first one; `None` once it is done.
    first: Option<Box<dyn FnOnce() + Send>>,
    /// Before the program ends at the next one.
    last: Box<dyn FnOnce() + Send>,
}

/// Without a response the first signal ends the program.
static RESPONSE: Mutex<Option<Response>> = Mutex::new(None);

/// Handles signals from now on: SIGINT, SIGTERM and SIGHUP, but none that was ignored when the
/// program started, as `nohup` and background jobs of scripts ask for. The first one ends the
/// program at once, or does what the command [watches](watch) for.
///
/// Turns the limit of file sizes (`ulimit -f`) into a write error, like a full disk, in place of
/// a fatal signal.
pub fn prepare(say: Messages) {
    // An empty handler: the viewer would inherit an ignored signal.
    let _ = flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)));
    let ignored = ignored();
    let heeded = [SIGINT, SIGTERM, SIGHUP].into_iter();
    match Signals::new(heeded.filter(|signal| ignored >> (signal - 1) & 1 == 0)) {
        Ok(signals) => drop(thread::spawn(move || obey(signals, say))),
        Err(error) => (say.note)(&format!("Ctrl-C will end the program at once: {error}")),
    }
}

/// Returns the signals that are ignored, a bit for each; none where the system does not say so.
fn ignored() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
        .unwrap_or_default()
}

/// Time after the first signal in which the next one ends nothing: `timeout` and shells send a signal
/// to a process and to its group, and what the first one began may end in order.
const TOGETHER: Duration = Duration::from_secs(1);

/// Longest time after the first signal for the end of recordings, which a busy machine needs after a run
/// at full speed.
const LONGEST_END: Duration = Duration::from_secs(5);

/// Does what is to be done at the first signal, and ends the program at the next. A second
/// SIGHUP is ignored: a closing terminal may send several.
fn obey(mut signals: Signals, say: Messages) {
    let mut arriving = signals.forever();
    if let Some(signal) = arriving.next() {
        received(signal);
        let first = lock(&RESPONSE).as_mut().and_then(|of| of.first.take());
        match first {
            Some(first) => {
                first();
                thread::spawn(|| {
                    thread::sleep(GRACE);
                    end_programs();
                });
            }
            // The wait ends with an error that says for what it was.
            None if (say.waits_for_reader)() => {}
            None => {
                (say.stopped_by)(name(signal));
                end_at_once();
            }
        }
    }
    if let Some(signal) = arriving.find(|signal| *signal != SIGHUP) {
        received(signal);
        let is_same = age() < TOGETHER;
        thread::sleep(TOGETHER.saturating_sub(age()));
        if is_same {
            // What came along with the first one is the same wish.
            signals.pending().for_each(drop);
            await_recordings(|| signals.pending().all(|signal| signal == SIGHUP));
        }
        let response = lock(&RESPONSE).take();
        if let Some(response) = response {
            (response.last)();
        }
        if Recorder::any_is_open() {
            let name = name(signal);
            (say.error)(&format!(
                "stopped by {name} before the recording was complete: ratelab info says how much \
                 of the run it holds"
            ));
        }
        end_at_once();
    }
}

/// Waits until recordings are complete while that `may` go on, but no longer than
/// [`LONGEST_END`] after the first signal.
pub fn await_recordings(mut may: impl FnMut() -> bool) {
    while Recorder::any_is_open() && age() < LONGEST_END && may() {
        thread::sleep(LOOK);
    }
}

/// From now on the first signal calls `first`, which should end the program normally; the next
/// one calls `last` and ends the program at once.
pub fn watch(first: impl FnOnce() + Send + 'static, last: impl FnOnce() + Send + 'static) {
    *lock(&RESPONSE) = Some(Response {
        first: Some(Box::new(first)),
        last: Box::new(last),
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

/// Returns whether what goes on is to go on, or somebody has asked for a stop.
pub fn unless(asked: &Interrupt) -> ControlFlow<()> {
    if asked.is_asked() {
        ControlFlow::Break(())
    } else {
        ControlFlow::Continue(())
    }
}

/// Returns what `work` returns; `None` if a stop is `asked` for meanwhile: then the work is left to
/// a thread that ends with the program.
///
/// # Errors
/// An error if the work panicked.
pub fn done_unless<T: Send + 'static>(
    asked: &Interrupt,
    work: impl FnOnce() -> T + Send + 'static,
) -> io::Result<Option<T>> {
    let (sender, done) = channel();
    // Nobody waits for the result any more if it cannot be sent.
    thread::spawn(move || drop(sender.send(work())));
    while !asked.is_asked() {
        match done.recv_timeout(LOOK) {
            Ok(result) => return Ok(Some(result)),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                return Err(io::Error::other("it panicked, which is a defect"));
            }
        }
    }
    Ok(None)
}

/// Ends the program immediately after a signal.
pub fn end_at_once() -> ! {
    end_programs();
    let _no_more = remove_unfinished();
    // Skips exit handlers, because other threads are still running.
    low_level::exit(exit_code().unwrap_or(1).into())
}

/// Notes that `signal` has come.
fn received(signal: i32) {
    FIRST.get_or_init(Instant::now);
    RECEIVED.store(signal, Ordering::Relaxed);
}

/// Returns 128 + n after signal n, as a shell reports it; `None` without a signal.
pub fn exit_code() -> Option<u8> {
    let signal = RECEIVED.load(Ordering::Relaxed);
    let code = u8::try_from(128 + signal).ok();
    code.filter(|_| signal != 0)
}

/// Returns whether a signal came so long ago that only what must be done is to be done.
pub fn is_overdue() -> bool {
    age() > PATIENCE
}

/// Returns the time since the first signal; zero before it.
fn age() -> Duration {
    FIRST.get().map(Instant::elapsed).unwrap_or_default()
}

/// Returns the name of `signal`, such as `SIGTERM`.
fn name(signal: i32) -> &'static str {
    signal_name(signal).unwrap_or("a signal")
}
