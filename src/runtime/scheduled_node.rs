//! A node in a graph, with its schedule and its measurements.

use std::{
    collections::VecDeque,
    error::Error,
    ops::ControlFlow,
    panic::{AssertUnwindSafe, catch_unwind},
    time::Duration,
};

use super::{
    command::Command,
    executor::Executor,
    knob::{Knob, KnobKind},
    local_clock::{ClockError, LocalClock},
    millis,
    node::{Fault, GO_ON, Node, Panicked, Tick},
    outbox::Outbox,
    placement::Placement,
    rate::Rate,
    release::Release,
    sync::{Arc, atomic::Ordering, bump},
    tap::{Copies, TickRecord},
    telemetry::{Meter, NodeEntry, PushAge, TickMeters},
    time::{Hz, Time},
    timing::{Running, TickTiming, Waiting},
    trigger::{Intake, Trigger},
};

/// A node with its schedule and its measurements.
pub(crate) struct ScheduledNode {
    pub(crate) entry: NodeEntry,
    pub(crate) rate: Rate,
    /// The topics that trigger it; it has no use for its rate then.
    trigger: Option<Box<Trigger>>,
    pub(crate) placement: Placement,
    node: Box<dyn Node>,
    /// The function that builds it again, if there is one.
    pub(crate) again: Option<Again>,
    /// The panic while the node handled a text, if there was one.
    panicked: Option<Panicked>,
    meters: TickMeters,
    pub(crate) taps: Arc<Copies<TickRecord>>,
    /// The seed of the run.
    pub(crate) seed: u64,
    /// Duration and lateness of its ticks, if ever set.
    pub(crate) timing: Option<Box<TickTiming>>,
    outbox: Arc<Outbox>,
    fixed: Fixed,
    /// Offset of its due times.
    offset: Duration,
    /// Due times that wait in the line of its executor.
    backlog: VecDeque<Time>,
}

/// The most due times in wait: those beyond them are overruns.
pub(crate) const MOST_WAITING: usize = 100_000;

/// The function that builds a node again, and the message it is sent afterwards.
pub(crate) struct Again {
    pub(crate) build: Box<dyn FnMut() -> Box<dyn Node> + Send>,
    pub(crate) message: Option<String>,
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

impl ScheduledNode {
    pub(crate) fn new(
        name: &str,
        priority: u32,
        release: Release,
        now: Time,
        node: Box<dyn Node>,
        wired: Wired,
    ) -> Self {
        let (rate, trigger) = match release {
            Release::Every(hz) => (Rate::new(hz, now), None),
            Release::On(matching) => {
                let trigger = Trigger::new(matching, wired.intakes);
                (Rate::new(Hz::MIN, now), Some(Box::new(trigger)))
            }
        };
        let (entry, meters) =
            NodeEntry::new(name, priority, rate.hz(), wired.meters, wired.push_age);
        Self {
            entry,
            rate,
            trigger,
            placement: Placement::Thread,
            node,
            again: None,
            panicked: None,
            meters,
            taps: Arc::default(),
            seed: 0,
            timing: None,
            outbox: wired.outbox,
            fixed: wired.fixed,
            offset: Duration::ZERO,
            backlog: VecDeque::new(),
        }
    }

    /// Carries out a command for this node at run time `at`; returns the previous value.
    ///
    /// # Errors
    /// The reason and a remedy.
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

    /// Stops the node's ticks at run time `at`. Messages it has not released are lost.
    fn crash(&mut self, at: Time) -> String {
        self.overrun_before(at);
        self.cut_off();
        self.outbox.clear();
        self.backlog.clear();
        if let Some(timing) = &mut self.timing {
            (timing.waiting, timing.running, timing.hang) = (None, None, None);
        }
        self.entry.counters.busy.store(false, Ordering::Relaxed);
        let crashed = self.entry.counters.crashed.swap(true, Ordering::Relaxed);
        state(crashed).to_owned()
    }

    /// Restarts the node at run time `at`.
    fn restart(&mut self, at: Time) -> Result<String, String> {
        let was = state(self.is_crashed()).to_owned();
        if self.again.is_some() {
            self.crash(at);
        }
        let began = catch_unwind(AssertUnwindSafe(|| self.begin_anew()));
        began.unwrap_or_else(|panic| Err(Panicked(panic_message(&*panic)).to_string()))?;
        if !self.is_crashed() {
            self.crash(at);
        }
        self.panicked = None;
        self.rate.resume(at);
        if let Some(trigger) = &mut self.trigger {
            trigger.reset();
        }
        self.entry.counters.crashed.store(false, Ordering::Relaxed);
        Ok(was)
    }

    fn begin_anew(&mut self) -> Result<(), String> {
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

    /// Whether the node crashed without a restart since.
    pub(crate) fn is_crashed(&self) -> bool {
        self.entry.counters.crashed.load(Ordering::Relaxed)
    }

    /// Sets the error of the node's own clock from run time `at` on.
    fn set_clock(&mut self, error: ClockError, at: Time) -> String {
        let free = self.free_at(at);
        let clock = LocalClock::new(at, error);
        let before = self.rate.set_clock(clock, free);
        self.outbox.set_clock(clock);
        before.error.to_string()
    }

    /// Checks that the node has this knob and that everything its value needs is loaded.
    ///
    /// # Errors
    /// The reason.
    pub(crate) fn check(&self, knob: &Knob) -> Result<(), String> {
        if self.fixed.kinds.contains(&knob.kind()) {
            return Err(self.fixed.reason.to_owned());
        }
        if self.is_triggered() && matches!(knob.kind(), KnobKind::Rate | KnobKind::Offset) {
            let name = &self.entry.name;
            return Err(format!(
                "messages trigger {name}: choose a node that ticks at a rate"
            ));
        }
        if self.placement != Placement::Thread && knob.kind() == KnobKind::Wakes {
            let name = &self.entry.name;
            return Err(format!(
                "{name} has no thread of its own: its executor decides when it starts"
            ));
        }
        match knob.draw().and_then(|draw| draw.missing()) {
            Some(recorded) => Err(format!(
                "the durations in {} were not loaded: name a recording that the command can read",
                recorded.file()
            )),
            None => Ok(()),
        }
    }

    fn timing(&mut self) -> &mut TickTiming {
        self.timing.get_or_insert_default()
    }

    /// Sends the node a text. After a panic its state may be inconsistent, so its next
    /// tick fails.
    fn send(&mut self, text: &str) -> Result<String, String> {
        let answer = catch_unwind(AssertUnwindSafe(|| self.node.on_message(text)));
        answer.unwrap_or_else(|panic| {
            let panicked = Panicked(panic_message(&*panic));
            let reason = panicked.to_string();
            self.panicked = Some(panicked);
            Err(reason)
        })
    }

    /// Changes the node's rate at run time `at`; returns the previous one.
    fn set_hz(&mut self, hz: Hz, at: Time) -> Hz {
        let before = self.rate.hz();
        let free = self.free_at(at);
        self.rate.set_hz_while_busy(hz, at, free);
        self.entry
            .counters
            .micro_hz
            .store(hz.as_micro(), Ordering::Relaxed);
        before
    }

    /// Shifts the node's due times at run time `at`; returns the previous offset.
    fn set_offset(&mut self, offset: Duration, at: Time) -> String {
        let free = self.free_at(at);
        self.rate.set_offset(offset, free);
        let before = std::mem::replace(&mut self.offset, offset);
        format!("{} ms", millis::to_millis(before))
    }

    /// The earliest start of a tick that is due at `at` or later. Counts the ticks missed
    /// until `at`.
    fn free_at(&mut self, at: Time) -> Time {
        self.overrun_before(at);
        self.queue_before(at);
        self.occupied_until().map_or(at, |free| free.max(at))
    }

    /// Time until which no tick at its rate can start; `None` if it is free, and for a
    /// node whose ticks wait instead of being skipped.
    fn occupied_until(&self) -> Option<Time> {
        let timing = self.timing.as_ref();
        timing.filter(|_| self.skips_ticks())?.occupied_until()
    }

    /// Whether messages trigger it.
    pub(crate) fn is_triggered(&self) -> bool {
        self.trigger.is_some()
    }

    /// Whether it skips ticks that are due while it is busy: it ticks at a rate on a
    /// thread of its own.
    pub(crate) fn skips_ticks(&self) -> bool {
        self.trigger.is_none() && self.has_thread()
    }

    /// Whether it has logical execution time.
    pub(crate) fn is_let(&self) -> bool {
        self.placement == Placement::Let
    }

    /// Whether it ticks on a thread of its own.
    pub(crate) fn has_thread(&self) -> bool {
        !matches!(self.placement, Placement::Executor(_))
    }

    /// Its place among nodes in the same phase of an instant; `index` is that in the
    /// graph.
    pub(crate) fn rank(&self, index: usize) -> (u32, usize) {
        (self.entry.priority, index)
    }

    /// Number of the topics that trigger it.
    pub(crate) fn inputs(&self) -> usize {
        self.trigger.as_ref().map_or(0, |trigger| trigger.inputs())
    }

    /// Run time of the delivery of the oldest message that it has not yet taken.
    pub(crate) fn oldest(&self, now: Time) -> Option<Time> {
        self.trigger.as_ref()?.oldest(now)
    }

    /// The same for one of the topics that trigger it.
    pub(crate) fn oldest_of(&self, input: usize, now: Time) -> Option<Time> {
        self.trigger.as_ref()?.oldest_of(input, now)
    }

    /// Takes messages until a set is complete; returns when it became due.
    pub(crate) fn take(&mut self, now: Time) -> Option<Time> {
        self.trigger.as_mut()?.take(now)
    }

    /// Takes a message of one topic; returns when the set became due that it completes.
    pub(crate) fn take_from(&mut self, input: usize, now: Time) -> Option<Time> {
        self.trigger.as_mut()?.take_from(input, now)
    }

    /// Number of messages of one topic that it may take at `now`, without a turn.
    pub(crate) fn waiting_in(&self, input: usize, now: Time) -> usize {
        let trigger = self.trigger.as_ref();
        trigger.map_or(0, |trigger| trigger.waiting_in(input, now))
    }

    /// Has the next tick take from this topic only.
    pub(crate) fn choose_input(&mut self, input: usize) {
        if let Some(trigger) = &mut self.trigger {
            trigger.choose_input(input);
        }
    }

    /// Due time of the timer that its executor calls now; `None` if it is not due. Where due
    /// times do not wait in line, those that have passed, `now` included, are overruns (rcl
    /// `c19dab5`, `timer.c:298-319`).
    pub(crate) fn call_timer(&mut self, now: Time) -> Option<Time> {
        self.queue_before(now + Time::TICK);
        if self.queues_timers() {
            return self.backlog.pop_front();
        }
        let due = self.due();
        (due <= now).then(|| {
            self.advance_past(now + Time::TICK);
            due
        })
    }

    /// Whether its due times wait in the line of its executor.
    fn queues_timers(&self) -> bool {
        let executor = self.entry.executor.filter(|_| !self.has_thread());
        executor.is_some_and(Executor::queues_timers)
    }

    /// Adds the next due time to those in wait; `false` if they are too many: it is an overrun.
    pub(crate) fn queue_timer(&mut self) -> bool {
        let room = self.backlog.len() < MOST_WAITING;
        match room {
            true => self.backlog.push_back(self.rate.due()),
            false => self.count_overruns(1),
        }
        self.rate.advance();
        room
    }

    /// Adds the due times before `end` to those in wait.
    fn queue_before(&mut self, end: Time) {
        while self.queues_timers() && self.due() < end {
            self.queue_timer();
        }
    }

    /// The due times in wait.
    pub(crate) fn queued_timers(&self) -> impl ExactSizeIterator<Item = Time> {
        self.backlog.iter().copied()
    }

    /// Takes the running tick off its core; it needs `remaining` more.
    pub(crate) fn suspend(&mut self, remaining: Duration) {
        if let Some(running) = self.timing().running.as_mut() {
            (running.ends, running.suspended) = (Time::MAX, Some(remaining));
        }
    }

    /// Puts the running tick on a core again, where it is over at `ends`.
    pub(crate) fn resume(&mut self, ends: Time) {
        if let Some(running) = self.timing().running.as_mut() {
            (running.ends, running.suspended) = (ends, None);
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

    /// Duration of the next tick, if one is set.
    pub(crate) fn cost(&mut self) -> Option<Duration> {
        let timing = self.timing.as_mut()?;
        let number = self.entry.counters.ticks.load(Ordering::Relaxed);
        timing.cost(self.seed, &self.entry.name, number)
    }

    /// Lateness of a tick that starts at `now`, if a lateness is set.
    pub(crate) fn lateness(&self, due: Time, now: Time) -> Option<Duration> {
        let timing = self.timing.as_ref();
        let wakes = || timing.is_some_and(|t| now > due || !t.wakes.is_none());
        (!self.skips_ticks() || wakes()).then(|| now.since(due))
    }

    /// Delays a tick that is due now by its lateness; returns its start, or `None` if it
    /// can start now.
    pub(crate) fn wait(&mut self, due: Time, now: Time) -> Option<Time> {
        let timing = self.timing.as_mut()?;
        let number = self.entry.counters.ticks.load(Ordering::Relaxed);
        let starts = now + timing.lateness(self.seed, &self.entry.name, number);
        timing.waiting = (starts > now).then_some(Waiting { due, starts });
        timing.waiting.map(|waiting| waiting.starts)
    }

    /// Plans the start of the tick for a message that waits at `now`; a thread that was
    /// `asleep` wakes up late.
    pub(crate) fn plan_start(&mut self, now: Time, asleep: bool) -> Time {
        let due = now;
        let late = asleep.then(|| self.wait(due, now)).flatten();
        let starts = late.unwrap_or(now);
        self.timing().waiting = Some(Waiting { due, starts });
        starts
    }

    /// Due time of the delayed tick that starts now.
    pub(crate) fn waited(&mut self) -> Option<Time> {
        let waiting = self.timing.as_mut()?.waiting.take();
        waiting.map(|waiting| waiting.due)
    }

    /// Duration of the tick that starts at `now`, if it takes time: its `cost`, or, with
    /// logical execution time, until the end of the period in which that is spent.
    pub(crate) fn duration(&self, now: Time, cost: Option<Duration>) -> Option<Duration> {
        if self.placement != Placement::Let {
            return cost.filter(|cost| !cost.is_zero());
        }
        let mut rate = self.rate.clone();
        rate.resume(rate.due().max(now + cost.unwrap_or_default()));
        Some(rate.due().since(now))
    }

    /// The configured duration of the tick that starts at `now`, if there is one.
    pub(crate) fn takes(&mut self, now: Time) -> Option<Duration> {
        let cost = self.cost();
        match self.placement {
            Placement::Let => self.duration(now, cost),
            _ => cost,
        }
    }

    /// Starts a tick of duration `cost` at `now`; returns its end. Its messages are
    /// released then.
    pub(crate) fn start(
        &mut self,
        now: Time,
        cost: Duration,
        lateness: Option<Duration>,
    ) -> Result<Time, Box<dyn Error + Send + Sync>> {
        self.outbox.hold(true);
        let outcome = self.begin(|node| node.tick(now));
        self.outbox.hold(false);
        bump(&self.entry.counters.ticks);
        let running = Running {
            began: now,
            ends: now + cost,
            lateness,
            busy: self.timing.as_ref().is_some_and(|t| t.takes.busy),
            flow: outcome?,
            noted: false,
            suspended: None,
        };
        self.entry.counters.busy.store(true, Ordering::Relaxed);
        let ends = running.ends;
        self.timing().running = Some(running);
        Ok(ends)
    }

    /// Ends the running tick at `now`. Ticks due before `passed` are missed.
    pub(crate) fn finish(&mut self, now: Time, passed: Time) -> Tick {
        let Some(running) = self.timing().running.take() else {
            return GO_ON;
        };
        self.entry.counters.busy.store(false, Ordering::Relaxed);
        self.outbox.release(now);
        let applied = self.guarded(|node| node.apply(now));
        self.overrun_until(passed);
        if !running.noted {
            let took = now.since(running.began);
            self.note_tick(running.began, running.lateness, Some(took), Some(now));
        }
        Ok(end_of(running.flow, applied?))
    }

    /// The tick that has started and is not yet over.
    pub(crate) fn running(&self) -> Option<&Running> {
        self.timing.as_ref()?.running.as_ref()
    }

    /// Time of the next event: the end of a tick, a late start, or a due tick.
    pub(crate) fn next_at(&self) -> Time {
        let timing = self.timing.as_ref();
        let ends = timing.and_then(|t| Some(t.running.as_ref()?.ends));
        let starts = timing.and_then(|t| Some(t.waiting?.starts));
        ends.or(starts).unwrap_or_else(|| self.due())
    }

    /// Due time of the next tick; [`Time::MAX`] after a crash.
    pub(crate) fn due(&self) -> Time {
        match self.is_crashed() || self.is_triggered() {
            true => Time::MAX,
            false => self.rate.due(),
        }
    }

    /// Due time of the tick that starts now; moves on to the next.
    pub(crate) fn take_due(&mut self) -> Time {
        if let Some(due) = self.waited() {
            return due;
        }
        let due = self.rate.due();
        self.rate.advance();
        due
    }

    /// Whether a tick is waiting or running, so that no other can start.
    pub(crate) fn is_occupied(&self) -> bool {
        let timing = self.timing.as_ref();
        timing.is_some_and(|t| t.waiting.is_some() || t.running.is_some())
    }

    /// Counts the due times before `end` that pass during the current tick.
    pub(crate) fn overrun_before(&mut self, end: Time) {
        let occupied = self.occupied_until();
        self.overrun_until(occupied.map_or(Time::ZERO, |free| free.min(end)));
    }

    /// Moves on to the first tick that is due at `now` or later, and counts the missed
    /// ones.
    pub(crate) fn overrun_until(&mut self, now: Time) {
        if self.rate.due() < now && self.skips_ticks() {
            self.overrun(now);
        }
    }

    /// The same, but always skips at least the next tick.
    pub(crate) fn overrun(&mut self, now: Time) {
        self.advance_past(now);
        self.count_overruns(1);
    }

    /// The fault for a tick at `at` that returned an error.
    pub(crate) fn fault(&self, at: Time, cause: Box<dyn Error + Send + Sync>) -> Fault {
        Fault {
            node: self.entry.name.to_string(),
            at,
            cause,
        }
    }

    /// Moves on past the periods before `now`, and counts the skipped ones.
    pub(crate) fn advance_past(&mut self, now: Time) {
        let missed = self.rate.advance_past(now);
        if missed > 0 {
            self.count_overruns(missed);
        }
    }

    fn count_overruns(&self, count: u64) {
        self.entry
            .counters
            .overruns
            .fetch_add(count, Ordering::Relaxed);
    }

    /// Records the measurements of the tick that began at `at` and acted on the world at
    /// `acted`, after the node has moved on to the next one.
    pub(crate) fn note_tick(
        &mut self,
        at: Time,
        lateness: Option<Duration>,
        took: Option<Duration>,
        acted: Option<Time>,
    ) {
        self.meters.record(lateness, took);
        let (entry, counters) = (&self.entry, &self.entry.counters);
        let push = || {
            let newest = entry.push_age.as_ref()?.in_force();
            newest.filter(|push| Some(push.at) == acted)
        };
        self.taps.offer(|| TickRecord {
            number: counters.ticks.load(Ordering::Relaxed).saturating_sub(1),
            at,
            ends: acted,
            lateness,
            took,
            overruns: counters.overruns.load(Ordering::Relaxed),
            push: push(),
        });
    }

    /// Records a tick that was unfinished at the end of the run.
    pub(crate) fn cut_off(&mut self) {
        let running = self.timing.as_mut().and_then(|t| t.running.as_mut());
        if let Some(running) = running.filter(|running| !running.noted) {
            running.noted = true;
            let (began, lateness) = (running.began, running.lateness);
            self.note_tick(began, lateness, None, None);
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
