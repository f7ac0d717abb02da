//! What every scheduler knows of a node: when its ticks are due, and what they take.

use std::{collections::VecDeque, time::Duration};

use super::timetable::{TaskState, Timetable};
use crate::{
    control::{
        command::{ClockKind, KnobRefusal},
        knob::{Knob, KnobKind, TickTiming},
    },
    node::JobKind,
    rate::Rate,
    settings::{
        chance::Chance,
        draw::{Cost, Draw},
        local_clock::LocalClock,
        release::Overrun,
    },
    sync::Arc,
    time::{Hz, Time},
    trigger::Trigger,
};

/// The schedule of a node, and where it is in it.
pub(crate) struct Task {
    name: Arc<str>,
    /// The seed of the run.
    seed: u64,
    /// Number of the next tick.
    number: u64,
    rate: Rate,
    /// The clock that its rate follows, if that has an error.
    clock: Option<LocalClock>,
    /// The clock that it stamps by, if that is another one.
    stamp_clock: Option<LocalClock>,
    offset: Duration,
    /// What becomes of due times that pass while it is busy.
    overrun: Overrun,
    /// The topics that trigger it; it has no use for its rate then.
    pub(crate) trigger: Option<Trigger>,
    /// Duration of a tick.
    takes: Cost,
    /// Lateness of a tick in virtual time.
    pub(crate) wakes: Draw,
    /// Whether lateness or duration of its ticks were ever set.
    pub(crate) has_times: bool,
    /// Duration of the next tick only, in place of the usual one.
    hang: Option<Duration>,
    /// Duration of the tick that is about to begin.
    next_takes: Duration,
    /// Due times that wait in the line of its executor, each with the one after it.
    backlog: VecDeque<(Time, Time)>,
    pub(crate) running: Option<Running>,
    pub(crate) crashed: bool,
}

/// The greatest number of due times in wait: more are overruns.
const MAX_WAITING: usize = 100_000;

/// A tick that has started and is not yet over.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Running {
    /// Run time of its start.
    pub(crate) began: Time,
    /// Run time of its end, while it has a core.
    pub(crate) ends: Time,
    /// Whether it keeps a core busy under the real clock.
    spins: bool,
    /// Time on a core that it needs, while it has none.
    suspended: Option<Duration>,
}

impl Running {
    /// Returns the time on a core that it needs from `now` on.
    pub(crate) fn remaining(&self, now: Time) -> Duration {
        self.suspended.unwrap_or_else(|| self.ends.since(now))
    }
}

impl Task {
    /// Creates the node called `name`, in a run with this `seed`: at a rate, unless messages
    /// trigger it.
    pub(crate) fn new(name: Arc<str>, seed: u64, rate: Rate, trigger: Option<Trigger>) -> Self {
        Self {
            name,
            seed,
            number: 0,
            rate,
            clock: None,
            stamp_clock: None,
            offset: Duration::ZERO,
            overrun: Overrun::default(),
            trigger,
            takes: Cost::NONE,
            wakes: Draw::NONE,
            has_times: false,
            hang: None,
            next_takes: Duration::ZERO,
            backlog: VecDeque::new(),
            running: None,
            crashed: false,
        }
    }

    /// Returns whether messages trigger it.
    #[inline]
    pub(crate) fn is_triggered(&self) -> bool {
        self.trigger.is_some()
    }

    /// Returns whether its last callback goes on with another set of its message.
    pub(crate) fn goes_on(&self) -> bool {
        let is_free = !self.crashed && self.running.is_none();
        is_free && self.trigger.as_ref().is_some_and(Trigger::has_sets)
    }

    /// Returns where it is, at run time `now`.
    pub(crate) fn state(&self, has_own_timer: bool, now: Time) -> TaskState {
        let last = self.rate.last_due();
        TaskState {
            hz: self.rate.hz(),
            due: self.due(),
            last_due: last.map(|shown| self.when(shown)),
            has_own_timer,
            crashed: self.crashed,
            remaining: self.running.map(|running| running.remaining(now)),
            deadline: None,
            spins: self.running.is_some_and(|running| running.spins),
        }
    }
}

/// Its rate.
impl Task {
    /// Due time of the next tick; [`Time::MAX`] after a crash, and if messages trigger it.
    #[inline]
    pub(crate) fn due(&self) -> Time {
        if self.crashed || self.is_triggered() {
            Time::MAX
        } else {
            self.when(self.rate.due())
        }
    }

    /// Due time of the tick after the next one.
    pub(crate) fn due_after_next(&self) -> Time {
        let mut rate = self.rate.clone();
        rate.advance();
        self.when(rate.due())
    }

    /// Moves on to the next tick; returns when this one was due.
    #[inline]
    pub(crate) fn take_due(&mut self) -> Time {
        let due = self.when(self.rate.due());
        self.rate.advance();
        due
    }

    /// Moves on to the first tick that is due at `time` or later; returns the number of ticks
    /// between.
    pub(crate) fn pass(&mut self, time: Time) -> u64 {
        let shown = self.shows(time);
        self.rate.advance_past(shown)
    }

    /// Counts the ticks of a node on its own that were due before `time`, and do not wait, as missed.
    #[inline]
    pub(crate) fn skip_before(&mut self, time: Time, timetable: &Timetable<'_>) {
        if !self.is_triggered() && self.when(self.rate.due()) < time {
            self.skip_impatient(time - self.overrun.patience(self.rate.hz()), timetable);
        }
    }

    /// Counts the ticks that a clock with a step has due at the same instant as the one that was
    /// taken; a timer of ROS is called once for all of them.
    #[inline]
    pub(crate) fn skip_same_instant(&mut self, due: Time, timetable: &Timetable<'_>) {
        if self.clock.is_some() {
            self.skip_before(due + Time::RESOLUTION, timetable);
        }
    }

    /// Counts the ticks that were due before `patient`, from which on they wait.
    fn skip_impatient(&mut self, patient: Time, timetable: &Timetable<'_>) {
        if self.when(self.rate.due()) < patient {
            let missed = self.pass(patient) + 1;
            timetable.record_skipped(0, missed);
        }
    }

    /// Adds the next due time to the waiting ones; `false` if they are too many.
    pub(crate) fn queue_timer(&mut self) -> bool {
        let room = self.backlog.len() < MAX_WAITING;
        let due = self.take_due();
        if room {
            self.backlog.push_back((due, self.due()));
        }
        room
    }

    /// Returns the first due time in wait, which is called now.
    pub(crate) fn queued_timer(&mut self) -> Option<Time> {
        Some(self.backlog.pop_front()?.0)
    }

    /// Returns the due times in wait, each with the one after it.
    pub(crate) fn queued_timers(&self) -> impl ExactSizeIterator<Item = (Time, Time)> {
        self.backlog.iter().copied()
    }

    /// Delays its first tick by one period, as a timer of ROS does.
    pub(crate) fn skip_first(&mut self) {
        self.rate.skip_first();
    }

    /// Returns the end of the tick that was taken: the next due time of its rate, or the first one
    /// from `free` on.
    pub(crate) fn end_of_period(&self, free: Time) -> Time {
        let mut rate = self.rate.clone();
        rate.resume(rate.due().max(self.shows(free)));
        self.when(rate.due())
    }

    /// Returns the run time at which its clock shows `shown`.
    #[inline]
    fn when(&self, shown: Time) -> Time {
        self.clock.map_or(shown, |clock| clock.when(shown))
    }

    /// Returns what its clock shows first at a run time.
    fn shows(&self, time: Time) -> Time {
        self.clock
            .map_or(time, |clock| clock.first_reading_at(time))
    }
}

/// Ticks that take time.
impl Task {
    /// Draws the duration of the tick that starts now, and counts the tick; `None` if none is set.
    #[inline]
    pub(crate) fn draw_cost(&mut self) -> Option<Duration> {
        let number = self.number;
        self.number += 1;
        if !self.has_times {
            return None;
        }
        let hang = self.hang.take();
        let asked = !self.takes.draw.is_none();
        hang.or_else(|| asked.then(|| self.takes.draw.sample(self.chance("takes"), number)))
    }

    /// Lateness of the next tick.
    #[inline]
    pub(crate) fn lateness(&self) -> Duration {
        if !self.has_times {
            return Duration::ZERO;
        }
        self.wakes.sample(self.chance("wakes"), self.number)
    }

    fn chance<'a>(&'a self, what: &'a str) -> Chance<'a> {
        Chance {
            seed: self.seed,
            what,
            name: &self.name,
        }
    }

    /// Returns what its next tick begins with, which starts now.
    #[inline]
    pub(crate) fn next_job(&mut self, clock: ClockKind) -> JobKind {
        match self.draw_cost() {
            Some(cost) if clock == ClockKind::Real || !cost.is_zero() => self.begins(cost),
            cost => JobKind::Tick {
                is_instant: cost.is_some(),
            },
        }
    }

    /// Returns what a tick begins with that `takes` run time.
    pub(crate) fn begins(&mut self, takes: Duration) -> JobKind {
        self.next_takes = takes;
        JobKind::Begin
    }

    /// It has begun a tick that takes run time; returns when it is over.
    pub(crate) fn begin(&mut self, began: Time) -> Time {
        self.has_times = true;
        let ends = began + self.next_takes;
        let (spins, suspended) = (self.takes.busy, None);
        self.running = Some(Running {
            began,
            ends,
            spins,
            suspended,
        });
        ends
    }

    /// Takes the running tick off its core.
    pub(crate) fn suspend(&mut self, now: Time) {
        if let Some(running) = &mut self.running {
            running.suspended = Some(running.remaining(now));
            running.ends = Time::MAX;
        }
    }

    /// Puts the running tick on a core again; returns when it is over there, or `None` if it is on
    /// one.
    pub(crate) fn resume(&mut self, now: Time) -> Option<Time> {
        let running = self.running.as_mut()?;
        running.ends = now + running.suspended.take()?;
        Some(running.ends)
    }

    /// Returns whether its running tick is over at `now`.
    pub(crate) fn is_over(&self, now: Time) -> bool {
        self.running.is_some_and(|running| running.ends <= now)
    }

    /// Forgets what it was to do, and ticks no more.
    pub(crate) fn crash(&mut self) {
        (self.running, self.hang) = (None, None);
        self.backlog.clear();
        self.crashed = true;
    }

    /// Lets it tick again, from run time `at` on.
    pub(crate) fn restart(&mut self, at: Time) {
        let shown = self.shows(at);
        self.rate.resume(shown);
        if let Some(trigger) = &mut self.trigger {
            trigger.reset();
        }
        self.crashed = false;
    }
}

/// Its knobs.
impl Task {
    /// Checks that it has this knob, and that the value is complete.
    pub(crate) fn check(&self, knob: &Knob, has_thread: bool) -> Result<(), KnobRefusal> {
        let name = || self.name.to_string();
        let of_thread = |kind: KnobKind| kind == KnobKind::Late || kind.sets(TickTiming::Start);
        match knob.kind() {
            KnobKind::Rate | KnobKind::Offset | KnobKind::Late if self.is_triggered() => {
                Err(KnobRefusal::Triggered(name()))
            }
            kind if !has_thread && of_thread(kind) => Err(KnobRefusal::NoThread(name())),
            _ => match knob.draw().and_then(Draw::missing) {
                Some(measured) => Err(KnobRefusal::NotLoaded(measured.file().to_owned())),
                None => Ok(()),
            },
        }
    }

    /// Sets a knob of a node that is busy until `free`; returns the one that was in force.
    pub(crate) fn set(
        &mut self,
        member: usize,
        knob: &Knob,
        free: Time,
        timetable: &Timetable<'_>,
    ) -> Result<Knob, KnobRefusal> {
        use std::mem::replace;
        let kind = knob.kind();
        self.has_times |= kind.sets(TickTiming::Start) || kind.sets(TickTiming::Duration);
        let node = knob.target().to_owned();
        Ok(match knob {
            Knob::Rate { hz, .. } => {
                let before = self.set_hz(*hz, timetable.now(), free);
                timetable.record_rate(member, *hz);
                Knob::Rate { node, hz: before }
            }
            Knob::Offset { offset, .. } => {
                let shown = self.shows(free);
                self.rate.set_offset(*offset, shown);
                let offset = replace(&mut self.offset, *offset);
                Knob::Offset { node, offset }
            }
            Knob::Takes { cost, .. } => {
                let cost = replace(&mut self.takes, cost.clone());
                Knob::Takes { node, cost }
            }
            Knob::Wakes { lateness, .. } => {
                let lateness = replace(&mut self.wakes, lateness.clone());
                Knob::Wakes { node, lateness }
            }
            Knob::Late { overrun, .. } => {
                let overrun = replace(&mut self.overrun, *overrun);
                Knob::Late { node, overrun }
            }
            Knob::Hang { cost, .. } => {
                self.hang = Some(*cost);
                let cost = self.takes.clone();
                Knob::Takes { node, cost }
            }
            Knob::Clock { error, .. } => {
                let clock = LocalClock::new(timetable.now(), *error);
                let before = self.clock.replace(clock).unwrap_or_default();
                self.stamp(member, timetable);
                let shown = self.shows(free);
                self.rate.resume(shown);
                let error = before.error;
                Knob::Clock { node, error }
            }
            Knob::StampClock { error, .. } => {
                let clock = LocalClock::new(timetable.now(), *error);
                let before = self.stamp_clock.replace(clock).or(self.clock);
                self.stamp(member, timetable);
                let error = before.unwrap_or_default().error;
                Knob::StampClock { node, error }
            }
            _ => return Err(KnobRefusal::NotFor(knob.to_string(), "node")),
        })
    }

    /// Stamps its messages by the clock for stamps.
    fn stamp(&self, member: usize, timetable: &Timetable<'_>) {
        if let Some(clock) = self.stamp_clock.or(self.clock) {
            timetable.stamp_by(member, clock);
        }
    }

    fn set_hz(&mut self, hz: Hz, now: Time, free: Time) -> Hz {
        let before = self.rate.hz();
        let (now, free) = (self.shows(now), self.shows(free));
        self.rate.set_hz_while_busy(hz, now, free);
        before
    }
}
