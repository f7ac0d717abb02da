//! What the ticks of a node take and how late they start: a model of the machine
//! that a graph is to run on.

use std::{ops::ControlFlow, time::Duration};

use super::{chance::Chance, cost::Cost, draw::Draw, time::Time};

/// The timing of a node for which something was asked.
#[derive(Debug)]
pub(crate) struct Timing {
    /// What a tick takes.
    pub(crate) takes: Cost,
    /// How late a tick starts in virtual time.
    pub(crate) wakes: Draw,
    /// What the next tick takes instead, once.
    pub(crate) hang: Option<Duration>,
    /// A tick that was due and is still to start.
    pub(crate) waiting: Option<Waiting>,
    /// A tick that has started and is not over.
    pub(crate) running: Option<Running>,
}

/// A tick that is late.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Waiting {
    pub(crate) due: Time,
    pub(crate) starts: Time,
}

/// A tick that takes time.
#[derive(Debug)]
pub(crate) struct Running {
    pub(crate) began: Time,
    pub(crate) ends: Time,
    pub(crate) lateness: Option<Duration>,
    /// Whether it keeps a core busy under the real clock.
    pub(crate) busy: bool,
    /// Whether to end the run when it is over.
    pub(crate) flow: ControlFlow<()>,
    /// Whether it was noted before it was over, because the run ended.
    pub(crate) noted: bool,
}

impl Default for Timing {
    fn default() -> Self {
        Self {
            takes: Cost::NONE,
            wakes: Draw::NONE,
            hang: None,
            waiting: None,
            running: None,
        }
    }
}

impl Timing {
    /// What tick number `n`, which starts, takes, if it was asked to take something.
    pub(crate) fn cost(&mut self, seed: u64, node: &str, n: u64) -> Option<Duration> {
        let asked = !self.takes.draw.is_none();
        let usual = || draw(&self.takes.draw, seed, "takes", node, n);
        self.hang.take().or_else(|| asked.then(usual))
    }

    /// How late tick number `n` starts.
    pub(crate) fn lateness(&self, seed: u64, node: &str, n: u64) -> Duration {
        draw(&self.wakes, seed, "wakes", node, n)
    }

    /// Until when no other tick can start, if one is on its way.
    pub(crate) fn occupied_until(&self) -> Option<Time> {
        let waiting = self.waiting.map(|waiting| waiting.starts + Time::TICK);
        waiting.or(self.running.as_ref().map(|running| running.ends))
    }
}

fn draw(draw: &Draw, seed: u64, what: &str, name: &str, n: u64) -> Duration {
    match draw {
        Draw::Constant(duration) => *duration,
        draw => draw.at(Chance { seed, what, name }.uniform(n)),
    }
}
