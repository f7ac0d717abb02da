//! The threads of a stretch under the real clock, executed again.

use std::collections::BTreeMap;

use ratelab::{
    ClockExit, Command, End, Entries, Entry, Fault, Obeyed, Outcome, RunState, Supervision,
    TaskSets, Time, Worker,
    sync::{Arc, spawn_named, thread},
};

use super::{
    entry::{LoggedEntry, took},
    events::RecordedEvents,
    script::Script,
    watch::Watch,
};

/// What all threads of a run know.
#[derive(Clone, Copy)]
pub(super) struct RunView<'a> {
    pub(super) events: &'a RecordedEvents,
    pub(super) watch: &'a Arc<Watch>,
    pub(super) state: &'a RunState,
}

/// All threads of a stretch, by their numbers.
pub(super) struct Players<'a> {
    run: RunView<'a>,
    all: Vec<ThreadPlayer<'a>>,
    /// The turns of what runs on the calling thread.
    script: std::rc::Rc<Script>,
}

/// Does again what a thread did, and logs it as that did.
struct ThreadPlayer<'a> {
    run: RunView<'a>,
    /// Its number: zero is the supervisor.
    number: usize,
    entries: &'a [LoggedEntry],
    /// Number of entries done.
    done: usize,
    role: Role<'a>,
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
    /// A node without a thread.
    Nobody,
}

/// Refuses a command at rest, as recorded.
pub(super) fn refuse_again(state: &RunState, command: &Command, at: Time, reason: &str) -> Obeyed {
    state.advance_to(at);
    let event = state.refused(at, command, reason);
    Obeyed { event, exit: None }
}

impl<'a> Players<'a> {
    /// The `threads` of a stretch of a run, before their first entry.
    pub(super) fn new(
        run: RunView<'a>,
        threads: &'a [Vec<LoggedEntry>],
        task_sets: &'a TaskSets<'a>,
        supervision: Supervision<'a>,
    ) -> Self {
        run.state.begin_threads(threads.len() - 1);
        let workers = task_sets.threads();
        let workers = workers.map(|(node, worker)| (node + 1, Role::Worker(worker)));
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
                role: roles.remove(&number).unwrap_or(Role::Nobody),
                log: run.state.entries_of(number),
                outcome: None,
                exit: None,
            });
        Self {
            run,
            all: all.collect(),
            script: Script::new(run.watch),
        }
    }

    /// Their number.
    pub(super) fn len(&self) -> usize {
        self.all.len()
    }

    /// Runs the next entry of thread number `thread` on the calling thread.
    pub(super) fn entry(&mut self, thread: usize) {
        let _following = self.script.follow();
        self.all[thread].play(&self.script, 1);
    }

    /// Runs so many of the next entries of each thread at the same time.
    pub(super) fn together(&mut self, counts: &[usize]) {
        let watch = self.run.watch;
        let players = self.all.iter_mut().zip(counts.iter().copied());
        let mut players = players.filter(|(_, count)| *count > 0).peekable();
        thread::scope(|scope| {
            let supervisor = players.next_if(|(player, _)| player.number == 0);
            for (player, count) in players {
                let name = watch.name(player.number);
                if let Err(error) = spawn_named(scope, name, move || player.play_alone(count)) {
                    watch.differs(format!("{name} has no thread: {error}"));
                }
            }
            if let Some((supervisor, count)) = supervisor {
                supervisor.play_alone(count);
            }
        });
    }

    /// Comes to the recorded `end`.
    pub(super) fn end(self, end: Option<End>) -> Result<Option<ClockExit>, Fault> {
        let RunView { watch, state, .. } = self.run;
        let Some(end) = end.filter(|_| !watch.is_over()) else {
            return Ok(Some(ClockExit::Stopped));
        };
        let supervisor = &self.all[0];
        supervisor.log.note_alone(Entry::End(end));
        let exit = supervisor.exit.clone();
        let outcomes = self.all.into_iter().filter_map(|player| {
            let last = player.entries.get(player.done.checked_sub(1)?)?;
            Some((last.node?, player.outcome?))
        });
        let mut outcomes: BTreeMap<usize, Result<Time, Fault>> = outcomes.collect();
        let name = |node: usize| watch.name(node + 1).to_owned();
        let recorded = match end {
            End::Paused => state.status().paused.then_some(Ok(None)),
            End::Left => Some(Ok(None)),
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
        watch.differs(match (recorded, another(end, outcomes.into_values())) {
            (Some(end), None) => return end,
            (_, Some(outcome)) => format!("{outcome}; the recorded run went on"),
            (None, None) => format!("it did not come to its recorded end, {end:?}"),
        });
        Ok(Some(ClockExit::Stopped))
    }
}

/// The first of the `others` that the recorded `end` does not explain.
fn another(end: End, mut others: impl Iterator<Item = Result<Time, Fault>>) -> Option<String> {
    match end {
        End::Failed { .. } | End::NoThread { .. } => None,
        End::Ended { .. } => others.find_map(|outcome| Some(outcome.err()?.to_string())),
        _ => others.next().map(|outcome| match outcome {
            Ok(at) => format!("a node ended the run at {at}"),
            Err(fault) => fault.to_string(),
        }),
    }
}

impl ThreadPlayer<'_> {
    /// Runs the next entries on a thread of its own.
    fn play_alone(&mut self, count: usize) {
        let script = Script::new(self.run.watch);
        let _following = script.follow();
        self.play(&script, count);
        self.run.watch.hold().leave();
    }

    /// Runs the next entries.
    fn play(&mut self, script: &Script, count: usize) {
        let (watch, entries) = (self.run.watch, self.entries);
        for logged in entries.iter().skip(self.done).take(count) {
            if self.outcome.is_some() || watch.is_over() {
                self.differs(&logged.entry, "it had ended before");
                return;
            }
            let seen = logged.node.map_or(self.number, |node| node + 1);
            let at = logged.entry.at().unwrap_or_default();
            watch.begins(seen, at, took(&entries[self.done..]));
            script.expect(self.number, &logged.operations);
            let done = self.step(logged.entry);
            self.log.add(&done, &logged.operations);
            script.finish_entry();
            watch.finishes(seen);
            self.done += 1;
        }
    }

    /// Does an entry; returns it, that of a command with the position in the event log of this
    /// run.
    fn step(&mut self, entry: Entry) -> Entry {
        match (&mut self.role, entry) {
            (Role::Nobody, _) => self.differs(&entry, "it has no thread, and had one"),
            (_, Entry::Obey { at, event }) => match self.obey(event, at) {
                Some(event) => return Entry::Obey { at, event },
                None => self.differs(&entry, "it has no such node"),
            },
            (Role::Worker(worker), Entry::Arrive(arrival)) => worker.arrive(arrival),
            (Role::Worker(worker), Entry::Look { at, late, node }) => {
                let worked = worker.look(at, late);
                self.check(&entry, node, worked);
            }
            (Role::Worker(worker), Entry::Finish { at, node }) => {
                let worked = worker.finish(at);
                self.check(&entry, Some(node), worked);
            }
            (Role::Worker(worker), Entry::Done { at, passed }) => {
                self.outcome = worker.done(at, passed);
            }
            _ => {}
        }
        entry
    }

    /// Carries out the command of a recorded event; returns the position of this run's.
    fn obey(&mut self, event: u64, at: Time) -> Option<u64> {
        let (command, refusal) = self.run.events.command(usize::try_from(event).ok()?)?;
        let event = match (&mut self.role, refusal) {
            (Role::Worker(worker), Some(reason)) => worker.refuse(command, at, reason),
            (Role::Worker(worker), None) => worker.obey(command, at)?,
            (Role::Supervisor(supervision), None) => {
                let obeyed = supervision.obey(command, at);
                self.exit = obeyed.exit;
                obeyed.event
            }
            (_, Some(reason)) => refuse_again(self.run.state, command, at, reason).event,
            (Role::Nobody, None) => return None,
        };
        Some(event as u64)
    }

    /// Checks that the node did some work that did so in the recorded run.
    fn check(&self, entry: &Entry, recorded: Option<usize>, worked: Option<usize>) {
        if worked != recorded {
            let name = |node: Option<usize>| match node {
                Some(node) => self.run.watch.name(node + 1),
                None => "nobody",
            };
            let (now, before) = (name(worked), name(recorded));
            self.differs(
                entry,
                &format!("{now} had something to do where {before} had in the recorded run"),
            );
        }
    }

    fn differs(&self, entry: &Entry, why: &str) {
        let (watch, at) = (self.run.watch, entry.at().unwrap_or_default());
        let name = watch.name(self.number);
        watch.differs(format!("{name} at {at}: {why}"));
    }
}
