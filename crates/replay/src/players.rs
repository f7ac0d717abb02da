//! The threads of a stretch under the real clock, executed again.

use std::collections::{BTreeMap, BTreeSet};

use ratelab::{
    ClockExit, Command, CrewThread, Crews, End, Entries, Entry, Event, EventKind, Fault, Outcome,
    RunState, Supervision, Time,
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

impl<'a> Events<'a> {
    /// Has the command of an event carried out by `obey`, unless it is to be refused as
    /// recorded; returns its position in the event log of this run.
    pub(super) fn again(
        self,
        index: u64,
        at: Time,
        state: &RunState,
        obey: impl FnOnce(&Command) -> Option<usize>,
    ) -> Option<u64> {
        if let Some((command, reason)) = self.refusal(index) {
            state.advance_to(at);
            return Some(state.refused(at, command, reason) as u64);
        }
        let event = self.all.get(usize::try_from(index).ok()?)?;
        obey(command(event)?).map(|position| position as u64)
    }

    /// The command of an event and the reason for its refusal, if it is to be refused as recorded.
    fn refusal(self, index: u64) -> Option<(&'a Command, &'a str)> {
        let index = usize::try_from(index).ok()?;
        match &self.all.get(index)?.what {
            EventKind::Refused { command, reason } if self.refused.contains(&index) => {
                Some((command, reason))
            }
            _ => None,
        }
    }
}

/// All threads of a stretch.
pub(super) struct Players<'a> {
    events: Events<'a>,
    watch: &'a Arc<Watch>,
    state: Arc<RunState>,
    supervisor: SupervisorAgain<'a>,
    /// Those of the nodes, by their indices.
    threads: Vec<ThreadPlayer<'a>>,
    /// The turns of what runs on the calling thread.
    script: Script,
}

/// Has the supervisor do again what it did.
struct SupervisorAgain<'a> {
    thread: &'a Thread,
    log: Entries,
    /// Number of entries done.
    done: usize,
    /// What it decided last.
    exit: Option<ClockExit>,
}

/// Does again what a thread of a crew did, and logs it as that did.
struct ThreadPlayer<'a> {
    /// Its number: those of crews begin with one.
    number: usize,
    thread: &'a Thread,
    /// Its crew; `None` for a node without a thread.
    hand: Option<CrewThread<'a>>,
    log: Entries,
    /// Number of entries done.
    done: usize,
    outcome: Outcome,
    events: Events<'a>,
    watch: &'a Watch,
    state: Arc<RunState>,
}

impl<'a> Players<'a> {
    /// The `supervisor` and the `nodes` of a stretch of a run with these `events`, before their
    /// first entry.
    pub(super) fn new(
        supervisor: &'a Thread,
        nodes: &'a [Thread],
        events: Events<'a>,
        watch: &'a Arc<Watch>,
        (state, crews): (Arc<RunState>, &'a Crews<'a>),
    ) -> Self {
        state.begin_threads(nodes.len());
        let mut hands: BTreeMap<usize, CrewThread<'a>> = crews.threads().collect();
        let threads = nodes.iter().enumerate();
        let threads = threads.map(|(index, thread)| ThreadPlayer {
            number: index + 1,
            thread,
            hand: hands.remove(&index),
            log: state.entries_of(index + 1),
            done: 0,
            outcome: None,
            events,
            watch,
            state: state.clone(),
        });
        Self {
            events,
            watch,
            supervisor: SupervisorAgain {
                thread: supervisor,
                log: state.entries_of(0),
                done: 0,
                exit: None,
            },
            threads: threads.collect(),
            script: Script::new(watch.clone()),
            state,
        }
    }

    /// Runs the next entry of thread number `thread` on the calling thread.
    pub(super) fn entry(&mut self, supervision: &mut Supervision<'_>, thread: usize) {
        let Some(index) = thread.checked_sub(1) else {
            self.supervise(supervision, 1);
            return;
        };
        let _following = self.script.follow();
        self.threads[index].play(&self.script, 1);
    }

    /// Runs the next entries of several threads at the same time.
    pub(super) fn knot(&mut self, supervision: &mut Supervision<'_>, counts: &[(usize, usize)]) {
        let count = |thread: usize| {
            let count = counts.iter().find(|(known, _)| *known == thread);
            count.map_or(0, |(_, count)| *count)
        };
        let own = count(0);
        let watch = self.watch;
        thread::scope(|scope| {
            for player in &mut self.threads {
                let (entries, name) = (count(player.number), watch.name(player.number));
                if entries == 0 {
                    continue;
                }
                let run = move || {
                    let script = Script::new(watch.clone());
                    let _following = script.follow();
                    player.play(&script, entries);
                    watch.hold().leave();
                };
                if let Err(error) = spawn_named(scope, name, run) {
                    watch.differs(format!("{name} has no thread: {error}"));
                }
            }
            if own > 0 {
                let _following = self.script.follow();
                let known = (self.events, &**watch, &*self.state, &self.script);
                self.supervisor.play(supervision, known, own);
                watch.hold().leave();
            }
        });
    }

    fn supervise(&mut self, supervision: &mut Supervision<'_>, entries: usize) {
        let _following = self.script.follow();
        let known = (self.events, &**self.watch, &*self.state, &self.script);
        self.supervisor.play(supervision, known, entries);
    }

    /// Comes to the recorded `end`.
    pub(super) fn end(self, end: Option<End>) -> Result<Option<ClockExit>, Fault> {
        let watch = self.watch;
        if let Some(end) = end.filter(|_| !watch.is_over()) {
            self.supervisor.log.note_alone(Entry::End(end));
        }
        let name = |node: usize| watch.name(node + 1).to_owned();
        let outcomes = self.threads.into_iter().filter_map(|player| {
            let node = player.thread.node(player.done.checked_sub(1)?)?;
            Some((node, player.outcome?))
        });
        let mut outcomes: BTreeMap<usize, Result<Time, Fault>> = outcomes.collect();
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
            Some(End::Ended { node, at }) => match outcomes.remove(&node) {
                Some(Ok(ended)) if ended == at => {
                    let node = name(node);
                    Some(Ok(Some(ClockExit::Ended { node, at })))
                }
                _ => None,
            },
            Some(End::Failed { node, at }) => match outcomes.remove(&node) {
                Some(Err(fault)) if fault.at == at => Some(Err(fault)),
                _ => None,
            },
            Some(End::NoThread { node, at }) => {
                let node = name(node);
                let cause = "the system gave it no thread in the recorded run".into();
                Some(Err(Fault { node, at, cause }))
            }
        };
        let outweighs = another(end, outcomes.into_values());
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

impl SupervisorAgain<'_> {
    /// Runs the next `entries`.
    fn play(
        &mut self,
        supervision: &mut Supervision<'_>,
        (events, watch, state, script): (Events<'_>, &Watch, &RunState, &Script),
        entries: usize,
    ) {
        for _ in 0..entries {
            let Some((entry, operations)) = self.thread.entry(self.done) else {
                return;
            };
            script.expect(0, operations);
            if let Entry::Obey { at, event } = *entry {
                let event = events.again(event, at, state, |command| {
                    let obeyed = supervision.obey(command, at);
                    self.exit = obeyed.exit;
                    Some(obeyed.event)
                });
                if let Some(event) = event {
                    self.log.add(&Entry::Obey { at, event }, operations);
                }
            }
            script.finish_entry();
            watch.finishes(0);
            self.done += 1;
        }
    }
}

impl ThreadPlayer<'_> {
    /// Runs the next `entries`.
    fn play(&mut self, script: &Script, entries: usize) {
        for _ in 0..entries {
            let Some((entry, operations)) = self.thread.entry(self.done) else {
                return;
            };
            if self.outcome.is_some() || self.watch.is_over() {
                self.differs(entry, "it had ended before");
                return;
            }
            let (at, took) = (entry.at().unwrap_or_default(), self.thread.took(self.done));
            let node = self.thread.node(self.done);
            let seen = node.map_or(self.number, |node| node + 1);
            self.watch.begins(seen, at, took);
            script.expect(self.number, operations);
            let mut done = *entry;
            self.outcome = self.step(&mut done);
            self.log.add(&done, operations);
            script.finish_entry();
            self.watch.finishes(seen);
            self.done += 1;
        }
    }

    /// Does an entry; that of a command gets its position in the event log of this run.
    fn step(&mut self, entry: &mut Entry) -> Outcome {
        let Some(hand) = &mut self.hand else {
            self.differs(entry, "it has no thread, and had one");
            return None;
        };
        match *entry {
            Entry::Arrive(arrival) => hand.arrive(arrival),
            Entry::Look { at, late, node } => {
                let worked = hand.look(at, late);
                self.check(entry, node, worked);
            }
            Entry::Finish { at, node } => {
                let worked = hand.finish(at);
                self.check(entry, Some(node), worked);
            }
            Entry::Done { at, passed } => return hand.done(at, passed),
            Entry::Obey { at, event } => {
                let obeyed = match self.events.refusal(event) {
                    Some((command, reason)) => Some(hand.refuse(command, at, reason) as u64),
                    None => {
                        let obey = |command: &Command| hand.obey(command, at);
                        self.events.again(event, at, &self.state, obey)
                    }
                };
                match obeyed {
                    Some(event) => *entry = Entry::Obey { at, event },
                    None => self.differs(entry, "it has no such node"),
                }
            }
            Entry::Begin | Entry::End(_) | Entry::Rest { .. } | Entry::Abandoned => {}
        }
        None
    }

    /// Checks that the node did some work that did so in the recorded run.
    fn check(&self, entry: &Entry, recorded: Option<usize>, worked: Option<usize>) {
        if worked != recorded {
            let name = |node: Option<usize>| match node {
                Some(node) => self.watch.name(node + 1),
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
        let (name, at) = (self.watch.name(self.number), entry.at().unwrap_or_default());
        self.watch.differs(format!("{name} at {at}: {why}"));
    }
}
