//! The threads of some nodes: those of an executor, or the one of a node.
//!
//! Whichever thread is free takes in what arrived, and asks the stage for work by the rules of
//! virtual time. The steps of a node are in its own log, whichever thread they are on: with the
//! order of the locks that they share, this is all that a run needs to be executed again.

use std::{collections::VecDeque, time::Duration};

use super::{
    ThreadContext,
    ends::Report,
    mailbox::{Mailbox, Wakeup},
};
use crate::{
    clock::{
        steps::{self, Outcome},
        wall::Wall,
    },
    command::Command,
    journal::{Entries, Entry},
    realtime::{self, CoreShare},
    scheduling::{Assignment, Job, Moment, Stage},
    seat::Seat,
    sync::{Arc, Mutex, MutexGuard, lock},
    task::Task,
    time::Time,
    timing::Running,
    trigger::Arrival,
};

/// Nodes with their threads.
pub(super) struct Crew {
    pub(super) threads: usize,
    mailbox: Arc<Mailbox>,
    members: Vec<CrewNode>,
    /// Whether it is a node with a thread of its own.
    is_own: bool,
    /// The cores that its thread shares with those of other nodes.
    share: Option<CoreShare>,
    board: Mutex<Board>,
}

/// A node of a crew. Its lock is free unless a thread has work for it.
struct CrewNode {
    index: usize,
    name: Arc<str>,
    log: Entries,
    seat: Mutex<Seat>,
}

/// What the threads have in common.
struct Board {
    stage: Stage,
    /// Whether a thread has work for each node.
    taken: Vec<bool>,
    /// Commands for nodes.
    commands: VecDeque<(usize, Command)>,
    /// Number of threads that keep a core busy for a tick.
    spinning: usize,
    wall: Option<Wall>,
    /// The run time of a requested stop.
    stopped: Option<Time>,
}

/// What a thread does next.
enum CrewStep {
    /// Assignment that begins at this run time.
    Work(Assignment, Time),
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

impl CrewNode {
    /// Notes the topic that its executor calls it for. What it takes of it belongs to the entry
    /// that follows.
    fn note_call(&self, work: Assignment, at: Time) {
        if let Some(input) = work.input {
            self.log.note_alone(Entry::Choose { at, input });
        }
    }
}

impl Crew {
    /// The threads for the nodes of a `stage`, each given by its index in the graph, with its
    /// log.
    pub(super) fn new(
        stage: Stage,
        threads: usize,
        nodes: Vec<(usize, Seat, Entries)>,
        mailbox: Arc<Mailbox>,
        share: Option<CoreShare>,
    ) -> Self {
        let members = nodes.into_iter().map(|(index, seat, log)| CrewNode {
            index,
            name: seat.name.clone(),
            log,
            seat: Mutex::new(seat),
        });
        let members: Vec<_> = members.collect();
        Self {
            // A node ticks once at a time: more threads would have nothing to do.
            threads: threads.min(members.len()),
            mailbox,
            is_own: stage.tasks.iter().all(Task::has_thread) || share.is_some(),
            share,
            board: Mutex::new(Board {
                stage,
                taken: vec![false; members.len()],
                commands: VecDeque::new(),
                spinning: 0,
                wall: None,
                stopped: None,
            }),
            members,
        }
    }

    /// Index and name of its first node.
    pub(super) fn first(&self) -> Option<(usize, Arc<str>)> {
        let first = self.members.first()?;
        Some((first.index, first.name.clone()))
    }

    /// Its nodes, after all threads have ended.
    pub(super) fn into_nodes(self) -> impl Iterator<Item = (usize, Task, Seat)> {
        let tasks = into_inner(self.board).stage.tasks;
        let members = self.members.into_iter().zip(tasks);
        members.map(|(member, task)| (member.index, task, into_inner(member.seat)))
    }

    /// One of its threads.
    pub(super) fn run(&self, context: &ThreadContext) {
        realtime::prepare_thread(context.realtime.as_ref());
        if let Some(share) = &self.share {
            realtime::share_cores(share);
        }
        let _noter = self.members.first().and_then(|member| member.log.noter());
        if let Some(wall) = self.start()
            && let Some(report) = self.work(context, &wall)
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
    fn work(&self, context: &ThreadContext, wall: &Wall) -> Option<Report> {
        let (mut waited, mut goal) = (false, self.core_time(wall.now()));
        loop {
            let seen = self.mailbox.posts();
            let step = self.next(context, wall, waited, goal);
            waited = !matches!(step, CrewStep::Work(..));
            match step {
                CrewStep::Stop => return None,
                CrewStep::Finished => return Some(Report::Finished),
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
                CrewStep::Work(work, began) => {
                    let outcome = self.step(context, wall, work, began);
                    if let Some(outcome) = outcome {
                        return Some(Report::of(self.members[work.node].index, outcome));
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
        let board = lock(&self.board);
        let running = board.stage.tasks[0].running()?;
        Some(realtime::core_time() + running.remaining(now))
    }

    /// What to do next. After the end of the run, a thread that had `waited` for it looks once
    /// more. A tick that shares cores is over when its thread has had its `goal`.
    fn next(
        &self,
        context: &ThreadContext,
        wall: &Wall,
        waited: bool,
        goal: Option<Duration>,
    ) -> CrewStep {
        let mut board = lock(&self.board);
        self.take_in(&mut board);
        let (now, until) = (wall.now(), context.until);
        self.obey(context, &mut board, now);
        if let Some(at) = board.stopped {
            self.leave(&mut board, at.min(until) + Time::TICK);
            return CrewStep::Stop;
        }
        let running = goal.and_then(|goal| Some((goal, board.stage.finish(0)?)));
        let work = match running {
            Some((goal, _)) if now < until && realtime::core_time() < goal => {
                return CrewStep::Compute(goal);
            }
            Some((goal, work)) => (realtime::core_time() >= goal).then_some(work),
            None => {
                let over = now > until && !waited;
                self.look(context, &mut board.stage, Moment { now, until, over })
            }
        };
        if let Some(work) = work {
            board.taken[work.node] = true;
            self.ring();
            return CrewStep::Work(work, now);
        }
        if now >= until {
            self.leave(&mut board, until + Time::TICK);
            return CrewStep::Finished;
        }
        let next = board.stage.next_at().min(until);
        if board.stage.busy() > board.spinning {
            board.spinning += 1;
            return CrewStep::Spin(next);
        }
        CrewStep::Wait(next)
    }

    /// The next work at a moment.
    fn look(
        &self,
        context: &ThreadContext,
        stage: &mut Stage,
        moment: Moment,
    ) -> Option<Assignment> {
        loop {
            match stage.look(moment)? {
                work if matches!(work.job, Job::Look) => {
                    // Run time is there, even if no tick begins.
                    context.state.advance_to(moment.now);
                    self.note_look(work, moment.now);
                }
                work => return Some(work),
            }
        }
    }

    /// Has the other threads look for work.
    fn ring(&self) {
        if self.threads > 1 {
            self.mailbox.ring();
        }
    }

    /// Reads the mailbox.
    fn take_in(&self, board: &mut Board) {
        for wakeup in self.mailbox.take_all() {
            match wakeup {
                Wakeup::Start(wall) => board.wall = Some(wall),
                Wakeup::Stop(at) => board.stopped = Some(at),
                Wakeup::Arrival(arrival) => {
                    let mut members = self.members.iter();
                    if let Some(node) = members.position(|known| known.index == arrival.node) {
                        board.stage.add_arrival(Arrival { node, ..arrival });
                    }
                }
                Wakeup::Command(command) => {
                    let is_of = |known: &CrewNode| command.node() == Some(&*known.name);
                    if let Some(node) = self.members.iter().position(is_of) {
                        board.commands.push_back((node, command));
                    }
                }
            }
        }
    }

    /// Carries out the commands for nodes that no thread has work for.
    fn obey(&self, context: &ThreadContext, board: &mut Board, at: Time) {
        for (node, command) in std::mem::take(&mut board.commands) {
            if board.taken[node] {
                board.commands.push_back((node, command));
                continue;
            }
            let (member, task) = (&self.members[node], &mut board.stage.tasks[node]);
            let mut seat = lock(&member.seat);
            let event = steps::obey_node(task, &mut seat, &context.state, &command, at) as u64;
            member.log.note(Entry::Obey { at, event });
            if let Command::Set(knob) = &command
                && let Some(crashed) = knob.crashes()
            {
                board.stage.changed(node, crashed, at);
            }
        }
    }

    /// Ends a node's own thread. Ticks due before `before` are missed.
    fn leave(&self, board: &mut Board, before: Time) {
        if self.is_own {
            board.stage.tasks[0].overrun_before(before);
            self.members[0].log.note(Entry::Leave { before });
        }
    }

    /// Notes that a node was called at run time `at` and took messages that are not yet the
    /// inputs of a tick.
    fn note_look(&self, work: Assignment, at: Time) {
        let member = &self.members[work.node];
        // Whoever had work for it before notes that first.
        let _seat = lock(&member.seat);
        member.note_call(work, at);
        member.log.note(Entry::Look { at });
    }

    /// Has a node do its work, which begins at run time `began`.
    fn step(&self, context: &ThreadContext, wall: &Wall, work: Assignment, began: Time) -> Outcome {
        let member = &self.members[work.node];
        let seat = &mut *lock(&member.seat);
        member.note_call(work, began);
        context.state.advance_to(began);
        let (entry, outcome) = match work.job {
            // Noted when it was found.
            Job::Look => return None,
            Job::Tick { lateness, .. } => {
                let outcome = seat.tick(began, true);
                let ended = wall.now();
                let took = ended.since(began);
                // Its next call counts overruns, too: both in turn.
                let mut board = self.board_after(work.node);
                let passed = self.passed(&board, context, began, ended);
                board.stage.ticked(work.node, passed, ended);
                steps::note_tick(seat, began, lateness, took);
                let entry = Entry::Tick {
                    began,
                    took,
                    passed,
                };
                (entry, steps::result(seat, began, outcome))
            }
            Job::Start { lateness, takes } => {
                let started = seat.start(began);
                let mut board = self.board_after(work.node);
                let outcome = match started {
                    Ok(flow) => {
                        let running = Running::new(began, began + takes, lateness, flow);
                        board.stage.started(work.node, running, began);
                        None
                    }
                    Err(cause) => Some(Err(seat.fault(began, cause))),
                };
                (Entry::Start { began }, outcome)
            }
            Job::Finish => {
                let applied = seat.finish(began);
                let mut board = self.board_after(work.node);
                let over = board.stage.missed_before(work.node, began);
                let passed = self.passed(&board, context, began, over);
                let outcome = match board.stage.finished(work.node, passed, began) {
                    Some(running) => seat.over(&running, began, applied),
                    None => applied,
                };
                let ended = began;
                let entry = Entry::Finish { ended, passed };
                (entry, steps::result(seat, began, outcome))
            }
        };
        member.log.note(entry);
        self.ring();
        outcome
    }

    /// The board, after a thread has done its work for a node.
    fn board_after(&self, node: usize) -> MutexGuard<'_, Board> {
        let mut board = lock(&self.board);
        board.taken[node] = false;
        board
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

fn into_inner<T>(mutex: Mutex<T>) -> T {
    let inner = mutex.into_inner();
    inner.unwrap_or_else(|poisoned| poisoned.into_inner())
}
