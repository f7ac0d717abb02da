//! The source of a clock's commands.

use std::{
    collections::VecDeque,
    sync::atomic::{AtomicBool, Ordering},
};

use crossbeam_channel::{Receiver, Sender};

use super::command::{Command, TimedCommand};
use crate::{
    sync::{Arc, Instant},
    time::Time,
};

/// The commands of a run: timed commands known in advance, and live ones that arrive
/// while it runs. A run without commands uses [`Inbox::default`].
///
/// ```
/// use ratelab::{Clock, ClockExit, Command, Graph, Inbox, Time, TimedCommand, VirtualClock};
///
/// let at = Time::from_secs_f64(2.0)?;
/// let (_live, mut inbox) = Inbox::new(vec![TimedCommand { at, command: Command::Stop }]);
/// let exit = VirtualClock.run(&mut Graph::new(), &mut inbox, Time::MAX)?;
/// assert_eq!(exit, ClockExit::Stopped);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Inbox {
    timed: VecDeque<TimedCommand>,
    live: Receiver<Command>,
    interrupt: Option<Interrupt>,
}

/// A request to stop, for any number of runs under the virtual clock, now and later. Clones are
/// handles to the same request.
#[derive(Clone, Debug, Default)]
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Asks for a stop.
    pub fn ask(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Returns whether somebody has asked.
    pub fn is_asked(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// How long to wait for a live command.
#[derive(Clone, Copy, Debug)]
pub enum Wait {
    /// Not at all.
    None,
    /// Until a moment.
    Until(Instant),
    /// As long as there are senders.
    Forever,
}

/// Whatever came first.
#[derive(Debug)]
pub enum Received<T> {
    /// A command.
    Command(Command),
    /// A message of the other channel.
    Other(T),
    /// The deadline passed.
    Timeout,
}

impl Default for Inbox {
    /// Creates an inbox that stays empty.
    fn default() -> Self {
        Self::new(Vec::new()).1
    }
}

impl Inbox {
    /// Creates an inbox with a list of timed commands, and the sender for live ones.
    /// Commands with the same time keep their order.
    pub fn new(timed: Vec<TimedCommand>) -> (Sender<Command>, Self) {
        let (sender, live) = crossbeam_channel::unbounded();
        let mut inbox = Self {
            timed: VecDeque::new(),
            live,
            interrupt: None,
        };
        inbox.schedule(timed);
        (sender, inbox)
    }

    /// Adds timed commands; each comes after the existing ones of the same time.
    pub fn schedule(&mut self, commands: Vec<TimedCommand>) {
        self.timed.extend(commands);
        self.timed.make_contiguous().sort_by_key(|timed| timed.at);
    }

    /// Lets `interrupt` stop the run, between two instants of unpaced virtual time.
    pub fn stop_on(&mut self, interrupt: &Interrupt) {
        self.interrupt = Some(interrupt.clone());
    }

    /// Returns the time of the next timed command; [`Time::MAX`] if there is none before the end.
    pub fn next_timed(&self, end: Time) -> Time {
        self.timed
            .front()
            .map(|timed| timed.at)
            .filter(|at| *at <= end)
            .unwrap_or(Time::MAX)
    }

    /// Returns the next timed command, if one is before the end.
    pub fn take_timed(&mut self, end: Time) -> Option<TimedCommand> {
        self.timed.pop_front_if(|timed| timed.at <= end)
    }
}

#[cfg(not(feature = "model"))]
impl Inbox {
    /// Returns whether the run is to stop at once.
    fn is_interrupted(&self) -> bool {
        self.interrupt.as_ref().is_some_and(Interrupt::is_asked)
    }

    /// Waits for the next live command; `None` if the wait is over, or at once if all
    /// senders are gone and the wait would be forever.
    pub fn receive(&self, wait: Wait) -> Option<Command> {
        use crossbeam_channel::RecvTimeoutError;
        match wait {
            // Called between any two instants; a check for emptiness costs less than an
            // attempt to receive.
            Wait::None if self.is_interrupted() => Some(Command::Stop),
            Wait::None if self.live.is_empty() => None,
            Wait::None => self.live.try_recv().ok(),
            Wait::Forever => self.live.recv().ok(),
            Wait::Until(deadline) => match self.live.recv_deadline(deadline) {
                Ok(command) => Some(command),
                Err(RecvTimeoutError::Timeout) => None,
                Err(RecvTimeoutError::Disconnected) => {
                    let now = Instant::now();
                    std::thread::sleep(deadline.saturating_duration_since(now));
                    None
                }
            },
        }
    }

    /// Waits for the next live command or the next message of `others`.
    pub fn receive_or<T>(&self, others: &Receiver<T>, deadline: Instant) -> Received<T> {
        use crossbeam_channel::{TryRecvError, never, select_biased};
        let live = match self.live.try_recv() {
            Ok(command) => return Received::Command(command),
            Err(TryRecvError::Empty) => &self.live,
            // A closed channel is always ready; waiting on it would spin.
            Err(TryRecvError::Disconnected) => &never(),
        };
        select_biased! {
            recv(others) -> other => other.map_or(Received::Timeout, Received::Other),
            recv(live) -> command => command.map_or(Received::Timeout, Received::Command),
            default(deadline.saturating_duration_since(Instant::now())) => Received::Timeout,
        }
    }
}

#[cfg(feature = "model")]
use crate::sync::thread;

/// Under the model checker nothing may block outside of its scheduler, so this polls.
#[cfg(feature = "model")]
impl Inbox {
    /// Waits for the next live command.
    pub fn receive(&self, wait: Wait) -> Option<Command> {
        use crossbeam_channel::TryRecvError;
        loop {
            match (self.live.try_recv(), wait) {
                (Ok(command), _) => return Some(command),
                (_, Wait::None) | (Err(TryRecvError::Disconnected), Wait::Forever) => return None,
                (_, Wait::Until(deadline)) if Instant::now() >= deadline => return None,
                _ => thread::yield_now(),
            }
        }
    }

    /// Waits for the next live command or the next message of `others`.
    pub fn receive_or<T>(&self, others: &Receiver<T>, deadline: Instant) -> Received<T> {
        loop {
            if let Ok(other) = others.try_recv() {
                return Received::Other(other);
            }
            if let Ok(command) = self.live.try_recv() {
                return Received::Command(command);
            }
            if Instant::now() >= deadline {
                return Received::Timeout;
            }
            thread::yield_now();
        }
    }
}
