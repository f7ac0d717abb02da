//! The threads of a stretch under the real clock, executed again.

use std::{
    cell::Cell,
    collections::{BTreeMap, BTreeSet},
    rc::Rc,
};

use ratelab::{
    ClockExit, Command, Event, EventKind, Fault, Time,
    clock::{Obeyed, Outcome, RunWriter, Supervision, TaskSets, Worker},
    journal::{End, Entries, Entry, Following},
    sync::{Arc, spawn_named, thread},
};
use thiserror::Error;

use crate::{
    plan::{LoggedEntry, PlanStep, took},
    watch::{Script, Watch},
};

/// The events of the recorded run, then the first events of a branch.
#[derive(Debug)]
pub(crate) struct RecordedEvents {
    pub(crate) all: Vec<Event>,
    /// Positions of the events that happened under the real clock.
    pub(crate) known: BTreeSet<usize>,
    /// Of these, commands that are refused again without a try.
    pub(crate) refused: BTreeSet<usize>,
}

impl RecordedEvents {
    /// Adds a command for run time `at`; returns its position.
    pub(crate) fn add(&mut self, at: Time, command: Command) -> usize {
        let what = EventKind::Applied { command, was: None };
        self.all.push(Event { at, what });
        self.all.len() - 1
    }

    /// Returns the command at a position, with the reason if it is to be refused as recorded.
    pub(crate) fn command(&self, event: usize) -> Option<(&Command, Option<&str>)> {
        match &self.all.get(event)?.what {
            EventKind::Applied { command, .. } => Some((command, None)),
            EventKind::Refused { command, reason } => {
                let again = self.refused.contains(&event);
                Some((command, again.then_some(&**reason)))
            }
            _ => None,
        }
    }
}

/// What all threads of a run know.
#[derive(Clone, Copy)]
pub(super) struct RunView<'a> {
    pub(super) events: &'a RecordedEvents,
    pub(super) watch: &'a Arc<Watch>,
    pub(super) state: &'a RunWriter,
}

/// All threads of a stretch, by their numbers.
pub(super) struct Players<'a> {
    run: RunView<'a>,
    all: Vec<ThreadPlayer<'a>>,
}

/// Does again what a thread did, and logs it as that did.
struct ThreadPlayer<'a> {
    run: RunView<'a>,
    /// Its number: zero is the supervisor.
    number: usize,
    entries: &'a [LoggedEntry],
    /// Number of entries done.
    done: usize,
    /// `None` for a node without a thread.
    role: Option<Role<'a>>,
    log: Entries,
    /// How its last work ended the run, if it did.
    outcome: Outcome,
    /// What its last command ended the stretch with, if it did.
    exit: Option<ClockExit>,
}

/// Who a thread is.
enum Role<'a> {
    Supervisor(Supervision<'a>),
    Worker(Worker<'a>),
}

/// Refuses a command at rest, as recorded.
pub(super) fn refuse_again(state: &RunWriter, command: &Command, at: Time, reason: &str) -> Obeyed {
    state.advance_to(at);
    let event = state.log_refused(at, command, reason);
    Obeyed { event, exit: None }
}

impl<'a> Players<'a> {
    /// Creates the `threads` of a stretch of a run, before their first entry.
    pub(super) fn new(
        run: RunView<'a>,
        threads: &'a [Vec<LoggedEntry>],
        task_sets: &'a TaskSets<'a>,
        supervision: Supervision<'a>,
    ) -> Self {
        run.state.begin_threads(threads.len() - 1);
        let workers = task_sets
            .groups()
            .into_iter()
            .flat_map(|group| group.workers)
            .map(|(node, worker)| (node + 1, Role::Worker(worker)));
        let supervisor = [(0, Role::Supervisor(supervision))];
        let mut roles: BTreeMap<usize, Role<'a>> = supervisor.into_iter().chain(workers).collect();
        let all = threads
            .iter()
            .enumerate()
            .map(|(number, entries)| ThreadPlayer {
                run,
                number,
                entries,
                done: 0,
                role: roles.remove(&number),
                log: run.state.entries_of(number),
                outcome: None,
                exit: None,
            })
            .collect();
        Self { run, all }
    }

    /// Takes these `steps`, of one entry, on the calling thread.
    pub(super) fn alone(&mut self, steps: &[PlanStep]) {
        if let Some(last) = steps.last() {
            self.all[last.thread].play(last.entry + 1);
        }
    }

    /// Takes these `steps`, each on the thread of its player; the supervisor's are taken on the
    /// calling thread.
    pub(super) fn together(&mut self, steps: &[PlanStep]) {
        let watch = self.run.watch;
        let mut ends: Vec<usize> = self.all.iter().map(|player| player.done).collect();
        for step in steps {
            ends[step.thread] = step.entry + 1;
        }
        let mut players = self
            .all
            .iter_mut()
            .zip(ends)
            .filter(|(player, end)| *end > player.done)
            .peekable();
        let play = |player: &mut ThreadPlayer<'_>, end: usize| {
            player.play(end);
            watch.leave();
        };
        thread::scope(|scope| {
            let supervisor = players.next_if(|(player, _)| player.number == 0);
            for (player, end) in players {
                let name = watch.name(player.number);
                if let Err(error) = spawn_named(scope, name, move || play(player, end)) {
                    watch.differs(format!("{name} has no thread: {error}"));
                }
            }
            if let Some((supervisor, end)) = supervisor {
                play(supervisor, end);
            }
        });
    }

    /// Plays these steps, held between any two operations until nobody looks on any more.
    pub(super) fn held(&mut self, steps: &[PlanStep]) {
        let takes = |step: &&PlanStep| {
            let entry = &self.all[step.thread].entries[step.entry];
            !entry.operations.is_empty()
        };
        let order = steps.iter().filter(takes).map(|step| step.thread);
        let threads: BTreeSet<usize> = steps.iter().map(|step| step.thread).collect();
        self.run.watch.hold(order.collect(), threads.len());
        self.together(steps);
        self.run.watch.wait_for_end();
    }

    /// Comes to the recorded `end`, if the log goes on to there.
    pub(super) fn end(self, end: Option<End>) -> Result<Option<ClockExit>, Fault> {
        let watch = self.run.watch;
        if watch.is_over() {
            return Ok(Some(ClockExit::Stopped));
        }
        let Some(end) = end else {
            return Ok(None);
        };
        self.all[0].log.note_alone(Entry::End(end));
        self.come_to(end).unwrap_or_else(|difference| {
            watch.differs(difference.to_string());
            Ok(Some(ClockExit::Stopped))
        })
    }

    /// Comes to the recorded `end`, or to a difference from it.
    fn come_to(self, end: End) -> Result<Result<Option<ClockExit>, Fault>, PlayError> {
        let RunView { watch, state, .. } = self.run;
        let exit = self.all[0].exit.clone();
        let outcomes = self.all.into_iter().filter_map(|player| {
            let last = player.entries.get(player.done.checked_sub(1)?)?;
            Some((last.node?, player.outcome?))
        });
        let mut outcomes: BTreeMap<usize, Result<Time, Fault>> = outcomes.collect();
        let mut others = outcomes.values();
        if let Some(other) = others.find_map(|outcome| unexplained(end, outcome)) {
            return Err(PlayError::Ended(other));
        }
        let name = |node: usize| watch.name(node.saturating_add(1)).to_owned();
        let exit = match end {
            End::Left => Some(Ok(None)),
            End::Paused => state.status().paused.then_some(Ok(None)),
            End::Completed { until } => {
                state.set_now(until);
                Some(Ok(Some(ClockExit::Completed)))
            }
            End::Stopped | End::HandedOver => exit.map(|exit| Ok(Some(exit))),
            End::Ended { node, at } => {
                let ended = outcomes.remove(&node).and_then(Result::ok);
                let node = name(node);
                (ended == Some(at)).then_some(Ok(Some(ClockExit::Ended { node, at })))
            }
            End::Failed { node, at } => {
                let fault = outcomes.remove(&node).and_then(Result::err);
                fault.filter(|fault| fault.at == at).map(Err)
            }
            End::NoThread { node, at } => {
                let node = name(node);
                let cause = "the system gave it no thread in the recorded run".into();
                Some(Err(Fault { node, at, cause }))
            }
        };
        exit.ok_or(PlayError::OtherEnd(end))
    }
}

/// Returns what a node did to end the run, if the recorded `end` does not explain that.
fn unexplained(end: End, outcome: &Result<Time, Fault>) -> Option<String> {
    match (end, outcome) {
        (End::Failed { .. } | End::NoThread { .. }, _) | (End::Ended { .. }, Ok(_)) => None,
        (_, Ok(at)) => Some(format!("a node ended the run at {at}")),
        (_, Err(fault)) => Some(fault.to_string()),
    }
}

impl ThreadPlayer<'_> {
    /// Runs the next entries up to this `end`.
    fn play(&mut self, end: usize) {
        let watch = self.run.watch;
        while self.done < end {
            let logged = &self.entries[self.done];
            let at = logged.entry.at().unwrap_or_default();
            let seen = logged
                .node
                .map(|node| node.saturating_add(1))
                .unwrap_or(self.number);
            if !watch.begins(seen, at, took(&self.entries[self.done..])) {
                return;
            }
            let script = Rc::new(Script {
                watch: watch.clone(),
                thread: self.number,
                operations: logged.operations.clone(),
                done: Cell::new(0),
            });
            let following = Following::new(script.clone());
            match self.step(logged.entry) {
                Ok(done) => self.log.add(&done, &logged.operations),
                Err(why) => watch.differs(format!("{} at {at}: {why}", watch.name(self.number))),
            }
            drop(following);
            script.finish();
            watch.finishes(seen);
            self.done += 1;
        }
    }

    /// Does an entry; returns it, that of a command with the position in the event log of this
    /// run, or the difference from the recorded run.
    fn step(&mut self, entry: Entry) -> Result<Entry, PlayError> {
        if self.outcome.is_some() {
            return Err(PlayError::HadEnded);
        }
        match (&mut self.role, entry) {
            (None, _) => return Err(PlayError::NoThread),
            (_, Entry::Obey { at, event }) => {
                let event = self.obey(event, at).ok_or(PlayError::NoNode)?;
                return Ok(Entry::Obey { at, event });
            }
            (Some(Role::Worker(worker)), Entry::Arrive(arrival)) => worker.arrive(arrival),
            (Some(Role::Worker(worker)), Entry::Look { at, late, node }) => {
                self.run.state.advance_to(at);
                let found = worker.find(at, late).node;
                worker.begin(at);
                self.check(node, found)?;
            }
            (Some(Role::Worker(worker)), Entry::Finish { at, node }) => {
                let found = worker.find_end(at);
                worker.begin(at);
                self.check(Some(node), found)?;
            }
            (Some(Role::Worker(worker)), Entry::Done { at, missed_before }) => {
                self.outcome = worker.done(at, missed_before);
            }
            _ => return Err(PlayError::Impossible(entry)),
        }
        Ok(entry)
    }

    /// Carries out the command of a recorded event; returns the position of this run's.
    fn obey(&mut self, event: u64, at: Time) -> Option<u64> {
        let (command, refusal) = self.run.events.command(usize::try_from(event).ok()?)?;
        let event = match (self.role.as_mut()?, refusal) {
            (Role::Worker(worker), Some(reason)) => worker.refuse(command, at, reason),
            (Role::Worker(worker), None) => worker.obey(command, at)?,
            (Role::Supervisor(supervision), None) => {
                let obeyed = supervision.obey(command, at);
                self.exit = obeyed.exit;
                obeyed.event
            }
            (Role::Supervisor(_), Some(reason)) => {
                refuse_again(self.run.state, command, at, reason).event
            }
        };
        Some(event as u64)
    }

    /// Checks that the node did some work that did so in the recorded run.
    fn check(&self, recorded: Option<usize>, worked: Option<usize>) -> Result<(), PlayError> {
        if worked == recorded {
            return Ok(());
        }
        let name = |node: Option<usize>| match node {
            Some(node) => self.run.watch.name(node.saturating_add(1)),
            None => "nobody",
        };
        Err(PlayError::OtherNode {
            now: name(worked).to_owned(),
            before: name(recorded).to_owned(),
        })
    }
}

/// A difference from the recorded run.
#[derive(Clone, Debug, Error)]
pub enum PlayError {
    /// A node ended the run, in these words.
    #[error("{0}; the recorded run went on")]
    Ended(String),
    /// The run has not come to its recorded end.
    #[error("it did not come to its recorded end, {0:?}")]
    OtherEnd(End),
    /// A thread that had ended goes on.
    #[error("it had ended before")]
    HadEnded,
    /// A node without a thread.
    #[error("it has no thread, and had one")]
    NoThread,
    /// A command for a node that does not exist.
    #[error("it has no such node")]
    NoNode,
    /// An entry that no thread writes.
    #[error("no thread can have done {0:?}")]
    Impossible(Entry),
    /// Another node had something to do.
    #[error("{now} had something to do where {before} had in the recorded run")]
    OtherNode {
        /// The node of this run.
        now: String,
        /// The node of the recorded run.
        before: String,
    },
}
