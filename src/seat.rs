//! A node with its measurements: what does the work, on whatever thread.

use std::{
    any::Any,
    ops::ControlFlow,
    panic::{AssertUnwindSafe, catch_unwind},
    time::Duration,
};

use super::{
    knob::{Knob, KnobKind},
    local_clock::LocalClock,
    node::{Fault, GO_ON, Node, Panicked, Tick},
    outbox::Outbox,
    sync::{Arc, atomic::Ordering, bump},
    tap::{Copies, TickRecord},
    telemetry::{Meter, NodeEntry, PushAge, TickMeters},
    time::Time,
    timing::Running,
    trigger::Intake,
};

/// A node with its outbox and its measurements.
pub(crate) struct Seat {
    pub(crate) entry: NodeEntry,
    node: Box<dyn Node>,
    /// The function that builds it again, if there is one.
    pub(crate) again: Option<Again>,
    /// The panic while the node handled a text, if there was one.
    panicked: Option<Panicked>,
    meters: TickMeters,
    pub(crate) taps: Arc<Copies<TickRecord>>,
    outbox: Arc<Outbox>,
    fixed: Fixed,
}

/// Kinds of knobs that a node lacks, and the reason.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Fixed {
    pub(crate) kinds: &'static [KnobKind],
    pub(crate) reason: &'static str,
}

/// The connections and meters that a node declared while it was being built.
#[derive(Default)]
pub(crate) struct Wired {
    pub(crate) meters: Vec<(String, Meter)>,
    pub(crate) push_age: Option<PushAge>,
    pub(crate) outbox: Arc<Outbox>,
    pub(crate) fixed: Fixed,
    /// The ends of the topics that trigger it.
    pub(crate) intakes: Vec<Box<dyn Intake>>,
}

/// The function that builds a node again, and the message it is sent afterwards.
pub(crate) struct Again {
    pub(crate) build: Box<dyn FnMut() -> Box<dyn Node> + Send>,
    pub(crate) message: Option<String>,
}

/// How a tick was timed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Timed {
    /// When it began.
    pub(crate) began: Time,
    /// How late; `None` where that was not measured.
    pub(crate) lateness: Option<Duration>,
    /// How long it took; `None` where that was not measured.
    pub(crate) took: Option<Duration>,
    /// When it acted on the world; `None` if the run ended before.
    pub(crate) acted: Option<Time>,
}

impl Seat {
    pub(crate) fn new(
        entry: NodeEntry,
        meters: TickMeters,
        node: Box<dyn Node>,
        outbox: Arc<Outbox>,
        fixed: Fixed,
    ) -> Self {
        Self {
            entry,
            node,
            again: None,
            panicked: None,
            meters,
            taps: Arc::default(),
            outbox,
            fixed,
        }
    }

    /// Checks that the node lets this knob be turned.
    pub(crate) fn check(&self, knob: &Knob) -> Result<(), String> {
        match self.fixed.kinds.contains(&knob.kind()) {
            true => Err(self.fixed.reason.to_owned()),
            false => Ok(()),
        }
    }

    /// Runs a tick that takes no time.
    pub(crate) fn tick(&mut self, now: Time) -> Tick {
        let outcome = self.begin(|node| {
            let flow = node.tick(now)?;
            Ok(end_of(flow, node.apply(now)?))
        });
        bump(&self.entry.counters.ticks);
        outcome
    }

    /// Begins a tick that takes time: its messages wait for the end.
    pub(crate) fn start(&mut self, now: Time) -> Tick {
        self.outbox.hold(true);
        let outcome = self.begin(|node| node.tick(now));
        self.outbox.hold(false);
        bump(&self.entry.counters.ticks);
        outcome
    }

    /// Ends that tick.
    pub(crate) fn finish(&mut self, now: Time) -> Tick {
        self.outbox.release(now);
        self.guarded(|node| node.apply(now))
    }

    /// Begins a tick with `work`, or fails after a panic over a text.
    fn begin(&mut self, work: impl FnOnce(&mut dyn Node) -> Tick) -> Tick {
        match self.panicked.take() {
            Some(panicked) => Err(panicked.into()),
            None => self.guarded(work),
        }
    }

    /// Runs `work` and turns a panic into an error.
    fn guarded(&mut self, work: impl FnOnce(&mut dyn Node) -> Tick) -> Tick {
        let outcome = catch_unwind(AssertUnwindSafe(|| work(&mut *self.node)));
        outcome.unwrap_or_else(|panic| Err(Box::new(Panicked(panic_message(&*panic)))))
    }

    /// Sends the node a text. After a panic its state may be inconsistent, so its next
    /// tick fails.
    pub(crate) fn send(&mut self, text: &str) -> Result<String, String> {
        let answer = catch_unwind(AssertUnwindSafe(|| self.node.on_message(text)));
        answer.unwrap_or_else(|panic| {
            let panicked = Panicked(panic_message(&*panic));
            let reason = panicked.to_string();
            self.panicked = Some(panicked);
            Err(reason)
        })
    }

    /// Loses the messages that it has not released.
    pub(crate) fn clear(&mut self) {
        self.outbox.clear();
    }

    /// Stamps its messages with `clock` from now on.
    pub(crate) fn set_clock(&mut self, clock: LocalClock) {
        self.outbox.set_clock(clock);
    }

    /// Builds the node once more, or has it begin anew.
    ///
    /// # Errors
    /// The reason if it cannot.
    pub(crate) fn begin_anew(&mut self) -> Result<(), String> {
        let began = catch_unwind(AssertUnwindSafe(|| self.rebuild()));
        began.unwrap_or_else(|panic| Err(Panicked(panic_message(&*panic)).to_string()))?;
        self.panicked = None;
        Ok(())
    }

    fn rebuild(&mut self) -> Result<(), String> {
        let Some(again) = &mut self.again else {
            return self.node.restart();
        };
        // The ends of a topic are released with their node.
        self.node = Box::new(|_: Time| GO_ON);
        self.node = (again.build)();
        match &again.message {
            Some(text) => self.node.on_message(text).map(drop),
            None => Ok(()),
        }
    }

    /// Records the tick that is over at `now`, and says whether it ends the run.
    pub(crate) fn over(&mut self, running: &Running, now: Time, applied: Tick) -> Tick {
        if !running.noted {
            self.note(Timed {
                began: running.began,
                lateness: running.lateness,
                took: Some(now.since(running.began)),
                acted: Some(now),
            });
        }
        Ok(end_of(running.flow, applied?))
    }

    /// Records the measurements of a tick, after the node has moved on to the next one.
    pub(crate) fn note(&mut self, tick: Timed) {
        self.meters.record(tick.lateness, tick.took);
        let (entry, counters) = (&self.entry, &self.entry.counters);
        let push = || {
            let newest = entry.push_age.as_ref()?.in_force();
            newest.filter(|push| Some(push.at) == tick.acted)
        };
        self.taps.offer(|| TickRecord {
            number: counters.ticks.load(Ordering::Relaxed).saturating_sub(1),
            at: tick.began,
            ends: tick.acted,
            lateness: tick.lateness,
            took: tick.took,
            overruns: counters.overruns.load(Ordering::Relaxed),
            push: push(),
        });
    }

    /// The fault for a tick at `at` that returned an error.
    pub(crate) fn fault(&self, at: Time, cause: Box<dyn std::error::Error + Send + Sync>) -> Fault {
        let node = self.entry.name.to_string();
        Fault { node, at, cause }
    }
}

/// Ends the run if either part of a tick does.
fn end_of(first: ControlFlow<()>, second: ControlFlow<()>) -> ControlFlow<()> {
    match first {
        ControlFlow::Break(()) => first,
        ControlFlow::Continue(()) => second,
    }
}

fn panic_message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "without a message".to_owned())
}
