//! The threads of an executor.
//!
//! Whichever thread is free takes in what arrived, and picks a callback by the rules of virtual
//! time. The steps of a node are in its own log, whichever thread they are on: with the order of
//! the locks that they share, this is all that a run needs to be executed again.

use super::{
    ThreadContext,
    board::{Board, NodeState},
    ends::Report,
    logged::LoggedNode,
    mailbox::{Mailbox, Wakeup},
};
use crate::runtime::{
    clock::{steps::Outcome, wall::Wall},
    command::Command,
    dispatch::Call,
    executor::{Callback, Executor},
    realtime,
    reexecution::Noter,
    sync::{Arc, Mutex, MutexGuard, lock},
    time::Time,
    trigger::Arrival,
};

/// An executor with its nodes and threads.
pub(super) struct Crew<'g> {
    pub(super) threads: usize,
    mailbox: Arc<Mailbox>,
    members: Vec<CrewNode<'g>>,
    board: Mutex<Board>,
}

/// A node of an executor. Its lock is free unless a thread has taken the node on the board.
struct CrewNode<'g> {
    index: usize,
    name: Arc<str>,
    logged: Mutex<LoggedNode<'g>>,
}

/// A tick that takes time, with its beginning: the thread waits for its end.
type Tick = (usize, Time);

/// What a thread does next.
enum CrewStep {
    /// Call a callback, at this run time.
    Call(Call, Time),
    /// End the node's tick.
    Finish(usize),
    /// Wait for more until this run time, with a core kept busy or not.
    Wait(Time, bool),
    /// The run is over.
    Finished,
    /// The run is stopped.
    Stop,
}

impl<'g> Crew<'g> {
    /// The threads for these nodes at run time `now`; `None` without nodes, and if the executor
    /// has no threads.
    pub(super) fn new(
        executor: Executor,
        members: Vec<(LoggedNode<'g>, Callback)>,
        mailbox: Arc<Mailbox>,
        now: Time,
    ) -> Option<Self> {
        let callbacks = members.iter().map(|(_, callback)| callback.clone());
        let nodes = members.iter().map(|(logged, _)| &*logged.node);
        let board = Board::new(executor, callbacks, nodes, now)?;
        let threads = match executor {
            Executor::Multi { threads } => threads,
            _ => 1,
        };
        let members = members.into_iter().map(|(logged, _)| CrewNode {
            index: logged.index,
            name: logged.name(),
            logged: Mutex::new(logged),
        });
        let members: Vec<_> = members.collect();
        Some(Self {
            // A node ticks once at a time: more threads would have nothing to do.
            threads: threads.min(members.len()),
            mailbox,
            members,
            board: Mutex::new(board),
        })
    }

    /// Index and name of its first node.
    pub(super) fn first(&self) -> Option<(usize, Arc<str>)> {
        let first = self.members.first()?;
        Some((first.index, first.name.clone()))
    }

    /// One of its threads.
    pub(super) fn run(&self, context: &ThreadContext) {
        realtime::prepare_thread(context.realtime.as_ref());
        let _noter = Noter::new();
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
                _ if board.stopped => return None,
                Some(wall) => return Some(wall),
                None => drop(board),
            }
            self.mailbox.wait_past(seen);
        }
    }

    /// Ticks until there is something to report, or a stop is requested.
    fn work(&self, context: &ThreadContext, wall: &Wall) -> Option<Report> {
        let (mut tick, mut waited) = (None, false);
        loop {
            let seen = self.mailbox.posts();
            let step = self.next(context, wall, &mut tick, waited);
            waited = matches!(step, CrewStep::Wait(..));
            let (member, outcome) = match step {
                CrewStep::Stop => return None,
                CrewStep::Finished => return Some(Report::Finished),
                CrewStep::Wait(until, busy) => {
                    match busy {
                        true => self.mailbox.spin_past_until(seen, wall, until),
                        false => self.mailbox.wait_past_until(seen, wall, until),
                    }
                    continue;
                }
                CrewStep::Call(call, began) => {
                    if self.threads > 1 {
                        // Another thread looks for the next.
                        self.mailbox.ring();
                    }
                    let outcome = self.call(context, wall, call, began, &mut tick);
                    (call.node(), outcome)
                }
                CrewStep::Finish(member) => {
                    tick = None;
                    (member, self.finish(context, wall, member))
                }
            };
            if let Some(outcome) = outcome {
                return Some(Report::of(self.members[member].index, outcome));
            }
        }
    }

    /// What to do next, with the `tick` that the thread has begun. After the end of the run, a
    /// thread that had `waited` for it looks once more.
    fn next(
        &self,
        context: &ThreadContext,
        wall: &Wall,
        tick: &mut Option<Tick>,
        waited: bool,
    ) -> CrewStep {
        let mut board = lock(&self.board);
        self.take_in(&mut board);
        let (now, until) = (wall.now(), context.until);
        let waits = self.waits(now);
        board.pass(now.min(until), &waits);
        self.obey(context, &mut board, now);
        if board.stopped {
            return CrewStep::Stop;
        }
        if tick.is_none() {
            *tick = board.unfinished.pop();
        }
        if let Some((member, _)) = *tick {
            match tick.and_then(|tick| self.end_of(tick)) {
                // It was ended by a crash of its node.
                None => *tick = None,
                Some((ends, _)) if ends <= now.min(until) => {
                    board.taken[member] = true;
                    return CrewStep::Finish(member);
                }
                Some(_) if now >= until => return CrewStep::Finished,
                Some((ends, busy)) => return CrewStep::Wait(ends.min(until), busy),
            }
        }
        if now > until && !waited {
            return CrewStep::Finished;
        }
        match board.pick(&waits) {
            Some(call) => CrewStep::Call(call, now),
            None if now >= until => CrewStep::Finished,
            None => CrewStep::Wait(board.next_at().min(until), false),
        }
    }

    /// Reads the mailbox.
    fn take_in(&self, board: &mut Board) {
        for wakeup in self.mailbox.take_all() {
            match wakeup {
                Wakeup::Start(wall) => board.wall = Some(wall),
                Wakeup::Stop(_) => board.stopped = true,
                Wakeup::Arrival(Arrival { at, node, input }) => {
                    let member = self.members.iter().position(|known| known.index == node);
                    if let Some(member) = member {
                        board.add_arrival(at, member, input);
                    }
                }
                Wakeup::Command(command) => {
                    let is_of = |known: &CrewNode<'_>| command.node() == Some(&*known.name);
                    if let Some(member) = self.members.iter().position(is_of) {
                        board.commands.push_back((member, command));
                    }
                }
            }
        }
    }

    /// Carries out the commands for nodes that no thread has.
    fn obey(&self, context: &ThreadContext, board: &mut Board, at: Time) {
        for (member, command) in std::mem::take(&mut board.commands) {
            if board.taken[member] {
                board.commands.push_back((member, command));
                continue;
            }
            let mut logged = lock(&self.members[member].logged);
            logged.obey(context, &command, at);
            if let Command::Set(knob) = &command
                && let Some(crashes) = knob.crashes()
            {
                board.changed(member, crashes, logged.node, at);
            }
        }
    }

    /// When the tick ends, and whether it keeps a core busy; `None` if it has ended.
    fn end_of(&self, (member, began): Tick) -> Option<(Time, bool)> {
        let logged = lock(&self.members[member].logged);
        let running = logged.node.running();
        let running = running.filter(|running| running.began == began)?;
        Some((running.ends, running.busy))
    }

    /// Whether a message waits for a node that no thread has.
    fn waits(&self, now: Time) -> impl Fn(usize, usize) -> bool {
        move |member, input| {
            let logged = lock(&self.members[member].logged);
            logged.node.waiting_in(input, now) > 0
        }
    }

    /// Calls a callback, which may begin a `tick` that takes time.
    fn call(
        &self,
        context: &ThreadContext,
        wall: &Wall,
        call: Call,
        began: Time,
        tick: &mut Option<Tick>,
    ) -> Outcome {
        let member = call.node();
        let mut logged = lock(&self.members[member].logged);
        if let Call::Message { input, .. } = call {
            logged.choose_input(input, began);
        }
        let outcome = logged.tick(context, wall, began, |ended| ended);
        *tick = logged.node.running().map(|running| (member, running.began));
        self.put_back(member, logged, wall);
        outcome.flatten()
    }

    /// Ends a tick that takes time.
    fn finish(&self, context: &ThreadContext, wall: &Wall, member: usize) -> Outcome {
        let ended = wall.now();
        let mut logged = lock(&self.members[member].logged);
        let outcome = logged.finish(context, ended, ended);
        self.put_back(member, logged, wall);
        outcome
    }

    /// Puts a node on the board again.
    fn put_back(&self, member: usize, logged: MutexGuard<'_, LoggedNode<'g>>, wall: &Wall) {
        let state = NodeState::of(logged.node);
        drop(logged);
        let mut board = lock(&self.board);
        board.put_back(member, state, &self.waits(wall.now()));
    }
}
