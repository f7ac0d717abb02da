//! Duration and lateness of a node's ticks: a model of the target machine.

use std::{ops::ControlFlow, time::Duration};

use super::{chance::Chance, cost::Cost, draw::Draw, time::Time};

/// The configured timing of a node.
#[derive(Debug)]
pub(crate) struct TickTiming {
    /// Duration of a tick.
    pub(crate) takes: Cost,
    /// Lateness of a tick in virtual time.
    pub(crate) wakes: Draw,
    /// Duration of the next tick only, in place of the usual one.
    pub(crate) hang: Option<Duration>,
    /// A due tick that has not started yet.
    pub(crate) waiting: Option<Waiting>,
    /// A tick that has started and is not yet over.
    pub(crate) running: Option<Running>,
}

/// A late tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Waiting {
    pub(crate) due: Time,
    pub(crate) starts: Time,
}

/// A tick that takes time.
#[derive(Debug)]
pub struct Running {
    /// Run time of its start.
    pub began: Time,
    /// Run time of its end, while it has a core.
    pub ends: Time,
    pub(crate) lateness: Option<Duration>,
    /// Whether it keeps a core busy under the real clock.
    pub(crate) busy: bool,
    /// Whether the run ends after the tick.
    pub(crate) flow: ControlFlow<()>,
    /// Time on a core that it needs, while it has none.
    pub(crate) suspended: Option<Duration>,
    /// Whether the tick is already recorded, because the run ended before it was over.
    pub(crate) noted: bool,
}

impl Running {
    /// A tick that began at `began` and is over at `ends`.
    pub(crate) fn new(
        began: Time,
        ends: Time,
        lateness: Option<Duration>,
        flow: ControlFlow<()>,
    ) -> Self {
        Self {
            began,
            ends,
            lateness,
            busy: false,
            flow,
            suspended: None,
            noted: false,
        }
    }

    /// Time on a core that the tick needs from `now` on.
    pub fn remaining(&self, now: Time) -> Duration {
        self.suspended.unwrap_or_else(|| self.ends.since(now))
    }
}

impl Default for TickTiming {
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

impl TickTiming {
    /// Duration of tick number `n`, which starts now, if one is set.
    pub(crate) fn cost(&mut self, seed: u64, node: &str, n: u64) -> Option<Duration> {
        let asked = !self.takes.draw.is_none();
        let usual = || draw(&self.takes.draw, seed, "takes", node, n);
        self.hang.take().or_else(|| asked.then(usual))
    }

    /// Lateness of tick number `n`.
    pub(crate) fn lateness(&self, seed: u64, node: &str, n: u64) -> Duration {
        draw(&self.wakes, seed, "wakes", node, n)
    }

    /// Time until which no other tick can start, if a tick is waiting or running.
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
