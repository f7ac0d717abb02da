//! A node in a graph: what does the work, on whatever thread.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    time::Duration,
};

use super::{
    Flow, Node, NodeCrash, NodeError, Panicked, TickResult,
    job::{Job, JobKind, LastTick, WorkTimes},
    tick::Tick,
};
use crate::{
    control::{
        command::KnobRefusal,
        knob::{Knob, KnobKind},
    },
    record::{NodeRecord, RecordSender, TickTimes},
    settings::local_clock::StampClock,
    sync::Arc,
    time::Time,
};

/// A node with what it has of the graph.
pub(crate) struct NodeSlot {
    node: Box<dyn Node>,
    /// The function that builds it again; `None` for a node that is built once.
    pub(crate) again: Option<Rebuild>,
    /// The panic while the node obeyed, if there was one.
    panicked: Option<Panicked>,
    ends: Ends,
    fixed: Fixed,
    /// What the node gets for its ticks.
    tick: Tick,
    /// The tick that has begun and is not yet over.
    running: Option<RunningTick>,
}

/// What a node has of the graph, and keeps when it is built once more.
#[derive(Clone, Default)]
pub(crate) struct Ends {
    /// The way of its records.
    pub(crate) records: RecordSender,
    pub(crate) clock: Arc<StampClock>,
    /// Where it reads how long its last tick took, if it wants to know.
    pub(crate) last_tick: Option<LastTick>,
    /// Names of its measurements.
    pub(crate) meters: Vec<String>,
    /// The number of the bus of each topic that it reads, with the index of its reader there.
    pub(crate) readers: Vec<(usize, usize)>,
}

/// A tick that takes run time.
#[derive(Clone, Copy)]
struct RunningTick {
    number: u64,
    began: Time,
    lateness: Option<Duration>,
    /// Whether the run ends after it.
    flow: Flow,
    /// Whether it is already recorded, because the run ended before it was over.
    noted: bool,
}

impl RunningTick {
    fn times(&self, ends: Option<Time>) -> TickTimes {
        TickTimes {
            number: self.number,
            at: self.began,
            lateness: self.lateness,
            took: ends.map(|ends| ends.since(self.began)),
            ends,
        }
    }
}

/// Kinds of knobs that a node lacks, and the reason.
#[derive(Debug, Default)]
pub(crate) struct Fixed {
    pub(crate) kinds: Vec<KnobKind>,
    pub(crate) reason: &'static str,
}

/// The function that builds a node again with its former ends, and the message that the new node
/// is sent.
pub(crate) struct Rebuild {
    pub(crate) build: Box<dyn FnMut(Ends) -> Box<dyn Node> + Send>,
    pub(crate) message: Option<String>,
}

impl NodeSlot {
    pub(crate) fn new(node: Box<dyn Node>, ends: Ends, fixed: Fixed) -> Self {
        let is_reader = !ends.readers.is_empty();
        Self {
            node,
            again: None,
            panicked: None,
            tick: Tick::for_node(ends.records.clone(), ends.clock.clone(), is_reader),
            ends,
            fixed,
            running: None,
        }
    }

    /// Checks that knobs of this kind are not fixed for the node.
    pub(crate) fn check(&self, knob: &Knob) -> Result<(), KnobRefusal> {
        if self.fixed.kinds.contains(&knob.kind()) {
            Err(KnobRefusal::Fixed(self.fixed.reason))
        } else {
            Ok(())
        }
    }

    /// Does a job at run time `now`. The real clock asks to `record_span`: the begin and the end of a
    /// whole tick.
    #[inline]
    pub(crate) fn work(&mut self, job: Job, now: Time, record_span: bool) -> TickResult {
        match job.kind {
            JobKind::Tick { .. } => self.tick(now, record_span),
            JobKind::Begin => self.begin_lasting(now, job.lateness()),
            JobKind::End => self.end_lasting(now),
        }
    }

    /// Records what that job has ended, and returns whether it ends the run.
    #[inline]
    pub(crate) fn done(&mut self, job: Job, times: WorkTimes, outcome: TickResult) -> TickResult {
        let WorkTimes { began, took, .. } = times;
        match job.kind {
            JobKind::Tick { is_instant } => {
                self.set_last_tick(times.ended.since(began));
                self.record(|| TickTimes {
                    number: self.tick.number(),
                    at: began,
                    lateness: job.lateness(),
                    took: if is_instant {
                        Some(Duration::ZERO)
                    } else {
                        took
                    },
                    // Whatever it takes: its messages have the stamp of its begin.
                    ends: Some(began),
                });
                outcome
            }
            JobKind::End => self.lasting_done(times.ended, outcome),
            JobKind::Begin => outcome,
        }
    }

    /// Runs a whole tick, and may record its begin and its end.
    fn tick(&mut self, now: Time, record_span: bool) -> TickResult {
        self.tick.begin(now, false);
        if record_span {
            self.record_begin(now);
        }
        let outcome = self.unless_panicked(|node, tick| {
            let flow = node.tick(tick)?;
            tick.end(now);
            Ok(flow.and(node.apply(tick)?))
        });
        if record_span {
            self.record_end();
        }
        outcome
    }

    /// Begins a tick that takes time: its messages wait for the end.
    fn begin_lasting(&mut self, now: Time, lateness: Option<Duration>) -> TickResult {
        self.tick.begin(now, true);
        self.record_begin(now);
        let outcome = self.unless_panicked(|node, tick| node.tick(tick));
        let flow = match &outcome {
            Ok(flow) => *flow,
            // The crash cuts it off.
            Err(cause) if cause.is::<NodeCrash>() => Flow::Continue,
            Err(_) => {
                self.tick.abort();
                self.record_end();
                return outcome;
            }
        };
        self.running = Some(RunningTick {
            number: self.tick.number(),
            began: now,
            lateness,
            flow,
            noted: false,
        });
        outcome.map(|_| Flow::Continue)
    }

    /// Ends that tick.
    fn end_lasting(&mut self, now: Time) -> TickResult {
        let applied = self.guarded(|node, tick| {
            tick.end(now);
            node.apply(tick)
        });
        self.record_end();
        applied
    }

    /// Records that tick, which is over at `now`, and returns whether it ends the run.
    fn lasting_done(&mut self, now: Time, applied: TickResult) -> TickResult {
        let Some(running) = self.running.take() else {
            return applied;
        };
        self.set_last_tick(now.since(running.began));
        if !running.noted {
            self.record(|| running.times(Some(now)));
        }
        Ok(running.flow.and(applied?))
    }

    /// Records that tick as unfinished, once.
    pub(crate) fn cut_off(&mut self) {
        if let Some(running) = self.running.filter(|running| !running.noted) {
            self.record(|| running.times(None));
            self.running = Some(RunningTick {
                noted: true,
                ..running
            });
        }
    }

    /// Forgets that tick, with the messages that it holds back.
    pub(crate) fn abort(&mut self) {
        self.cut_off();
        self.tick.abort();
        self.running = None;
    }

    #[inline]
    fn set_last_tick(&self, duration: Duration) {
        if let Some(last_tick) = &self.ends.last_tick {
            last_tick.set(duration);
        }
    }

    fn record_begin(&self, now: Time) {
        self.ends.records.node(|| NodeRecord::Began(now));
    }

    fn record_end(&self) {
        self.ends.records.node(|| NodeRecord::Ended);
    }

    /// Does `work` of a tick, or fails after a panic between two ticks.
    fn unless_panicked(
        &mut self,
        work: impl FnOnce(&mut dyn Node, &mut Tick) -> TickResult,
    ) -> TickResult {
        match self.panicked.take() {
            Some(panicked) => Err(panicked.into()),
            None => self.guarded(work),
        }
    }

    /// Runs `work` and turns a panic into an error.
    fn guarded(&mut self, work: impl FnOnce(&mut dyn Node, &mut Tick) -> TickResult) -> TickResult {
        caught(|| work(&mut *self.node, &mut self.tick))
            .unwrap_or_else(|panicked| Err(panicked.into()))
    }

    /// Lets the node obey. After a panic its state may be inconsistent, so its next tick
    /// fails.
    pub(crate) fn ask(
        &mut self,
        obey: impl FnOnce(&mut dyn Node) -> Result<String, NodeError>,
    ) -> Result<String, KnobRefusal> {
        match caught(|| obey(&mut *self.node)) {
            Ok(answer) => answer.map_err(|error| KnobRefusal::ByNode(error.to_string())),
            Err(panicked) => {
                let reason = panicked.to_string();
                self.panicked = Some(panicked);
                Err(KnobRefusal::ByNode(reason))
            }
        }
    }

    /// Builds the node once more, or has it begin anew.
    ///
    /// # Errors
    /// The reason if it cannot.
    pub(crate) fn begin_anew(&mut self) -> Result<(), KnobRefusal> {
        caught(|| self.rebuild())
            .unwrap_or_else(|panicked| Err(panicked.into()))
            .map_err(|error| KnobRefusal::ByNode(error.to_string()))?;
        self.panicked = None;
        self.tick.forget_reads();
        Ok(())
    }

    fn rebuild(&mut self) -> Result<(), NodeError> {
        let Some(again) = &mut self.again else {
            return self.node.restart();
        };
        // The node's ends of topics go with it.
        self.node = Box::new(|_: &mut Tick| {});
        self.node = (again.build)(self.ends.clone());
        match &again.message {
            Some(text) => self.node.on_order(text).map(drop),
            None => Ok(()),
        }
    }

    /// Records the measurements of a tick, after the node has moved on to the next one.
    #[inline]
    fn record(&self, times: impl FnOnce() -> TickTimes) {
        self.ends.records.node(|| NodeRecord::Ticked(times()));
    }
}

/// Does some work, and returns a panic in it with its message.
fn caught<R>(work: impl FnOnce() -> R) -> Result<R, Panicked> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|panic| {
        let text = panic
            .downcast_ref::<&str>()
            .copied()
            .or_else(|| panic.downcast_ref::<String>().map(String::as_str));
        Panicked(text.unwrap_or("without a message").to_owned())
    })
}
