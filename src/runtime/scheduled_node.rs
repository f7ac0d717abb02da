//! A node in a graph: what it does, when, and what is known of it.

use std::{
    error::Error,
    ops::ControlFlow,
    panic::{AssertUnwindSafe, catch_unwind},
    time::Duration,
};

use super::{
    command::Command,
    knob::{Knob, KnobKind},
    local_clock::{ClockError, LocalClock},
    millis,
    node::{Fault, GO_ON, Node, Panicked, Tick},
    outbox::Outbox,
    rate::Rate,
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, Ordering},
        bump,
    },
    tap::{TickRecord, TickTaps},
    telemetry::{Meter, MeterRecorder, NodeEntry, PushAge},
    time::{Hz, Time},
    timing::{Running, Timing, Waiting},
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
    response: MeterRecorder,
    pub(crate) taps: Arc<TickTaps>,
    /// The seed of the run.
    pub(crate) seed: u64,
    /// What its ticks take, if that was ever asked for.
    pub(crate) timing: Option<Box<Timing>>,
    outbox: Arc<Outbox>,
    fixed: Fixed,
    /// By how much its due times are shifted.
    offset: Duration,
}

/// Kinds of knobs that a node does not have, and why.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Fixed {
    pub(crate) kinds: &'static [KnobKind],
    pub(crate) reason: &'static str,
}

/// What the graph learned of a node while it was being built.
#[derive(Default)]
pub(crate) struct Wired {
    pub(crate) meters: Vec<(String, Meter)>,
    pub(crate) push_age: Option<PushAge>,
    pub(crate) outbox: Arc<Outbox>,
    pub(crate) fixed: Fixed,
}

impl ScheduledNode {
    pub(crate) fn new(
        name: &str,
        priority: u32,
        rate: Rate,
        node: Box<dyn Node>,
        wired: Wired,
    ) -> Self {
        let (lateness, lateness_meter) = Meter::new();
        let (tick_time, tick_time_meter) = Meter::new();
        let (response, response_meter) = Meter::new();
        Self {
            entry: NodeEntry {
                name: name.into(),
                priority,
                ticks: Arc::default(),
                overruns: Arc::default(),
                busy: Arc::new(AtomicBool::new(false)),
                crashed: Arc::default(),
                micro_hz: Arc::new(AtomicU64::new(rate.hz().as_micro())),
                lateness: lateness_meter,
                tick_time: tick_time_meter,
                response: response_meter,
                meters: wired.meters,
                push_age: wired.push_age,
            },
            rate,
            node,
            panicked: None,
            lateness,
            tick_time,
            response,
            taps: Arc::default(),
            seed: 0,
            timing: None,
            outbox: wired.outbox,
            fixed: wired.fixed,
            offset: Duration::ZERO,
        }
    }

    /// Obeys a command that is for this node, at run time `at`; returns the value
    /// it replaced.
    ///
    /// # Errors
    /// Why it does not, and what to do instead.
    pub(crate) fn obey(&mut self, command: &Command, at: Time) -> Result<String, String> {
        let Command::Set(knob) = command else {
            return Err(format!("{command} is not for a node"));
        };
        self.check(knob)?;
        match knob {
            Knob::Rate { hz, .. } => Ok(self.set_hz(*hz, at).to_string()),
            Knob::Offset { offset, .. } => Ok(self.set_offset(*offset, at)),
            Knob::Send { text, .. } => self.send(text),
            Knob::Takes { spec, .. } => {
                let before = std::mem::replace(&mut self.timing().takes, spec.clone());
                Ok(before.to_string())
            }
            Knob::Wakes { spec, .. } => {
                let before = std::mem::replace(&mut self.timing().wakes, spec.clone());
                Ok(before.to_string())
            }
            Knob::Hang { cost, .. } => {
                let timing = self.timing();
                timing.hang = Some(*cost);
                Ok(timing.takes.to_string())
            }
            Knob::Crash { .. } => Ok(self.crash(at)),
            Knob::Restart { .. } => self.restart(at),
            Knob::Clock { error, .. } => Ok(self.set_clock(*error, at)),
            _ => Err(format!("{command} is not for a node")),
        }
    }

    /// Lets the node stop ticking at run time `at`. What it had not released is gone.
    fn crash(&mut self, at: Time) -> String {
        self.overrun_before(at);
        self.cut_off();
        self.outbox.clear();
        if let Some(timing) = &mut self.timing {
            (timing.waiting, timing.running, timing.hang) = (None, None, None);
        }
        self.entry.busy.store(false, Ordering::Relaxed);
        let crashed = self.entry.crashed.swap(true, Ordering::Relaxed);
        state(crashed).to_owned()
    }

    /// Lets the node begin anew at run time `at`.
    fn restart(&mut self, at: Time) -> Result<String, String> {
        let began = catch_unwind(AssertUnwindSafe(|| self.node.restart()));
        began.unwrap_or_else(|panic| Err(Panicked(panic_message(&*panic)).to_string()))?;
        let was = match self.is_crashed() {
            true => state(true).to_owned(),
            false => {
                self.crash(at);
                state(false).to_owned()
            }
        };
        self.panicked = None;
        self.rate.resume(at);
        self.entry.crashed.store(false, Ordering::Relaxed);
        Ok(was)
    }

    /// Whether the node crashed and was not restarted.
    pub(crate) fn is_crashed(&self) -> bool {
        self.entry.crashed.load(Ordering::Relaxed)
    }

    /// Lets the node's own clock be wrong from run time `at` on.
    fn set_clock(&mut self, error: ClockError, at: Time) -> String {
        let free = self.free_at(at);
        let clock = LocalClock::new(at, error);
        let before = self.rate.set_clock(clock, free);
        self.outbox.set_clock(clock);
        before.error.to_string()
    }

    /// Whether the node has such a knob, and all is there that its value needs.
    ///
    /// # Errors
    /// Why not.
    pub(crate) fn check(&self, knob: &Knob) -> Result<(), String> {
        if self.fixed.kinds.contains(&knob.kind()) {
            return Err(self.fixed.reason.to_owned());
        }
        match knob.draw().and_then(|draw| draw.missing()) {
            Some(recorded) => Err(format!(
                "the durations in {} were not loaded: name a recording that the command can read",
                recorded.file()
            )),
            None => Ok(()),
        }
    }

    fn timing(&mut self) -> &mut Timing {
        self.timing.get_or_insert_default()
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
        let free = self.free_at(at);
        self.rate.set_hz_while_busy(hz, at, free);
        self.entry.micro_hz.store(hz.as_micro(), Ordering::Relaxed);
        before
    }

    /// Shifts the node's due times at run time `at`; returns by how much they were.
    fn set_offset(&mut self, offset: Duration, at: Time) -> String {
        let free = self.free_at(at);
        self.rate.set_offset(offset, free);
        let before = std::mem::replace(&mut self.offset, offset);
        format!("{} ms", millis::to_millis(before))
    }

    /// When a tick can start that is due at `at` or later, what passed until then
    /// counted.
    fn free_at(&mut self, at: Time) -> Time {
        self.overrun_before(at);
        let occupied = self.timing.as_ref().and_then(|t| t.occupied_until());
        occupied.map_or(at, |free| free.max(at))
    }

    /// Lets the node work in a tick that takes no time.
    pub(crate) fn tick(&mut self, now: Time) -> Tick {
        let outcome = self.begin(|node| {
            let flow = node.tick(now)?;
            Ok(end_of(flow, node.apply(now)?))
        });
        bump(&self.entry.ticks);
        outcome
    }

    /// Begins a tick with `work`, unless the node panicked over a text before.
    fn begin(&mut self, work: impl FnOnce(&mut dyn Node) -> Tick) -> Tick {
        match self.panicked.take() {
            Some(panicked) => Err(panicked.into()),
            None => self.guarded(work),
        }
    }

    /// Runs `work`. A panic in it is an error like any other.
    fn guarded(&mut self, work: impl FnOnce(&mut dyn Node) -> Tick) -> Tick {
        let outcome = catch_unwind(AssertUnwindSafe(|| work(&mut *self.node)));
        outcome.unwrap_or_else(|panic| Err(Box::new(Panicked(panic_message(&*panic)))))
    }

    /// What the next tick takes, if it was asked to take something.
    pub(crate) fn cost(&mut self) -> Option<Duration> {
        let timing = self.timing.as_mut()?;
        let number = self.entry.ticks.load(Ordering::Relaxed);
        timing.cost(self.seed, &self.entry.name, number)
    }

    /// How late a tick is that starts at `now`, if ticks were asked to be late.
    pub(crate) fn lateness(&self, due: Time, now: Time) -> Option<Duration> {
        let timing = self.timing.as_ref()?;
        (now > due || !timing.wakes.is_none()).then(|| now.since(due))
    }

    /// Lets a tick that is due now wait for its start, if it is late; when it is to
    /// start.
    pub(crate) fn wait(&mut self, due: Time, now: Time) -> Option<Time> {
        let timing = self.timing.as_mut()?;
        let number = self.entry.ticks.load(Ordering::Relaxed);
        let starts = now + timing.lateness(self.seed, &self.entry.name, number);
        timing.waiting = (starts > now).then_some(Waiting { due, starts });
        timing.waiting.map(|waiting| waiting.starts)
    }

    /// When the tick was due whose wait is over.
    pub(crate) fn waited(&mut self) -> Option<Time> {
        let waiting = self.timing.as_mut()?.waiting.take();
        waiting.map(|waiting| waiting.due)
    }

    /// Starts a tick at `now` that is to take `cost`; returns when it is to be over.
    /// What it publishes waits for that.
    pub(crate) fn start(
        &mut self,
        now: Time,
        cost: Duration,
        lateness: Option<Duration>,
    ) -> Result<Time, Box<dyn Error + Send + Sync>> {
        self.outbox.hold(true);
        let outcome = self.begin(|node| node.tick(now));
        self.outbox.hold(false);
        bump(&self.entry.ticks);
        let running = Running {
            began: now,
            ends: now + cost,
            lateness,
            busy: self.timing.as_ref().is_some_and(|t| t.takes.busy),
            flow: outcome?,
            noted: false,
        };
        self.entry.busy.store(true, Ordering::Relaxed);
        let ends = running.ends;
        self.timing().running = Some(running);
        Ok(ends)
    }

    /// Ends at `now` the tick that takes time. What was due before `passed` is
    /// missed.
    pub(crate) fn finish(&mut self, now: Time, passed: Time) -> Tick {
        let Some(running) = self.timing().running.take() else {
            return GO_ON;
        };
        self.entry.busy.store(false, Ordering::Relaxed);
        self.outbox.release(now);
        let applied = self.guarded(|node| node.apply(now));
        self.overrun_until(passed);
        if !running.noted {
            let took = now.since(running.began);
            self.note_tick(running.began, Some(now), running.lateness, Some(took));
        }
        Ok(end_of(running.flow, applied?))
    }

    /// The tick that has started and is not over.
    pub(crate) fn running(&self) -> Option<&Running> {
        self.timing.as_ref()?.running.as_ref()
    }

    /// When something happens next: a tick is over, starts late, or is due.
    pub(crate) fn next_at(&self) -> Time {
        let timing = self.timing.as_ref();
        let ends = timing.and_then(|t| Some(t.running.as_ref()?.ends));
        let starts = timing.and_then(|t| Some(t.waiting?.starts));
        ends.or(starts).unwrap_or_else(|| self.due())
    }

    /// When its next tick is due; never if it crashed.
    pub(crate) fn due(&self) -> Time {
        match self.is_crashed() {
            true => Time::MAX,
            false => self.rate.due(),
        }
    }

    /// When the tick was due that starts now; moves on to the next.
    pub(crate) fn take_due(&mut self) -> Time {
        if let Some(due) = self.waited() {
            return due;
        }
        let due = self.rate.due();
        self.rate.advance();
        due
    }

    /// Whether a tick is on its way, so that none can start.
    pub(crate) fn is_occupied(&self) -> bool {
        let timing = self.timing.as_ref();
        timing.is_some_and(|t| t.waiting.is_some() || t.running.is_some())
    }

    /// Counts the due times before `end` that pass while a tick is on its way.
    pub(crate) fn overrun_before(&mut self, end: Time) {
        let occupied = self.timing.as_ref().and_then(|t| t.occupied_until());
        self.overrun_until(occupied.map_or(Time::ZERO, |free| free.min(end)));
    }

    /// Moves on to the first tick that is due at `now` or later, and counts those
    /// that are missed.
    pub(crate) fn overrun_until(&mut self, now: Time) {
        if self.rate.due() < now {
            self.overrun(now);
        }
    }

    /// The same, and misses the next one in any case.
    pub(crate) fn overrun(&mut self, now: Time) {
        self.advance_past(now);
        self.count_overruns(1);
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
            self.count_overruns(missed);
        }
    }

    fn count_overruns(&self, count: u64) {
        self.entry.overruns.fetch_add(count, Ordering::Relaxed);
    }

    /// Notes what was measured of the tick that began at `at` and acted at `ends`, when
    /// the node has moved on past it.
    pub(crate) fn note_tick(
        &mut self,
        at: Time,
        ends: Option<Time>,
        lateness: Option<Duration>,
        took: Option<Duration>,
    ) {
        if let Some(lateness) = lateness {
            self.lateness.record(lateness);
        }
        if let Some(took) = took {
            self.tick_time.record(took);
            self.response.record(lateness.unwrap_or_default() + took);
        }
        let entry = &self.entry;
        self.taps.offer(|| TickRecord {
            number: entry.ticks.load(Ordering::Relaxed).saturating_sub(1),
            at,
            ends,
            lateness,
            took,
            overruns: entry.overruns.load(Ordering::Relaxed),
        });
    }

    /// Notes a tick in whose middle the run ended.
    pub(crate) fn cut_off(&mut self) {
        let running = self.timing.as_mut().and_then(|t| t.running.as_mut());
        if let Some(running) = running.filter(|running| !running.noted) {
            running.noted = true;
            let (began, lateness) = (running.began, running.lateness);
            self.note_tick(began, None, lateness, None);
        }
    }
}

fn state(crashed: bool) -> &'static str {
    if crashed { "crashed" } else { "running" }
}

/// Ends the run if either part of a tick does.
fn end_of(first: ControlFlow<()>, second: ControlFlow<()>) -> ControlFlow<()> {
    match first {
        ControlFlow::Break(()) => first,
        ControlFlow::Continue(()) => second,
    }
}

fn panic_message(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "without a message".to_owned())
}
