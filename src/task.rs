//! What a scheduler knows of a node: when its ticks are due, and what they take.

use std::{collections::VecDeque, time::Duration};

use super::{
    knob::{Knob, KnobKind},
    local_clock::LocalClock,
    millis,
    placement::Placement,
    rate::Rate,
    record::{NodeRecord, Records},
    release::Release,
    sync::Arc,
    time::{Hz, Time},
    timing::{Running, TickTiming, Waiting},
    trigger::{Intake, Trigger},
};

/// The most due times in wait: those beyond them are overruns.
pub(crate) const MOST_WAITING: usize = 100_000;

/// The schedule of a node, and where it is in it.
pub struct Task {
    pub(crate) name: Arc<str>,
    pub(crate) priority: u32,
    records: Records,
    /// Number of the next tick.
    number: u64,
    pub(crate) rate: Rate,
    /// The topics that trigger it; it has no use for its rate then.
    trigger: Option<Box<Trigger>>,
    pub(crate) placement: Placement,
    /// Duration and lateness of its ticks, if ever set.
    timing: Option<Box<TickTiming>>,
    /// The seed of the run.
    pub(crate) seed: u64,
    /// Offset of its due times.
    offset: Duration,
    /// Due times that wait in the line of its executor.
    backlog: VecDeque<Time>,
    crashed: bool,
}

impl Task {
    pub(crate) fn new(
        name: Arc<str>,
        priority: u32,
        records: Records,
        release: Release,
        now: Time,
        intakes: Vec<Box<dyn Intake>>,
    ) -> Self {
        let hz = release.hz();
        let trigger = match release {
            Release::Every(_) => None,
            Release::On(matching) => Some(Box::new(Trigger::new(matching, intakes))),
        };
        Self {
            name,
            priority,
            records,
            number: 0,
            rate: Rate::new(hz, now),
            trigger,
            placement: Placement::Thread,
            timing: None,
            seed: 0,
            offset: Duration::ZERO,
            backlog: VecDeque::new(),
            crashed: false,
        }
    }

    /// Its priority: of nodes that are due together the one with the lowest number is first.
    pub fn priority(&self) -> u32 {
        self.priority
    }

    /// Whether messages trigger it.
    pub(crate) fn is_triggered(&self) -> bool {
        self.trigger.is_some()
    }

    /// Whether it ticks on a thread of its own.
    pub(crate) fn has_thread(&self) -> bool {
        !matches!(self.placement, Placement::Executor { .. })
    }

    /// Whether it has logical execution time.
    pub(crate) fn is_let(&self) -> bool {
        self.placement == Placement::Let
    }

    /// Whether it skips ticks that are due while it is busy: it ticks at a rate on a
    /// thread of its own.
    pub(crate) fn skips_ticks(&self) -> bool {
        self.trigger.is_none() && self.has_thread()
    }

    /// Whether it crashed without a restart since.
    pub(crate) fn is_crashed(&self) -> bool {
        self.crashed
    }

    /// Due time of the next tick; [`Time::MAX`] after a crash, and if messages trigger it.
    pub fn due(&self) -> Time {
        match self.crashed || self.is_triggered() {
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
}

/// Messages that trigger it.
impl Task {
    /// Number of the topics that trigger it.
    pub fn inputs(&self) -> usize {
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
}

/// The timer of a node of an executor.
impl Task {
    /// Whether its due times wait in the line of its executor.
    pub(crate) fn queues_timers(&self) -> bool {
        matches!(self.placement, Placement::Executor { queues: true, .. })
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
            let missed = self.rate.advance_past(now + Time::TICK);
            self.count_overruns(missed);
            due
        })
    }

    /// Adds the next due time to those in wait; `false` if they are too many: it is an overrun.
    pub fn queue_timer(&mut self) -> bool {
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
    pub fn queued_timers(&self) -> impl ExactSizeIterator<Item = Time> {
        self.backlog.iter().copied()
    }
}

/// Ticks that begin late and take time.
impl Task {
    fn timing(&mut self) -> &mut TickTiming {
        self.timing.get_or_insert_default()
    }

    /// Duration of the next tick, which starts now, if one is set.
    pub(crate) fn cost(&mut self) -> Option<Duration> {
        let number = self.number;
        self.number += 1;
        let timing = self.timing.as_mut()?;
        timing.cost(self.seed, &self.name, number)
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
        let starts = now + timing.lateness(self.seed, &self.name, self.number);
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

    /// When the delayed tick starts, if there is one.
    pub(crate) fn starts(&self) -> Option<Time> {
        Some(self.timing.as_ref()?.waiting?.starts)
    }

    /// Due time of the delayed tick that starts now.
    pub(crate) fn waited(&mut self) -> Option<Time> {
        let waiting = self.timing.as_mut()?.waiting.take();
        waiting.map(|waiting| waiting.due)
    }

    /// The tick that has started and is not yet over.
    pub fn running(&self) -> Option<&Running> {
        self.timing.as_ref()?.running.as_ref()
    }

    /// Begins a tick that takes run time.
    pub(crate) fn begin(&mut self, running: Running) {
        let timing = self.timing();
        let busy = timing.takes.busy;
        timing.running = Some(Running { busy, ..running });
    }

    /// Ends that tick.
    pub(crate) fn end(&mut self) -> Option<Running> {
        self.timing.as_mut()?.running.take()
    }

    /// Notes the tick that was unfinished at the end of the run, once.
    pub(crate) fn cut_off(&mut self) -> Option<(Time, Option<Duration>)> {
        let running = self.timing.as_mut()?.running.as_mut()?;
        let first = !std::mem::replace(&mut running.noted, true);
        first.then_some((running.began, running.lateness))
    }

    /// Takes the running tick off its core; it needs `remaining` more.
    pub fn suspend(&mut self, remaining: Duration) {
        if let Some(running) = self.timing().running.as_mut() {
            (running.ends, running.suspended) = (Time::MAX, Some(remaining));
        }
    }

    /// Puts the running tick on a core again, where it is over at `ends`.
    pub fn resume(&mut self, ends: Time) {
        if let Some(running) = self.timing().running.as_mut() {
            (running.ends, running.suspended) = (ends, None);
        }
    }

    /// Whether a tick is waiting or running, so that no other can start.
    pub(crate) fn is_occupied(&self) -> bool {
        let timing = self.timing.as_ref();
        timing.is_some_and(|t| t.waiting.is_some() || t.running.is_some())
    }

    /// Time until which no tick at its rate can start; `None` if it is free, and for a
    /// node whose ticks wait instead of being skipped.
    fn occupied_until(&self) -> Option<Time> {
        let timing = self.timing.as_ref();
        timing.filter(|_| self.skips_ticks())?.occupied_until()
    }

    /// Counts the due times before `end` that pass during the current tick.
    pub(crate) fn overrun_before(&mut self, end: Time) {
        let occupied = self.occupied_until();
        self.overrun_until(occupied.map_or(Time::ZERO, |free| free.min(end)));
    }

    /// Moves on to the first tick that is due at `now` or later, and counts the missed
    /// ones.
    #[inline]
    pub(crate) fn overrun_until(&mut self, now: Time) {
        if self.rate.due() < now && self.skips_ticks() {
            let missed = self.rate.advance_past(now);
            self.count_overruns(missed + 1);
        }
    }

    fn count_overruns(&self, ticks: u64) {
        if ticks > 0 {
            self.records.node(|| NodeRecord::Skipped(ticks));
        }
    }
}

/// Knobs.
impl Task {
    /// Checks that its schedule has this knob.
    ///
    /// # Errors
    /// The reason, with a remedy.
    pub(crate) fn check(&self, knob: &Knob) -> Result<(), String> {
        let name = &self.name;
        match knob.kind() {
            KnobKind::Rate | KnobKind::Offset if self.is_triggered() => Err(format!(
                "messages trigger {name}: choose a node that ticks at a rate"
            )),
            KnobKind::Wakes if self.placement != Placement::Thread => Err(format!(
                "{name} has no thread of its own: its executor decides when it starts"
            )),
            _ => Ok(()),
        }
    }

    /// Turns a knob of the schedule at run time `at`; returns the value before. `None` for any
    /// other knob.
    pub(crate) fn turn(&mut self, knob: &Knob, at: Time) -> Option<String> {
        use std::mem::replace;
        Some(match knob {
            Knob::Rate { hz, .. } => self.set_hz(*hz, at).to_string(),
            Knob::Offset { offset, .. } => self.set_offset(*offset, at),
            Knob::Takes { spec, .. } => replace(&mut self.timing().takes, spec.clone()).to_string(),
            Knob::Wakes { spec, .. } => replace(&mut self.timing().wakes, spec.clone()).to_string(),
            Knob::Hang { cost, .. } => {
                let timing = self.timing();
                timing.hang = Some(*cost);
                timing.takes.to_string()
            }
            _ => return None,
        })
    }

    /// Changes the rate at run time `at`; returns the previous one.
    fn set_hz(&mut self, hz: Hz, at: Time) -> Hz {
        let before = self.rate.hz();
        let free = self.free_at(at);
        self.rate.set_hz_while_busy(hz, at, free);
        self.records.node(|| NodeRecord::Rate(hz));
        before
    }

    /// Shifts the due times at run time `at`; returns the previous offset.
    fn set_offset(&mut self, offset: Duration, at: Time) -> String {
        let free = self.free_at(at);
        self.rate.set_offset(offset, free);
        let before = std::mem::replace(&mut self.offset, offset);
        format!("{} ms", millis::to_millis(before))
    }

    /// Has the due times follow another clock from run time `at` on; returns the previous one.
    pub(crate) fn set_clock(&mut self, clock: LocalClock, at: Time) -> LocalClock {
        let free = self.free_at(at);
        self.rate.set_clock(clock, free)
    }

    /// The earliest start of a tick that is due at `at` or later. Counts the ticks missed
    /// until `at`.
    fn free_at(&mut self, at: Time) -> Time {
        self.overrun_before(at);
        self.queue_before(at);
        self.occupied_until().map_or(at, |free| free.max(at))
    }

    /// Stops its ticks; returns whether they had stopped before.
    pub(crate) fn crash(&mut self) -> bool {
        self.backlog.clear();
        if let Some(timing) = &mut self.timing {
            (timing.waiting, timing.running, timing.hang) = (None, None, None);
        }
        self.records.node(|| NodeRecord::Crashed);
        std::mem::replace(&mut self.crashed, true)
    }

    /// Has it tick again, from run time `at` on.
    pub(crate) fn restart(&mut self, at: Time) {
        self.rate.resume(at);
        if let Some(trigger) = &mut self.trigger {
            trigger.reset();
        }
        self.crashed = false;
        self.records.node(|| NodeRecord::Restarted);
    }
}
