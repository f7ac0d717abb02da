//! A node in a graph: what it does, when, and what is known of it.

use std::{
    error::Error,
    panic::{AssertUnwindSafe, catch_unwind},
    time::Duration,
};

use super::{
    command::Command,
    knob::Knob,
    node::{Fault, Node, Panicked, Tick},
    rate::Rate,
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, Ordering},
        bump,
    },
    tap::{TickRecord, TickTaps},
    telemetry::{Meter, MeterRecorder, NodeEntry},
    time::{Hz, Time},
};

/// A node in its place: when it ticks and what is known of it.
pub(crate) struct ScheduledNode {
    pub(crate) entry: NodeEntry,
    pub(crate) rate: Rate,
    node: Box<dyn Node>,
    /// Its message if it panicked over a text that was sent to it.
    panicked: Option<Panicked>,
    lateness: MeterRecorder,
    tick_time: MeterRecorder,
    pub(crate) taps: Arc<TickTaps>,
}

impl ScheduledNode {
    pub(crate) fn new(
        name: &str,
        priority: u32,
        rate: Rate,
        node: Box<dyn Node>,
        meters: Vec<(String, Meter)>,
    ) -> Self {
        let (lateness, lateness_meter) = Meter::new();
        let (tick_time, tick_time_meter) = Meter::new();
        Self {
            entry: NodeEntry {
                name: name.into(),
                priority,
                ticks: Arc::new(AtomicU64::new(0)),
                overruns: Arc::new(AtomicU64::new(0)),
                busy: Arc::new(AtomicBool::new(false)),
                micro_hz: Arc::new(AtomicU64::new(rate.hz().as_micro())),
                lateness: lateness_meter,
                tick_time: tick_time_meter,
                meters,
            },
            rate,
            node,
            panicked: None,
            lateness,
            tick_time,
            taps: Arc::default(),
        }
    }

    /// Obeys a command that is for this node, at run time `at`; returns the value
    /// that it replaced, or why it was not obeyed.
    pub(crate) fn obey(&mut self, command: &Command, at: Time) -> Result<String, String> {
        match command {
            Command::Set(Knob::Rate { hz, .. }) => Ok(self.set_hz(*hz, at).to_string()),
            Command::Set(Knob::Send { text: what, .. }) => self.send(what),
            other => Err(format!("{other} is not for a node")),
        }
    }

    /// Sends the node a text. If it panics over that, it may be half of what
    /// it was, and its next tick fails.
    fn send(&mut self, text: &str) -> Result<String, String> {
        let answer = catch_unwind(AssertUnwindSafe(|| self.node.on_message(text)));
        answer.unwrap_or_else(|panic| {
            let panicked = Panicked(panic_message(&*panic));
            let reason = panicked.to_string();
            self.panicked = Some(panicked);
            Err(reason)
        })
    }

    /// Changes the node's rate at run time `at`; returns the one before.
    fn set_hz(&mut self, hz: Hz, at: Time) -> Hz {
        let before = self.rate.hz();
        self.rate.set_hz(hz, at);
        self.entry.micro_hz.store(hz.as_micro(), Ordering::Relaxed);
        before
    }

    /// Lets the node work. A panic in it is an error like any other.
    pub(crate) fn tick(&mut self, now: Time) -> Tick {
        let outcome = match self.panicked.take() {
            Some(panicked) => Ok(Err(panicked.into())),
            None => catch_unwind(AssertUnwindSafe(|| self.node.tick(now))),
        };
        bump(&self.entry.ticks);
        outcome.unwrap_or_else(|panic| Err(Box::new(Panicked(panic_message(&*panic)))))
    }

    /// What a tick at `at` that returned an error is to the run.
    pub(crate) fn fault(&self, at: Time, cause: Box<dyn Error + Send + Sync>) -> Fault {
        Fault {
            node: self.entry.name.to_string(),
            at,
            cause,
        }
    }

    /// Moves on past the periods that went by until `now`, and counts them.
    pub(crate) fn advance_past(&mut self, now: Time) {
        let missed = self.rate.advance_past(now);
        if missed > 0 {
            self.entry.overruns.fetch_add(missed, Ordering::Relaxed);
        }
    }

    /// Notes what was measured of the tick that began at `at`, when the node has
    /// moved on past it.
    pub(crate) fn note_tick(
        &mut self,
        at: Time,
        lateness: Option<Duration>,
        took: Option<Duration>,
    ) {
        if let Some(lateness) = lateness {
            self.lateness.record(lateness);
        }
        if let Some(took) = took {
            self.tick_time.record(took);
        }
        let entry = &self.entry;
        self.taps.offer(|| TickRecord {
            number: entry.ticks.load(Ordering::Relaxed).saturating_sub(1),
            at,
            lateness,
            took,
            overruns: entry.overruns.load(Ordering::Relaxed),
        });
    }
}

fn panic_message(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "without a message".to_owned())
}
