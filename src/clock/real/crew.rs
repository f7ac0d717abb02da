//! The threads of a crew: those of an executor, or the one of a node.
//!
//! Whichever thread is free takes in what arrived, and asks the schedule for work by the rules of
//! virtual time. What its clock answered and what reached it is in its log: with the order of the
//! locks that threads share, this is all that a run needs to be executed again.

use std::{collections::VecDeque, mem::take, time::Duration};

use super::{
    SUPERVISOR, ThreadContext,
    ends::{Report, StretchEnd},
    mailbox::{Mailbox, Wakeup},
};
use crate::{
    clock::{
        crews::{CrewNodes, Outcome},
        wall::Wall,
    },
    command::Command,
    job::JobKind,
    journal::{Entries, Entry, LateLook},
    realtime::{self, CoreShare},
    scheduling::{Assignment, Moment},
    sync::{Arc, Mutex, lock},
    time::Time,
    trigger::Arrival,
};

/// A crew with its mailbox.
pub(super) struct CrewThreads<'g> {
    nodes: &'g CrewNodes,
    mailbox: Arc<Mailbox>,
    /// The cores that its thread shares with those of other nodes.
    share: Option<CoreShare>,
    /// The log of each thread.
    logs: Vec<Entries>,
    board: Mutex<Board>,
}

/// What its threads know of the world outside.
#[derive(Default)]
struct Board {
    wall: Option<Wall>,
    /// The run time of a requested stop.
    stopped: Option<Time>,
    /// Messages that no thread has taken in, by the places of their nodes.
    arrivals: Vec<Arrival>,
    /// Commands for nodes, by their places.
    commands: VecDeque<(usize, Command)>,
    /// Whether a thread has work for each node.
    taken: Vec<bool>,
    /// Number of threads that keep a core busy for a tick.
    spinning: usize,
}

/// What a thread does next.
enum CrewStep {
    /// A job that begins at this run time, found by a look that may have been late.
    Work(Assignment, Time, Option<LateLook>),
    /// Look again.
    Again,
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

impl<'g> CrewThreads<'g> {
    /// The threads for these `nodes`.
    pub(super) fn new(
        nodes: &'g CrewNodes,
        mailbox: Arc<Mailbox>,
        share: Option<CoreShare>,
    ) -> Self {
        let threads = nodes.nodes().iter().take(nodes.threads);
        let logs = threads.map(|node| nodes.state.entries_of(SUPERVISOR + 1 + node));
        Self {
            mailbox,
            share,
            logs: logs.collect(),
            board: Mutex::new(Board {
                taken: vec![false; nodes.nodes().len()],
                ..Board::default()
            }),
            nodes,
        }
    }

    /// Number of threads.
    pub(super) fn count(&self) -> usize {
        self.nodes.threads
    }

    /// Index and name of the node after which a thread is named.
    pub(super) fn first(&self) -> (usize, Arc<str>) {
        self.nodes.first()
    }

    /// Thread number `thread`.
    pub(super) fn run(&self, thread: usize, context: &ThreadContext) {
        realtime::prepare_thread(context.realtime.as_ref());
        if let Some(share) = &self.share {
            realtime::share_cores(share);
        }
        let log = &self.logs[thread];
        let _noter = log.noter();
        if let Some(wall) = self.start()
            && let Some(report) = self.work(context, &wall, log)
        {
            // The supervisor holds the receiver until all threads have ended.
            let _ = context.reporter.send(report);
        }
    }

    /// Waits for the start; `None` for a stop.
    fn start(&self) -> Option<Wall> {
        loop {
            let seen = self.mailbox.posts();
            let mut board = lock(&self.board);
            self.take_in(&mut board);
            match board.wall {
                // Commands may have come before a stop: they take effect.
                Some(wall) => return Some(wall),
                None if board.stopped.is_some() => return None,
                None => drop(board),
            }
            self.mailbox.wait_past(seen);
        }
    }

    /// Ticks until there is something to report, or a stop is requested.
    fn work(&self, context: &ThreadContext, wall: &Wall, log: &Entries) -> Option<Report> {
        let (mut waited, mut goal) = (false, self.core_time(wall.now()));
        loop {
            let seen = self.mailbox.posts();
            let step = self.next(context, wall, log, waited, goal);
            waited = !matches!(step, CrewStep::Work(..));
            match step {
                CrewStep::Stop => return None,
                CrewStep::Finished => return Some(None),
                CrewStep::Again => {}
                CrewStep::Wait(until) => self.mailbox.wait_past_until(seen, wall, until),
                CrewStep::Spin(until) => {
                    self.mailbox.spin_past_until(seen, wall, until, || false);
                    lock(&self.board).spinning -= 1;
                }
                CrewStep::Compute(goal) => {
                    let reached = || realtime::core_time() >= goal;
                    let until = context.until;
                    self.mailbox.spin_past_until(seen, wall, until, reached);
                }
                CrewStep::Work(work, began, late) => {
                    let outcome = self.step(context, wall, log, (work, began, late));
                    if let Some(outcome) = outcome {
                        let node = self.nodes.nodes()[work.place];
                        return Some(Some(StretchEnd::of(node, outcome)));
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
        let remaining = self.nodes.aside().state(0, now).remaining?;
        Some(realtime::core_time() + remaining)
    }

    /// What to do next. After the end of the run, a thread that had `waited` for it looks once
    /// more. A tick that shares cores is over when its thread has had its `goal`.
    fn next(
        &self,
        context: &ThreadContext,
        wall: &Wall,
        log: &Entries,
        waited: bool,
        goal: Option<Duration>,
    ) -> CrewStep {
        let mut board = lock(&self.board);
        self.take_in(&mut board);
        let (now, until) = (wall.now(), context.until);
        self.obey(&mut board, log, now);
        if let Some(at) = board.stopped {
            self.leave(log, at.min(until) + Time::TICK);
            return CrewStep::Stop;
        }
        // A command may have ended the tick.
        let goal = goal.filter(|_| self.nodes.aside().state(0, now).remaining.is_some());
        if let Some(goal) = goal {
            if realtime::core_time() >= goal {
                board.taken[0] = true;
                return CrewStep::Work(Assignment::end_of_only(), now, None);
            }
            if now < until {
                return CrewStep::Compute(goal);
            }
        } else {
            let late = (now > until).then_some(LateLook {
                until,
                over: !waited,
            });
            if let Some(step) = self.look(&mut board, log, now, late) {
                return step;
            }
        }
        if now >= until {
            self.leave(log, until + Time::TICK);
            return CrewStep::Finished;
        }
        self.wait(&mut board, now, until)
    }

    /// Looks for a job; `None` if there was nothing to be done.
    fn look(
        &self,
        board: &mut Board,
        log: &Entries,
        now: Time,
        late: Option<LateLook>,
    ) -> Option<CrewStep> {
        // A turn is in the log, so it is to be worth that.
        let shared = self.nodes.is_shared();
        if shared && board.arrivals.is_empty() && self.nodes.aside().next_at() > now {
            return None;
        }
        let mut stage = self.nodes.stage();
        for arrival in take(&mut board.arrivals) {
            log.note_alone(Entry::Arrive(arrival));
            stage.add_arrival(arrival);
        }
        let work = stage.look(Moment::of(now, late));
        if !stage.has_moved() && !shared {
            return None;
        }
        match work {
            Some(work) if work.job.kind != JobKind::Take => {
                board.taken[work.place] = true;
                self.ring();
                Some(CrewStep::Work(work, now, late))
            }
            other => {
                let (at, node) = (now, None);
                log.note(Entry::Look { at, late, node });
                // Run time is there, even if no tick begins.
                self.nodes.state.advance_to(now);
                other.map(|_| CrewStep::Again)
            }
        }
    }

    /// How to wait for the next event.
    fn wait(&self, board: &mut Board, now: Time, until: Time) -> CrewStep {
        let stage = self.nodes.aside();
        let next = stage.next_at().min(until);
        let busy = stage.states(now).filter(|task| task.busy).count();
        if busy > board.spinning {
            board.spinning += 1;
            return CrewStep::Spin(next);
        }
        CrewStep::Wait(next)
    }

    /// Has the other threads look for work.
    fn ring(&self) {
        if self.nodes.is_shared() {
            self.mailbox.ring();
        }
    }

    /// Reads the mailbox.
    fn take_in(&self, board: &mut Board) {
        let place = |node: usize| self.nodes.nodes().iter().position(|known| *known == node);
        for wakeup in self.mailbox.take_all() {
            match wakeup {
                Wakeup::Start(wall) => board.wall = Some(wall),
                Wakeup::Stop(at) => board.stopped = Some(at),
                Wakeup::Arrival(arrival) => {
                    let arrival = place(arrival.node).map(|node| Arrival { node, ..arrival });
                    board.arrivals.extend(arrival);
                }
                Wakeup::Command(node, command) => {
                    let command = place(node).map(|node| (node, command));
                    board.commands.extend(command);
                }
            }
        }
    }

    /// Carries out the commands for nodes that no thread has work for.
    fn obey(&self, board: &mut Board, log: &Entries, at: Time) {
        for (place, command) in take(&mut board.commands) {
            if board.taken[place] {
                board.commands.push_back((place, command));
                continue;
            }
            let stage = &mut *self.nodes.stage();
            let event = self.nodes.obey(stage, place, &command, at) as u64;
            log.note(Entry::Obey { at, event });
        }
    }

    /// Ends a node's own thread. Ticks due before `before` are missed.
    fn leave(&self, log: &Entries, before: Time) {
        if self.nodes.is_own {
            self.nodes.stage().close(before, before);
            log.note(Entry::Leave { before });
        }
    }

    /// Has a node do its work, which begins at run time `began`.
    fn step(
        &self,
        context: &ThreadContext,
        wall: &Wall,
        log: &Entries,
        (work, at, late): (Assignment, Time, Option<LateLook>),
    ) -> Outcome {
        let done = self.nodes.work(work, at);
        let node = self.nodes.nodes()[work.place];
        log.note(
            match self.share.is_some() && work.job.kind == JobKind::End {
                true => Entry::Finish { at, node },
                false => {
                    let node = Some(node);
                    Entry::Look { at, late, node }
                }
            },
        );
        let ended = match work.job.kind {
            JobKind::Tick { .. } => wall.now(),
            _ => at,
        };
        let mut board = lock(&self.board);
        let passed = self.passed(&board, context, at, ended);
        let outcome = self.nodes.done(done, ended, passed);
        log.note(Entry::Done { at: ended, passed });
        board.taken[work.place] = false;
        drop(board);
        self.ring();
        outcome
    }

    /// The limit before which due ticks count as missed, for work at `at` that ended at `ended`.
    /// Run time may have stopped or ended while the node was busy: only ticks due by then are
    /// missed.
    fn passed(&self, board: &Board, context: &ThreadContext, at: Time, ended: Time) -> Time {
        let stopped = board.stopped.or_else(|| self.mailbox.stop_requested());
        let last = stopped.unwrap_or(Time::MAX).max(at).min(context.until);
        ended.min(last + Time::TICK)
    }
}
