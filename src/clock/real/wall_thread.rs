//! A thread of the real clock.
//!
//! Whichever thread of a crew is free takes in what arrived, and asks the schedule for work by the
//! rules of virtual time. What its clock answered and what reached it is in its log: with the
//! order of the locks that threads share, this is all that a run needs to be executed again.

use std::{
    collections::{BTreeSet, VecDeque},
    mem::take,
    time::Duration,
};

use super::{
    ThreadContext,
    mailbox::{Mailbox, Wakeup},
    supervisor::{Report, StretchEnd},
};
use crate::{
    clock::{crew_thread::CrewThread, wall::Wall},
    command::Command,
    journal::{Entries, Entry, LateLook},
    realtime::{self, CoreShare},
    scheduling::{Assignment, JobKind},
    sync::{Arc, Mutex, lock},
    time::Time,
    trigger::Arrival,
};

/// What the threads of a crew know of the world outside, and what they do.
#[derive(Default)]
pub(super) struct Board {
    mailbox: Arc<Mailbox>,
    notes: Mutex<Notes>,
}

#[derive(Default)]
struct Notes {
    wall: Option<Wall>,
    /// The run time of a requested stop.
    stopped: Option<Time>,
    /// Messages that no thread has taken in.
    arrivals: Vec<Arrival>,
    /// Commands for nodes, by their indices.
    commands: VecDeque<(usize, Command)>,
    /// The nodes that a thread has work for.
    taken: BTreeSet<usize>,
    /// Number of threads that keep a core busy for a tick.
    spinning: usize,
}

impl Board {
    pub(super) fn new(mailbox: Arc<Mailbox>) -> Self {
        let notes = Mutex::default();
        Self { mailbox, notes }
    }
}

/// A thread of the real clock.
pub(super) struct WallThread<'c> {
    pub(super) hand: CrewThread<'c>,
    pub(super) board: &'c Board,
    /// The cores that it shares with the threads of other nodes.
    pub(super) share: Option<CoreShare>,
    pub(super) log: Entries,
    pub(super) context: &'c ThreadContext,
}

/// What a thread does next.
enum ThreadStep {
    /// A job that begins at this run time, found by a look that may have been late.
    Work(Assignment, Time, Option<LateLook>),
    /// Wait for more until this run time.
    Wait(Time),
    /// The same, with a core kept busy.
    Spin(Time),
    /// Keep a core busy until the thread has had this time on it.
    Compute(Duration),
    /// The run is over.
    Finished,
    /// The run is stopped.
    Stop,
}

impl WallThread<'_> {
    /// Ticks until the end.
    pub(super) fn run(mut self) {
        realtime::prepare_thread(self.context.realtime.as_ref());
        if let Some(share) = &self.share {
            realtime::share_cores(share);
        }
        let _noter = self.log.noter();
        if let Some(wall) = self.start()
            && let Some(report) = self.work(&wall)
        {
            // The supervisor holds the receiver until all threads have ended.
            let _ = self.context.reporter.send(report);
        }
    }

    /// Waits for the start; `None` for a stop.
    fn start(&self) -> Option<Wall> {
        loop {
            let seen = self.board.mailbox.posts();
            let mut notes = lock(&self.board.notes);
            self.take_in(&mut notes);
            match notes.wall {
                // Commands may have come before a stop: they take effect.
                Some(wall) => return Some(wall),
                None if notes.stopped.is_some() => return None,
                None => drop(notes),
            }
            self.board.mailbox.wait_past(seen);
        }
    }

    /// Ticks until there is something to report, or a stop is requested.
    fn work(&mut self, wall: &Wall) -> Option<Report> {
        let (mut waited, mut goal) = (false, self.core_time(wall.now()));
        let mailbox = &self.board.mailbox;
        loop {
            let seen = mailbox.posts();
            let step = self.next(wall, waited, goal);
            waited = !matches!(step, ThreadStep::Work(..));
            match step {
                ThreadStep::Stop => return None,
                ThreadStep::Finished => return Some(None),
                ThreadStep::Wait(until) => mailbox.wait_past_until(seen, wall, until),
                ThreadStep::Spin(until) => {
                    mailbox.spin_past_until(seen, wall, until, || false);
                    lock(&self.board.notes).spinning -= 1;
                }
                ThreadStep::Compute(goal) => {
                    let reached = || realtime::core_time() >= goal;
                    mailbox.spin_past_until(seen, wall, self.context.until, reached);
                }
                ThreadStep::Work(work, began, late) => {
                    if let Some(end) = self.step(wall, (work, began, late)) {
                        return Some(Some(end));
                    }
                    goal = self.core_time(wall.now());
                }
            }
        }
    }

    /// The time on a core that the thread will have had when the running tick is over, if it
    /// shares cores.
    fn core_time(&self, now: Time) -> Option<Duration> {
        self.share.as_ref()?;
        Some(realtime::core_time() + self.hand.remaining(now)?)
    }

    /// What to do next. After the end of the run, a thread that had `waited` for it looks once
    /// more. A tick that shares cores is over when its thread has had its `goal`.
    fn next(&mut self, wall: &Wall, waited: bool, goal: Option<Duration>) -> ThreadStep {
        let board = self.board;
        let mut notes = lock(&board.notes);
        self.take_in(&mut notes);
        let (now, until) = (wall.now(), self.context.until);
        self.obey(&mut notes, now);
        if notes.stopped.is_some() {
            return ThreadStep::Stop;
        }
        // A command may have ended the tick.
        let goal = goal.filter(|_| self.hand.remaining(now).is_some());
        if let Some(goal) = goal {
            if realtime::core_time() >= goal
                && let Some(work) = self.hand.crew().end_of_first(now)
            {
                notes.taken.insert(work.node);
                return ThreadStep::Work(work, now, None);
            }
            if now < until {
                return ThreadStep::Compute(goal);
            }
        } else {
            let over = !waited;
            let late = (now > until).then_some(LateLook { until, over });
            if let Some(step) = self.look(&mut notes, now, late) {
                return step;
            }
        }
        match now >= until {
            true => ThreadStep::Finished,
            false => self.wait(&mut notes, now),
        }
    }

    /// Looks for a job; `None` if there was nothing to be done.
    fn look(&mut self, notes: &mut Notes, now: Time, late: Option<LateLook>) -> Option<ThreadStep> {
        // A turn is in the log, so it is to be worth that.
        let crew = self.hand.crew();
        let shared = crew.is_shared();
        if shared && notes.arrivals.is_empty() && crew.aside().next_at() > now {
            return None;
        }
        for arrival in take(&mut notes.arrivals) {
            self.log.note_alone(Entry::Arrive(arrival));
            self.hand.arrive(arrival);
        }
        let found = self.hand.find(now, late);
        if !found.moved && !shared {
            return None;
        }
        if let Some(work) = found.work {
            notes.taken.insert(work.node);
            self.ring();
            return Some(ThreadStep::Work(work, now, late));
        }
        let (at, node) = (now, None);
        self.log.note(Entry::Look { at, late, node });
        // Run time is there, even if no tick begins.
        crew.state.advance_to(now);
        None
    }

    /// How to wait for the next event.
    fn wait(&self, notes: &mut Notes, now: Time) -> ThreadStep {
        let stage = self.hand.crew().aside();
        let next = stage.next_at().min(self.context.until);
        let busy = stage.states(now).filter(|task| task.busy).count();
        if busy > notes.spinning {
            notes.spinning += 1;
            return ThreadStep::Spin(next);
        }
        ThreadStep::Wait(next)
    }

    /// Has the other threads look for work.
    fn ring(&self) {
        if self.hand.crew().is_shared() {
            self.board.mailbox.ring();
        }
    }

    /// Reads the mailbox.
    fn take_in(&self, notes: &mut Notes) {
        for wakeup in self.board.mailbox.take_all() {
            match wakeup {
                Wakeup::Start(wall) => notes.wall = Some(wall),
                Wakeup::Stop(at) => notes.stopped = Some(at),
                Wakeup::Arrival(arrival) => notes.arrivals.push(arrival),
                Wakeup::Command(node, command) => notes.commands.push_back((node, command)),
            }
        }
    }

    /// Carries out the commands for nodes that no thread has work for.
    fn obey(&mut self, notes: &mut Notes, at: Time) {
        for (node, command) in take(&mut notes.commands) {
            if notes.taken.contains(&node) {
                notes.commands.push_back((node, command));
            } else if let Some(event) = self.hand.obey(&command, at) {
                let event = event as u64;
                self.log.note(Entry::Obey { at, event });
            }
        }
    }

    /// Has a node do its work; returns how that ends the stretch, if it does.
    fn step(
        &mut self,
        wall: &Wall,
        (work, at, late): (Assignment, Time, Option<LateLook>),
    ) -> Option<StretchEnd> {
        let node = work.node;
        self.hand.work(work, at);
        let begun = match self.share.is_some() && work.job.kind == JobKind::End {
            true => Entry::Finish { at, node },
            false => {
                let node = Some(node);
                Entry::Look { at, late, node }
            }
        };
        self.log.note(begun);
        let ended = match work.job.kind {
            JobKind::Tick { .. } => wall.now(),
            _ => at,
        };
        let mut notes = lock(&self.board.notes);
        let passed = self.passed(&notes, at, ended);
        let outcome = self.hand.done(ended, passed);
        self.log.note(Entry::Done { at: ended, passed });
        notes.taken.remove(&node);
        drop(notes);
        self.ring();
        outcome.map(|outcome| StretchEnd::of(node, outcome))
    }

    /// The limit before which due ticks count as missed, for work at `at` that ended at `ended`.
    /// Run time may have stopped or ended while the node was busy: only ticks due by then are
    /// missed.
    fn passed(&self, notes: &Notes, at: Time, ended: Time) -> Time {
        let stopped = notes
            .stopped
            .or_else(|| self.board.mailbox.stop_requested());
        let last = stopped.unwrap_or(Time::MAX).max(at).min(self.context.until);
        ended.min(last + Time::RESOLUTION)
    }
}
