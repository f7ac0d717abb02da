//! A log as what it is about: stretches of threads, and commands at rest between them.

use std::collections::BTreeSet;

use ratelab::{End, Entry, Event, EventKind, Operation, Time, sync::Arc};

use super::{
    coder::Coder,
    knot::{Knot, KnotOperation, KnotStep},
    log::{Log, LogError},
    plan::{Plan, PlanPart, Turns},
    thread::Thread,
};

/// A part of a run under the real clock.
#[derive(Debug)]
pub(crate) enum Section {
    /// Threads ran.
    Stretch(Stretch),
    /// A command during a pause, by its position in the event log.
    Rest(usize),
    /// Nobody was left to end a pause.
    Abandoned,
}

/// A stretch of threads.
#[derive(Debug)]
pub(crate) struct Stretch {
    /// The supervisor, and the nodes in the order of their addition.
    pub(crate) threads: Vec<Thread>,
    pub(crate) plan: Plan,
    /// How it ended; `None` where the log is cut off before.
    pub(crate) end: Option<End>,
}

/// The parts of a run under the real clock, in order.
#[derive(Debug, Default)]
pub(crate) struct Sections {
    pub(crate) all: Vec<Section>,
    /// Positions in the event log of what happened under the real clock.
    pub(crate) events: BTreeSet<usize>,
}

/// What a thread logged: each entry with its operations.
type Logged = (Entry, Vec<Operation>);

impl Sections {
    /// Reads `log`, of a run with these `events` and nodes with these `names`. A log that
    /// is not `whole` may end anywhere.
    ///
    /// # Errors
    /// [`LogError`] if it is the log of no run.
    pub(crate) fn read(
        log: &Log,
        events: &[Event],
        names: &[Arc<str>],
        whole: bool,
    ) -> Result<Self, LogError> {
        let threads: Result<Vec<_>, _> = log
            .threads()
            .iter()
            .map(|bytes| Coder::read(bytes))
            .collect();
        let mut threads = threads?.into_iter();
        let Some(supervisor) = threads.next() else {
            return Ok(Self::default());
        };
        let mut nodes: Vec<_> = threads.map(stretches).collect();
        nodes.resize_with(names.len().max(nodes.len()), Vec::new);
        if nodes.len() != names.len() {
            let (nodes, names) = (nodes.len(), names.len());
            let why = format!("it has {nodes} nodes, and the graph {names}");
            return Err(LogError::Damaged(why));
        }
        let mut reader = SectionReader {
            events,
            names,
            whole,
            nodes: nodes.into_iter().map(Vec::into_iter).collect(),
            turns: Turns::default(),
            known: BTreeSet::new(),
        };
        let all = reader.read(supervisor)?;
        Ok(Self {
            all,
            events: reader.known,
        })
    }
}

/// The entries of a node, divided into the stretches of its run.
fn stretches(entries: Vec<Logged>) -> Vec<Vec<Logged>> {
    let mut stretches: Vec<Vec<Logged>> = Vec::new();
    for logged in entries {
        match (logged.0, stretches.last_mut()) {
            (Entry::Begin, _) => stretches.push(Vec::new()),
            (_, Some(stretch)) => stretch.push(logged),
            (_, None) => stretches.push(vec![logged]),
        }
    }
    stretches
}

/// Reads the parts of a run.
struct SectionReader<'a> {
    events: &'a [Event],
    names: &'a [Arc<str>],
    whole: bool,
    nodes: Vec<std::vec::IntoIter<Vec<Logged>>>,
    turns: Turns,
    /// Events that the log mentions.
    known: BTreeSet<usize>,
}

impl SectionReader<'_> {
    fn read(&mut self, supervisor: Vec<Logged>) -> Result<Vec<Section>, LogError> {
        let mut sections = Vec::new();
        let mut supervisor = supervisor.into_iter().peekable();
        while let Some((entry, _)) = supervisor.next() {
            let section = match entry {
                Entry::Abandoned => Section::Abandoned,
                Entry::Rest { event } => match self.event(event)? {
                    Some(event) => Section::Rest(event),
                    None => return Ok(sections),
                },
                Entry::Begin => {
                    let mut own = Vec::new();
                    while let Some(logged) =
                        supervisor.next_if(|(e, _)| matches!(e, Entry::Obey { .. }))
                    {
                        own.push(logged);
                    }
                    let end = supervisor.next_if(|(entry, _)| matches!(entry, Entry::End(_)));
                    let end = end.and_then(|(entry, _)| match entry {
                        Entry::End(end) => Some(end),
                        _ => None,
                    });
                    Section::Stretch(self.stretch(own, end)?)
                }
                other => return Err(impossible(format!("{other:?} between two stretches"))),
            };
            let cut = matches!(&section, Section::Stretch(stretch) if !stretch.is_whole());
            sections.push(section);
            if cut {
                return self.end_of_torn(sections, supervisor.next().is_some());
            }
        }
        let more = self.nodes.iter_mut().any(|node| node.next().is_some());
        if more && self.whole {
            return Err(impossible("a node ran after the end".to_owned()));
        }
        Ok(sections)
    }

    /// The `sections` of a log that is cut off in the last of them.
    fn end_of_torn(&self, sections: Vec<Section>, more: bool) -> Result<Vec<Section>, LogError> {
        if self.whole || more {
            return Err(LogError::Damaged("a stretch of it has no end".to_owned()));
        }
        Ok(sections)
    }

    fn stretch(&mut self, own: Vec<Logged>, end: Option<End>) -> Result<Stretch, LogError> {
        let mut threads = vec![self.thread(own, None)?];
        for index in 0..self.nodes.len() {
            let logged = self.nodes[index].next();
            if logged.is_none() && self.whole {
                let name = &self.names[index];
                return Err(impossible(format!("{name} is missing in a stretch")));
            }
            threads.push(self.thread(logged.unwrap_or_default(), Some(index))?);
        }
        if let Some(End::Ended { node, .. } | End::Failed { node, .. } | End::NoThread { node, .. }) =
            end
            && node >= self.names.len()
        {
            return Err(impossible(format!("node {node} ended the run")));
        }
        let names = std::iter::once("the supervisor").chain(self.names.iter().map(|name| &**name));
        let plan = Plan::new(&threads, names.collect(), &mut self.turns, self.whole)?;
        Ok(Stretch { threads, plan, end })
    }

    /// The entries of the thread of a `node`, or of the supervisor, up to the first that cannot
    /// be known.
    fn thread(&mut self, logged: Vec<Logged>, node: Option<usize>) -> Result<Thread, LogError> {
        let mut thread = Thread::default();
        let supervises = node.is_none();
        for (entry, operations) in logged {
            match entry {
                Entry::Obey { at, event } => match self.event(event)? {
                    None => break,
                    Some(event) if self.events[event].at != at => {
                        let event = &self.events[event];
                        return Err(impossible(format!("{event}, obeyed at {at}")));
                    }
                    Some(event) => self.check_target(event, node)?,
                },
                Entry::Look { node, .. } if !supervises => self.check_node(node)?,
                Entry::Finish { node, .. } if !supervises => self.check_node(Some(node))?,
                Entry::Arrive(_) | Entry::Done { .. } if !supervises => {}
                other => return Err(impossible(format!("{other:?} within a stretch"))),
            }
            let last = thread.len().checked_sub(1);
            let works = last.is_some_and(|last| thread.works_after(last));
            if works != matches!(entry, Entry::Done { .. }) {
                return Err(impossible(format!("{entry:?} in the midst of another one")));
            }
            thread.push(entry, &operations);
        }
        Ok(thread)
    }

    /// Checks that there is a node with this index.
    fn check_node(&self, node: Option<usize>) -> Result<(), LogError> {
        match node.filter(|node| *node >= self.names.len()) {
            Some(node) => Err(impossible(format!("node {node} did some work"))),
            None => Ok(()),
        }
    }

    /// Checks that a command which the thread of a node obeyed is for a node.
    fn check_target(&self, event: usize, node: Option<usize>) -> Result<(), LogError> {
        let event = &self.events[event];
        let (EventKind::Applied { command, .. } | EventKind::Refused { command, .. }) = &event.what
        else {
            return Ok(());
        };
        match node.map(|node| &*self.names[node]) {
            Some(name) if command.node().is_none() => {
                Err(impossible(format!("{event}, obeyed by {name}")))
            }
            _ => Ok(()),
        }
    }

    /// The position of an event that a thread mentions; `None` where the events are cut
    /// off before it.
    fn event(&mut self, event: u64) -> Result<Option<usize>, LogError> {
        let index = usize::try_from(event).unwrap_or(usize::MAX);
        match self.events.get(index).map(|event| &event.what) {
            Some(EventKind::Applied { .. } | EventKind::Refused { .. })
                if self.known.insert(index) =>
            {
                Ok(Some(index))
            }
            None if !self.whole => Ok(None),
            _ => Err(impossible(format!(
                "event {event} is no command, or came twice"
            ))),
        }
    }
}

impl Stretch {
    /// Its ticks that overlap.
    pub(crate) fn knots(&self) -> Vec<Knot> {
        let mut done = vec![0; self.threads.len()];
        let knots = self.plan.parts().iter().filter_map(|planned| {
            let steps = match &planned.part {
                PlanPart::Knot(steps) => steps,
                PlanPart::Entry(thread) => {
                    done[*thread] += 1;
                    return None;
                }
            };
            Some(self.knot(steps, &mut done))
        });
        knots.collect()
    }

    /// The knot of these `steps`, after so many entries of each thread are `done`.
    fn knot(&self, steps: &[KnotStep], done: &mut [usize]) -> Knot {
        let mut knot = Knot {
            from: Time::MAX,
            to: Time::ZERO,
            operations: Vec::new(),
        };
        for step in steps {
            let at = self.threads[step.thread].at(done[step.thread]);
            (knot.from, knot.to) = (knot.from.min(at), knot.to.max(at));
            let operation = step.takes.map(|(lock, turn)| KnotOperation {
                node: self.threads[step.thread]
                    .node(done[step.thread])
                    .or(step.thread.checked_sub(1)),
                at,
                takes: lock.text(),
                turn,
            });
            knot.operations.extend(operation);
            done[step.thread] += usize::from(step.ends);
        }
        knot
    }

    fn is_whole(&self) -> bool {
        self.end.is_some() && self.plan.is_whole()
    }
}

fn impossible(why: String) -> LogError {
    LogError::Impossible(why)
}
