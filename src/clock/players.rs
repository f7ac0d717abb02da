//! The threads of a stretch under the real clock, executed again.

use std::{collections::BTreeSet, time::Duration};

use super::{
    ClockExit,
    steps::{self, Outcome, TickEnd},
};
use crate::{
    command::Command,
    event::{Event, EventKind},
    graph::{ControlPlane, Graph},
    node::Fault,
    reexecution::{End, Entry, Stream, Thread, TurnFollower, Watch, expect, finish_entry},
    seat::Seat,
    state::RunState,
    sync::{Arc, spawn_named, thread},
    task::Task,
    time::Time,
};

fn command(event: &Event) -> Option<&Command> {
    match &event.what {
        EventKind::Applied { command, .. } | EventKind::Refused { command, .. } => Some(command),
        EventKind::Ended { .. } | EventKind::Faulted { .. } | EventKind::Presence { .. } => None,
    }
}

/// The events of the recorded run.
#[derive(Clone, Copy)]
pub(super) struct Events<'a> {
    pub(super) all: &'a [Event],
    pub(super) refused: &'a BTreeSet<usize>,
}

impl Events<'_> {
    /// Has the command of an event carried out by `obey`, unless it is to be refused as
    /// recorded; returns its position in the event log of this run.
    pub(super) fn again(
        self,
        index: u64,
        at: Time,
        state: &RunState,
        obey: impl FnOnce(&Command) -> usize,
    ) -> Option<u64> {
        let index = usize::try_from(index).ok()?;
        let event = self.all.get(index)?;
        let position = match &event.what {
            EventKind::Refused { command, reason } if self.refused.contains(&index) => {
                state.advance_to(at);
                state.refused(at, command, reason.as_str())
            }
            _ => obey(command(event)?),
        };
        Some(position as u64)
    }
}

/// All threads of a stretch.
pub(super) struct Players<'a> {
    events: Events<'a>,
    watch: &'a Arc<Watch>,
    state: Arc<RunState>,
    threads: Vec<ThreadPlayer<'a>>,
    /// What the supervisor decided last.
    exit: Option<ClockExit>,
}

/// Does again what a thread did, and logs it as that did.
struct ThreadPlayer<'a> {
    thread: &'a Thread,
    log: Arc<Stream>,
    /// Number of entries done.
    done: usize,
    outcome: Outcome,
}

impl<'a> ThreadPlayer<'a> {
    fn new(thread: &'a Thread, log: Arc<Stream>) -> Self {
        Self {
            thread,
            log,
            done: 0,
            outcome: None,
        }
    }
}

impl<'a> Players<'a> {
    /// The threads of a stretch of a run with these `events`, before their first entry.
    pub(super) fn new(
        threads: &'a [Thread],
        events: Events<'a>,
        watch: &'a Arc<Watch>,
        graph: &Graph,
    ) -> Self {
        let state = graph.control.state.clone();
        state.threads.begin(graph.seats.len());
        let players = threads.iter().enumerate();
        let players =
            players.map(|(index, thread)| ThreadPlayer::new(thread, state.threads.stream(index)));
        Self {
            events,
            watch,
            threads: players.collect(),
            state,
            exit: None,
        }
    }

    /// Runs the next entry of thread number `thread` on the calling thread.
    pub(super) fn entry(&mut self, graph: &mut Graph, thread: usize) {
        let _follower = TurnFollower::new(self.watch.clone());
        let Some(index) = thread.checked_sub(1) else {
            self.supervise(&mut graph.control, 1);
            return;
        };
        let (events, watch, state) = (self.events, &**self.watch, &*self.state);
        let node = NodeAgain {
            events,
            watch,
            state,
            thread,
        };
        let (task, seat) = (&mut graph.stage.tasks[index], &mut graph.seats[index]);
        node.play(&mut self.threads[thread], task, seat, 1);
    }

    /// Runs the next entries of several threads at the same time.
    pub(super) fn knot(&mut self, graph: &mut Graph, counts: &[(usize, usize)]) {
        let count = |thread: usize| {
            let count = counts.iter().find(|(known, _)| *known == thread);
            count.map_or(0, |(_, count)| *count)
        };
        let own = count(0);
        let Graph {
            stage,
            seats,
            control,
            ..
        } = graph;
        let nodes = stage.tasks.iter_mut().zip(seats);
        let (events, watch, state) = (self.events, self.watch, self.state.clone());
        let (supervisor, players) = self.threads.split_at_mut(1);
        let mut exit = self.exit.take();
        thread::scope(|scope| {
            for (index, ((task, seat), player)) in nodes.zip(players).enumerate() {
                let (thread, entries) = (index + 1, count(index + 1));
                if entries == 0 {
                    continue;
                }
                let (name, state) = (seat.name.clone(), &*state);
                let run = move || {
                    let _follower = TurnFollower::new(watch.clone());
                    let again = NodeAgain {
                        events,
                        watch,
                        state,
                        thread,
                    };
                    again.play(player, task, seat, entries);
                    watch.hold().leave();
                };
                if let Err(error) = spawn_named(scope, &name, run) {
                    watch.differs(format!("{name} has no thread: {error}"));
                }
            }
            if own > 0 {
                let _follower = TurnFollower::new(watch.clone());
                supervise(&mut supervisor[0], control, events, watch, own, &mut exit);
                watch.hold().leave();
            }
        });
        self.exit = exit;
    }

    fn supervise(&mut self, control: &mut ControlPlane, entries: usize) {
        let (events, watch) = (self.events, self.watch);
        let supervisor = &mut self.threads[0];
        supervise(supervisor, control, events, watch, entries, &mut self.exit);
    }

    /// Comes to the recorded `end`.
    pub(super) fn end(
        self,
        graph: &mut Graph,
        end: Option<End>,
    ) -> Result<Option<ClockExit>, Fault> {
        let watch = self.watch;
        if let Some(end) = end.filter(|_| !watch.is_over()) {
            self.threads[0].log.note_alone(Entry::End(end));
        }
        let mut outcomes: Vec<Outcome> = self
            .threads
            .into_iter()
            .map(|player| player.outcome)
            .collect();
        let mut of_node = |node: usize| outcomes.get_mut(node + 1).and_then(Option::take);
        let recorded = match end {
            _ if watch.is_over() => return Ok(Some(ClockExit::Stopped)),
            None => return Ok(Some(ClockExit::Stopped)),
            Some(End::Paused) => graph.control.status.paused.then_some(Ok(None)),
            Some(End::Left) => Some(Ok(None)),
            Some(End::Completed { until }) => {
                graph.control.set_now(until);
                Some(Ok(Some(ClockExit::Completed)))
            }
            Some(End::Stopped | End::HandedOver) => self.exit.map(|exit| Ok(Some(exit))),
            Some(End::Ended { node, at }) => match of_node(node) {
                Some(Ok(ended)) if ended == at => {
                    let node = graph.seats[node].name.to_string();
                    Some(Ok(Some(ClockExit::Ended { node, at })))
                }
                _ => None,
            },
            Some(End::Failed { node, at }) => match of_node(node) {
                Some(Err(fault)) if fault.at == at => Some(Err(fault)),
                _ => None,
            },
            Some(End::NoThread { node, at }) => {
                let node = graph.seats[node].name.to_string();
                let cause = "the system gave it no thread in the recorded run".into();
                Some(Err(Fault { node, at, cause }))
            }
        };
        let outweighs = another(end, outcomes.into_iter().flatten());
        match (recorded, outweighs) {
            (Some(end), None) => end,
            (_, Some(outcome)) => {
                watch.differs(format!("{outcome}; the recorded run went on"));
                Ok(Some(ClockExit::Stopped))
            }
            (None, None) => {
                watch.differs(format!("it did not come to its recorded end, {end:?}"));
                Ok(Some(ClockExit::Stopped))
            }
        }
    }
}

/// The first of the `others` that the recorded `end` does not explain.
fn another(
    end: Option<End>,
    mut others: impl Iterator<Item = Result<Time, Fault>>,
) -> Option<String> {
    match end {
        Some(End::Failed { .. } | End::NoThread { .. }) => None,
        Some(End::Ended { .. }) => others.find_map(|outcome| Some(outcome.err()?.to_string())),
        _ => others.next().map(|outcome| match outcome {
            Ok(at) => format!("a node ended the run at {at}"),
            Err(fault) => fault.to_string(),
        }),
    }
}

/// Has the supervisor do its next entries again.
fn supervise(
    player: &mut ThreadPlayer<'_>,
    control: &mut ControlPlane,
    events: Events<'_>,
    watch: &Watch,
    entries: usize,
    exit: &mut Option<ClockExit>,
) {
    for _ in 0..entries {
        let Some((entry, operations)) = player.thread.entry(player.done) else {
            return;
        };
        expect(0, operations);
        if let Entry::Obey { at, event } = *entry {
            let state = control.state.clone();
            let event = events.again(event, at, &state, |command| {
                let obeyed = steps::supervise(control, command, at);
                *exit = obeyed.exit;
                obeyed.event
            });
            if let Some(event) = event {
                player.log.add(&Entry::Obey { at, event }, operations);
            }
        }
        finish_entry();
        watch.finishes(0);
        player.done += 1;
    }
}

/// Has a node do again what its thread did.
#[derive(Clone, Copy)]
struct NodeAgain<'a> {
    events: Events<'a>,
    watch: &'a Watch,
    state: &'a RunState,
    thread: usize,
}

impl NodeAgain<'_> {
    /// Runs the next `entries`.
    fn play(
        &self,
        player: &mut ThreadPlayer<'_>,
        task: &mut Task,
        seat: &mut Seat,
        entries: usize,
    ) {
        for _ in 0..entries {
            let Some((entry, operations)) = player.thread.entry(player.done) else {
                return;
            };
            if player.outcome.is_some() || self.watch.is_over() {
                self.differs(entry, "it had ended before");
                return;
            }
            let (at, took) = (
                entry.at().unwrap_or_default(),
                player.thread.took(player.done),
            );
            self.watch.begins(self.thread, at, took);
            expect(self.thread, operations);
            let mut done = *entry;
            player.outcome = self.step(task, seat, &mut done);
            player.log.add(&done, operations);
            finish_entry();
            self.watch.finishes(self.thread);
            player.done += 1;
        }
    }

    /// Does an entry; that of a command gets its position in the event log of this run.
    fn step(&self, task: &mut Task, seat: &mut Seat, entry: &mut Entry) -> Outcome {
        match *entry {
            Entry::Tick {
                began,
                took,
                passed,
            } => {
                let due = self.due(task, entry, began)?;
                let mut at_once = false;
                let outcome = steps::tick(task, seat, due, began, || {
                    at_once = true;
                    TickEnd { took, passed }
                });
                if !at_once && outcome.is_none() {
                    self.differs(entry, "its tick takes run time, and took none");
                }
                outcome
            }
            Entry::Look { at } => {
                self.state.advance_to(at);
                if steps::take_due(task, at).is_some() {
                    self.differs(entry, "it has all inputs of a tick, and lacked some");
                }
                None
            }
            Entry::Choose { input, .. } => {
                task.choose_input(input);
                None
            }
            Entry::Start { began } => {
                let due = self.due(task, entry, began)?;
                steps::tick(task, seat, due, began, || {
                    self.differs(entry, "its tick takes no run time, and took some");
                    TickEnd {
                        took: Duration::ZERO,
                        passed: began,
                    }
                })
            }
            Entry::Finish { ended, passed } => {
                self.state.advance_to(ended);
                steps::finish(task, seat, ended, passed)
            }
            Entry::Obey { at, event } => {
                let obey =
                    |command: &Command| steps::obey_node(task, seat, self.state, command, at);
                if let Some(event) = self.events.again(event, at, self.state, obey) {
                    *entry = Entry::Obey { at, event };
                }
                None
            }
            Entry::Leave { before } => {
                task.overrun_before(before);
                None
            }
            Entry::Begin | Entry::End(_) | Entry::Rest { .. } | Entry::Abandoned => None,
        }
    }

    /// When the tick was due that begins at `began`.
    fn due(&self, task: &mut Task, entry: &Entry, began: Time) -> Option<Time> {
        self.state.advance_to(began);
        let due = steps::take_due(task, began);
        if due.is_none() {
            self.differs(entry, "it lacks inputs of its tick, and had all");
        }
        due
    }

    fn differs(&self, entry: &Entry, why: &str) {
        let (name, at) = (self.watch.name(self.thread), entry.at().unwrap_or_default());
        self.watch.differs(format!("{name} at {at}: {why}"));
    }
}
