//! The threads of a stretch under the real clock, executed again.

use std::{collections::BTreeSet, time::Duration};

use ratelab::{
    ClockExit, Command, End, Entries, Entry, Event, EventKind, Fault, Graph, NodeHand, Outcome,
    RunState, SupervisorHand, TickEnd, Time,
    sync::{Arc, spawn_named, thread},
};

use super::{script::Script, thread::Thread, watch::Watch};

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
    supervisor: SupervisorAgain<'a>,
    nodes: Vec<ThreadPlayer<'a>>,
    /// The turns of what runs on the calling thread.
    script: Script,
}

/// Has the supervisor do again what it did.
struct SupervisorAgain<'a> {
    player: ThreadPlayer<'a>,
    /// What it decided last.
    exit: Option<ClockExit>,
}

/// Does again what a thread did, and logs it as that did.
struct ThreadPlayer<'a> {
    thread: &'a Thread,
    log: Entries,
    /// Number of entries done.
    done: usize,
    outcome: Outcome,
}

impl<'a> ThreadPlayer<'a> {
    fn new(thread: &'a Thread, log: Entries) -> Self {
        Self {
            thread,
            log,
            done: 0,
            outcome: None,
        }
    }
}

impl<'a> Players<'a> {
    /// The `supervisor` and the `nodes` of a stretch of a run with these `events`, before their
    /// first entry.
    pub(super) fn new(
        supervisor: &'a Thread,
        nodes: &'a [Thread],
        events: Events<'a>,
        watch: &'a Arc<Watch>,
        graph: &Graph,
    ) -> Self {
        let state = graph.state();
        state.begin_threads(nodes.len());
        let player = |thread, index| ThreadPlayer::new(thread, state.entries_of(index));
        Self {
            events,
            watch,
            supervisor: SupervisorAgain {
                player: player(supervisor, 0),
                exit: None,
            },
            nodes: nodes
                .iter()
                .zip(1..)
                .map(|(n, index)| player(n, index))
                .collect(),
            script: Script::new(watch.clone()),
            state,
        }
    }

    /// Runs the next entry of thread number `thread` on the calling thread.
    pub(super) fn entry(&mut self, graph: &mut Graph, thread: usize) {
        let Some(index) = thread.checked_sub(1) else {
            self.supervise(graph.supervisor_hand(), 1);
            return;
        };
        let _following = self.script.follow();
        if let Some(node) = graph.node_hand(index) {
            let mut node = NodeAgain {
                node,
                events: self.events,
                watch: self.watch,
                state: &self.state,
                thread,
            };
            node.play(&mut self.nodes[index], &self.script, 1);
        }
    }

    /// Runs the next entries of several threads at the same time.
    pub(super) fn knot(&mut self, graph: &mut Graph, counts: &[(usize, usize)]) {
        let count = |thread: usize| {
            let count = counts.iter().find(|(known, _)| *known == thread);
            count.map_or(0, |(_, count)| *count)
        };
        let own = count(0);
        let (supervisor, nodes) = graph.hands();
        let (events, watch, state) = (self.events, self.watch, self.state.clone());
        thread::scope(|scope| {
            for (index, (node, player)) in nodes.zip(&mut self.nodes).enumerate() {
                let (thread, entries) = (index + 1, count(index + 1));
                if entries == 0 {
                    continue;
                }
                let (name, state) = (node.name(), &*state);
                let run = move || {
                    let script = Script::new(watch.clone());
                    let _following = script.follow();
                    let mut again = NodeAgain {
                        node,
                        events,
                        watch,
                        state,
                        thread,
                    };
                    again.play(player, &script, entries);
                    watch.hold().leave();
                };
                if let Err(error) = spawn_named(scope, &name, run) {
                    watch.differs(format!("{name} has no thread: {error}"));
                }
            }
            if own > 0 {
                let _following = self.script.follow();
                let known = (events, &**watch, &*self.state, &self.script);
                self.supervisor.play(supervisor, known, own);
                watch.hold().leave();
            }
        });
    }

    fn supervise(&mut self, hand: SupervisorHand<'_>, entries: usize) {
        let _following = self.script.follow();
        let known = (self.events, &**self.watch, &*self.state, &self.script);
        self.supervisor.play(hand, known, entries);
    }

    /// Comes to the recorded `end`.
    pub(super) fn end(
        self,
        graph: &mut Graph,
        end: Option<End>,
    ) -> Result<Option<ClockExit>, Fault> {
        let watch = self.watch;
        if let Some(end) = end.filter(|_| !watch.is_over()) {
            self.supervisor.player.log.note_alone(Entry::End(end));
        }
        let outcomes = self.nodes.into_iter().map(|player| player.outcome);
        let mut outcomes: Vec<Outcome> = outcomes.collect();
        let mut of_node = |node: usize| outcomes.get_mut(node).and_then(Option::take);
        let recorded = match end {
            _ if watch.is_over() => return Ok(Some(ClockExit::Stopped)),
            None => return Ok(Some(ClockExit::Stopped)),
            Some(End::Paused) => self.state.status().paused.then_some(Ok(None)),
            Some(End::Left) => Some(Ok(None)),
            Some(End::Completed { until }) => {
                self.state.set_now(until);
                Some(Ok(Some(ClockExit::Completed)))
            }
            Some(End::Stopped | End::HandedOver) => self.supervisor.exit.map(|exit| Ok(Some(exit))),
            Some(End::Ended { node, at }) => match of_node(node) {
                Some(Ok(ended)) if ended == at => {
                    let node = name(graph, node);
                    Some(Ok(Some(ClockExit::Ended { node, at })))
                }
                _ => None,
            },
            Some(End::Failed { node, at }) => match of_node(node) {
                Some(Err(fault)) if fault.at == at => Some(Err(fault)),
                _ => None,
            },
            Some(End::NoThread { node, at }) => {
                let node = name(graph, node);
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

fn name(graph: &mut Graph, node: usize) -> String {
    let node = graph.node_hand(node);
    node.map_or_else(String::new, |node| node.name().to_string())
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

impl SupervisorAgain<'_> {
    /// Runs the next `entries`.
    fn play(
        &mut self,
        mut hand: SupervisorHand<'_>,
        (events, watch, state, script): (Events<'_>, &Watch, &RunState, &Script),
        entries: usize,
    ) {
        let player = &mut self.player;
        for _ in 0..entries {
            let Some((entry, operations)) = player.thread.entry(player.done) else {
                return;
            };
            script.expect(0, operations);
            if let Entry::Obey { at, event } = *entry {
                let event = events.again(event, at, state, |command| {
                    let obeyed = hand.obey(command, at);
                    self.exit = obeyed.exit;
                    obeyed.event
                });
                if let Some(event) = event {
                    player.log.add(&Entry::Obey { at, event }, operations);
                }
            }
            script.finish_entry();
            watch.finishes(0);
            player.done += 1;
        }
    }
}

/// Has a node do again what its thread did.
struct NodeAgain<'a> {
    node: NodeHand<'a>,
    events: Events<'a>,
    watch: &'a Watch,
    state: &'a RunState,
    thread: usize,
}

impl NodeAgain<'_> {
    /// Runs the next `entries`.
    fn play(&mut self, player: &mut ThreadPlayer<'_>, script: &Script, entries: usize) {
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
            script.expect(self.thread, operations);
            let mut done = *entry;
            player.outcome = self.step(&mut done);
            player.log.add(&done, operations);
            script.finish_entry();
            self.watch.finishes(self.thread);
            player.done += 1;
        }
    }

    /// Does an entry; that of a command gets its position in the event log of this run.
    fn step(&mut self, entry: &mut Entry) -> Outcome {
        match *entry {
            Entry::Tick {
                began,
                took,
                passed,
            } => {
                let mut at_once = false;
                let outcome = self.tick(entry, began, || {
                    at_once = true;
                    TickEnd { took, passed }
                })?;
                if !at_once && outcome.is_none() {
                    self.differs(entry, "its tick takes run time, and took none");
                }
                outcome
            }
            Entry::Look { at } => {
                if !self.node.look(at) {
                    self.differs(entry, "it has all inputs of a tick, and lacked some");
                }
                None
            }
            Entry::Choose { input, .. } => {
                self.node.choose(input);
                None
            }
            Entry::Start { began } => {
                let mut at_once = false;
                let outcome = self.tick(entry, began, || {
                    at_once = true;
                    TickEnd {
                        took: Duration::ZERO,
                        passed: began,
                    }
                })?;
                if at_once {
                    self.differs(entry, "its tick takes no run time, and took some");
                }
                outcome
            }
            Entry::Finish { ended, passed } => self.node.finish(ended, passed),
            Entry::Obey { at, event } => {
                let (events, state) = (self.events, self.state);
                let obey = |command: &Command| self.node.obey(command, at);
                if let Some(event) = events.again(event, at, state, obey) {
                    *entry = Entry::Obey { at, event };
                }
                None
            }
            Entry::Leave { before } => {
                self.node.leave(before);
                None
            }
            Entry::Begin | Entry::End(_) | Entry::Rest { .. } | Entry::Abandoned => None,
        }
    }

    /// Does the tick that begins at `began`; `None` if it cannot.
    fn tick(
        &mut self,
        entry: &Entry,
        began: Time,
        end: impl FnOnce() -> TickEnd,
    ) -> Option<Outcome> {
        let outcome = self.node.tick(began, end);
        if outcome.is_none() {
            self.differs(entry, "it lacks inputs of its tick, and had all");
        }
        outcome
    }

    fn differs(&self, entry: &Entry, why: &str) {
        let (name, at) = (self.watch.name(self.thread), entry.at().unwrap_or_default());
        self.watch.differs(format!("{name} at {at}: {why}"));
    }
}
