//! A thread of the real clock.
//!
//! Whichever thread of a task set is free takes in what arrived, and asks the schedule for work by
//! the rules of virtual time. What its clock answered and what reached it is in its log: with the
//! order of the locks that threads share, this is all that a run needs to be executed again.

use std::{collections::BTreeSet, mem::take, time::Duration};

use crossbeam_channel::Sender;
use ratelab::{
    Command, Time,
    clock::{JobKind, RunWriter, Wall, Worker},
    journal::{AfterEnd, Entries, Entry},
    sync::{Arc, Mutex, lock},
};

use crate::{
    mailbox::Mailbox,
    priority::{self, CoreShare, RealtimePriority},
    supervisor::{Report, StretchEnd},
};

/// What all threads have in common until the next pause or end.
pub(crate) struct ThreadContext {
    pub(crate) until: Time,
    pub(crate) realtime: Option<RealtimePriority>,
    pub(crate) reporter: Sender<Report>,
    pub(crate) state: RunWriter,
}

/// What the threads of a task set have in hand.
#[derive(Default)]
pub(crate) struct Board {
    pub(crate) mailbox: Arc<Mailbox>,
    work: Mutex<WorkInHand>,
}

#[derive(Default)]
struct WorkInHand {
    /// The nodes that a thread has work for.
    nodes: BTreeSet<usize>,
    /// Number of threads that keep a core busy for a tick.
    spinning: usize,
}

/// A thread of the real clock.
pub(crate) struct WallThread<'c> {
    pub(crate) worker: Worker<'c>,
    pub(crate) board: &'c Board,
    /// The cores that it shares with the threads of other nodes.
    pub(crate) share: Option<CoreShare>,
    pub(crate) log: Entries,
    pub(crate) context: &'c ThreadContext,
}

/// What a thread does next.
enum ThreadStep {
    /// Work of a node that begins at this run time, found by a look that may have been late.
    Work {
        node: usize,
        at: Time,
        late: Option<AfterEnd>,
    },
    /// Wait for more until this run time.
    Wait(Time),
    /// Wait for more until this run time, with a core kept busy.
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
    pub(crate) fn run(mut self) {
        priority::prepare_thread(self.context.realtime.as_ref());
        if let Some(share) = &self.share {
            priority::share_cores(share.rank, &share.cores);
        }
        let _noter = self.log.noter();
        self.place(None);
        let wall = self.board.mailbox.wait_for_start();
        let report = wall.and_then(|wall| self.work(&wall));
        self.place(None);
        if let Some(report) = report {
            // The supervisor holds the receiver until all threads have ended.
            let _ = self.context.reporter.send(report);
        }
    }

    /// Ticks until there is something to report, or a stop is requested.
    fn work(&mut self, wall: &Wall) -> Option<Report> {
        let (mut waited, mut goal) = (false, self.core_time(wall.now()));
        let (mailbox, mut deadline) = (&self.board.mailbox, None);
        loop {
            let seen = mailbox.posts();
            let due = self.deadline(wall.now());
            if due != deadline {
                self.place(due);
                deadline = due;
            }
            let step = self.next(wall, waited, goal);
            waited = !matches!(step, ThreadStep::Work { .. });
            match step {
                ThreadStep::Stop => return None,
                ThreadStep::Finished => return Some(Report::Done),
                ThreadStep::Wait(until) => mailbox.wait_past_until(seen, wall, until),
                ThreadStep::Spin(until) => {
                    mailbox.spin_past_until(seen, wall, until, || false);
                    lock(&self.board.work).spinning -= 1;
                }
                ThreadStep::Compute(goal) => {
                    let reached = || priority::core_time() >= goal;
                    mailbox.spin_past_until(seen, wall, self.context.until, reached);
                }
                ThreadStep::Work { node, at, late } => {
                    if let Some(end) = self.step(wall, node, at, late) {
                        return Some(Report::Ends(end));
                    }
                    goal = self.core_time(wall.now());
                }
            }
        }
    }

    /// Returns the time on a core that the thread will have had when the running tick is over, if
    /// it shares cores.
    fn core_time(&self, now: Time) -> Option<Duration> {
        self.share.as_ref()?;
        Some(priority::core_time() + self.worker.remaining(now)?)
    }

    /// Returns the deadline of the work that it has, if it shares cores by deadlines.
    fn deadline(&self, now: Time) -> Option<Time> {
        self.share.as_ref()?.deadlines.as_ref()?;
        let has_work = self.worker.remaining(now).is_some()
            || self.worker.next_at() <= now
            || !self.board.mailbox.open().arrivals.is_empty();
        self.worker.deadline(now).filter(|_| has_work)
    }

    /// Takes its place among the threads that share its cores by deadlines.
    fn place(&self, deadline: Option<Time>) {
        let share = self.share.as_ref();
        if let Some(ranks) = share.and_then(|share| share.deadlines.as_ref()) {
            ranks.place(deadline);
        }
    }

    /// Returns what to do next. After the end of the run, a thread that had `waited` for it looks
    /// once more. A tick that shares cores is over when its thread has had its `goal`.
    fn next(&mut self, wall: &Wall, waited: bool, goal: Option<Duration>) -> ThreadStep {
        let board = self.board;
        let mut work = lock(&board.work);
        let (now, until) = (wall.now(), self.context.until);
        if self.obey(&work, now) {
            return ThreadStep::Stop;
        }
        // A command may have ended the tick.
        let goal = goal.filter(|_| self.worker.remaining(now).is_some());
        if let Some(goal) = goal {
            if priority::core_time() >= goal
                && let Some(node) = self.worker.find_end(now)
            {
                work.nodes.insert(node);
                let (at, late) = (now, None);
                return ThreadStep::Work { node, at, late };
            }
            if now < until {
                return ThreadStep::Compute(goal);
            }
        } else {
            let over = !waited;
            let late = (now > until).then_some(AfterEnd { until, over });
            if let Some(step) = self.look(&mut work, now, late) {
                return step;
            }
        }
        if now >= until {
            ThreadStep::Finished
        } else {
            self.wait(&mut work, now)
        }
    }

    /// Looks for a job; `None` if there was nothing to be done.
    fn look(
        &mut self,
        work: &mut WorkInHand,
        now: Time,
        late: Option<AfterEnd>,
    ) -> Option<ThreadStep> {
        // A turn is in the log, so it is to be worth that.
        let shared = self.worker.is_shared();
        let arrivals = take(&mut self.board.mailbox.open().arrivals);
        if shared && arrivals.is_empty() && self.worker.next_at() > now {
            return None;
        }
        for arrival in arrivals {
            self.log.note_alone(Entry::Arrive(arrival));
            self.worker.arrive(arrival);
        }
        let found = self.worker.find(now, late);
        if !found.moved && !shared {
            return None;
        }
        let at = now;
        if let Some(node) = found.node {
            work.nodes.insert(node);
            self.ring();
            return Some(ThreadStep::Work { node, at, late });
        }
        let node = None;
        self.log.note(Entry::Look { at, late, node });
        // Run time is there, even if no tick begins.
        self.context.state.advance_to(now);
        None
    }

    /// Returns how to wait for the next event.
    fn wait(&self, work: &mut WorkInHand, now: Time) -> ThreadStep {
        let next = self.worker.next_at().min(self.context.until);
        if self.worker.busy(now) > work.spinning {
            work.spinning += 1;
            return ThreadStep::Spin(next);
        }
        ThreadStep::Wait(next)
    }

    /// Wakes the other threads to look for work.
    fn ring(&self) {
        if self.worker.is_shared() {
            self.board.mailbox.post(|_| {});
        }
    }

    /// Carries out the commands for nodes that no thread has work for; returns whether the run is
    /// stopped after them.
    fn obey(&mut self, work: &WorkInHand, at: Time) -> bool {
        let mut mail = self.board.mailbox.open();
        let free = |(node, _): &mut (usize, Command)| !work.nodes.contains(node);
        let commands: Vec<_> = mail.commands.extract_if(.., free).collect();
        let stopped = mail.stopped.is_some();
        drop(mail);
        for (_, command) in commands {
            if let Some(event) = self.worker.obey(&command, at) {
                let event = event as u64;
                self.log.note(Entry::Obey { at, event });
            }
        }
        stopped
    }

    /// Lets a node do its work; returns how that ends the stretch, if it does.
    fn step(
        &mut self,
        wall: &Wall,
        node: usize,
        at: Time,
        late: Option<AfterEnd>,
    ) -> Option<StretchEnd> {
        let kind = self.worker.begin(at)?;
        let begun = if self.share.is_some() && kind == JobKind::End {
            Entry::Finish { at, node }
        } else {
            let node = Some(node);
            Entry::Look { at, late, node }
        };
        self.log.note(begun);
        let ended = match kind {
            JobKind::Tick { .. } => wall.now(),
            _ => at,
        };
        let mut in_hand = lock(&self.board.work);
        let missed_before = self.missed_before(at, ended);
        let outcome = self.worker.done(ended, missed_before);
        self.log.note(Entry::Done {
            at: ended,
            missed_before,
        });
        in_hand.nodes.remove(&node);
        drop(in_hand);
        self.ring();
        outcome.map(|outcome| StretchEnd::after_tick(node, outcome))
    }

    /// Returns the limit before which due ticks count as missed, for work at `at` that ended at
    /// `ended`. Run time may have stopped or ended while the node was busy: only ticks due by then
    /// are missed.
    fn missed_before(&self, at: Time, ended: Time) -> Time {
        let stopped = self.board.mailbox.open().stopped;
        let last = stopped.unwrap_or(Time::MAX).max(at).min(self.context.until);
        ended.min(last + Time::RESOLUTION)
    }
}
