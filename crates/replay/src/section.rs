//! A log as what it is about: stretches of threads, and commands at rest between them.

use std::collections::BTreeSet;

use ratelab::{End, Entry, Event, EventKind, Operation, Time, sync::Arc};

use super::{
    coder::Coder,
    entry::LoggedEntry,
    log::{Log, LogError},
    overlap::{Overlap, OverlapOperation, OverlapStep},
    plan::{Plan, PlanPart, Turns},
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
    pub(crate) threads: Vec<Vec<LoggedEntry>>,
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
    /// Reads `log`, of a run with these `events` and threads with these `names`. A log that
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
        // The supervisor is no node.
        let named = names.len() - 1;
        if nodes.len() > named {
            let (nodes, names) = (nodes.len(), named);
            let why = format!("it has {nodes} nodes, and the graph {names}");
            return Err(LogError::Damaged(why));
        }
        nodes.resize_with(named, Vec::new);
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
        let mut entries = supervisor.into_iter().peekable();
        while let Some((entry, _)) = entries.next() {
            sections.push(match entry {
                Entry::Abandoned => Section::Abandoned,
                Entry::Rest { event } => match self.event(event)? {
                    Some(event) => Section::Rest(event),
                    None => return Ok(sections),
                },
                Entry::Begin => {
                    let obey = |logged: &Logged| matches!(logged.0, Entry::Obey { .. });
                    let own = std::iter::from_fn(|| entries.next_if(obey)).collect();
                    let end = entries.next_if(|logged| matches!(logged.0, Entry::End(_)));
                    let stretch = self.stretch(own, end.map(|(entry, _)| entry))?;
                    let may_be_torn = !self.whole && entries.peek().is_none();
                    if !stretch.is_whole() && !may_be_torn {
                        return Err(LogError::Damaged("a stretch of it has no end".to_owned()));
                    }
                    Section::Stretch(stretch)
                }
                other => return Err(impossible(format!("{other:?} between two stretches"))),
            });
        }
        let more = self.nodes.iter_mut().any(|node| node.next().is_some());
        if more && self.whole {
            return Err(impossible("a node ran after the end".to_owned()));
        }
        Ok(sections)
    }

    fn stretch(&mut self, own: Vec<Logged>, end: Option<Entry>) -> Result<Stretch, LogError> {
        let mut threads = vec![self.thread(own, 0)?];
        for number in 1..self.names.len() {
            let logged = self.nodes[number - 1].next();
            if logged.is_none() && self.whole {
                let name = &self.names[number];
                return Err(impossible(format!("{name} is missing in a stretch")));
            }
            threads.push(self.thread(logged.unwrap_or_default(), number)?);
        }
        let end = match end {
            Some(Entry::End(end)) => Some(end),
            _ => None,
        };
        if let Some(
            End::Ended { node, .. } | End::Failed { node, .. } | End::NoThread { node, .. },
        ) = end
        {
            self.check_node(node, "ended the run")?;
        }
        let plan = Plan::new(&threads, self.names, &mut self.turns, self.whole)?;
        Ok(Stretch { threads, plan, end })
    }

    /// The entries of thread number `thread`, up to the first that cannot be known.
    fn thread(&mut self, logged: Vec<Logged>, thread: usize) -> Result<Vec<LoggedEntry>, LogError> {
        let mut entries = Vec::<LoggedEntry>::new();
        for (entry, operations) in logged {
            match entry {
                Entry::Obey { at, event } => match self.event(event)? {
                    Some(event) => self.check_command(event, at, thread)?,
                    None => break,
                },
                Entry::Arrive(_)
                | Entry::Look { .. }
                | Entry::Finish { .. }
                | Entry::Done { .. }
                    if thread > 0 => {}
                other => return Err(impossible(format!("{other:?} within a stretch"))),
            }
            let last = entries.last();
            let works = last.is_some_and(LoggedEntry::begins_work);
            if works != matches!(entry, Entry::Done { .. }) {
                return Err(impossible(format!("{entry:?} in the midst of another one")));
            }
            let entry = LoggedEntry::after(last, entry, operations);
            if let Some(node) = entry.node {
                self.check_node(node, "did some work")?;
            }
            entries.push(entry);
        }
        Ok(entries)
    }

    /// Checks that there is a node with this index.
    fn check_node(&self, node: usize, did: &str) -> Result<(), LogError> {
        match node + 1 < self.names.len() {
            true => Ok(()),
            false => Err(impossible(format!("node {node} {did}"))),
        }
    }

    /// Checks that a thread can have obeyed a command at this time.
    fn check_command(&self, event: usize, at: Time, thread: usize) -> Result<(), LogError> {
        let event = &self.events[event];
        let is_for_a_node = match &event.what {
            EventKind::Applied { command, .. } | EventKind::Refused { command, .. } => {
                command.node().is_some()
            }
            _ => false,
        };
        let by = match thread {
            _ if event.at != at => format!("at {at}"),
            1.. if !is_for_a_node => format!("by {}", self.names[thread]),
            _ => return Ok(()),
        };
        Err(impossible(format!("{event}, obeyed {by}")))
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
    pub(crate) fn overlaps(&self) -> Vec<Overlap> {
        let mut done = vec![0; self.threads.len()];
        let mut overlaps = Vec::new();
        for planned in self.plan.parts() {
            match &planned.part {
                PlanPart::Entry(thread) => done[*thread] += 1,
                PlanPart::Overlap(steps) => overlaps.push(self.overlap(steps, &mut done)),
            }
        }
        overlaps
    }

    /// The overlap of these `steps`, after so many entries of each thread are `done`.
    fn overlap(&self, steps: &[OverlapStep], done: &mut [usize]) -> Overlap {
        let mut overlap = Overlap {
            from: Time::MAX,
            to: Time::ZERO,
            operations: Vec::new(),
        };
        for step in steps {
            let LoggedEntry { began, node, .. } = self.threads[step.thread][done[step.thread]];
            (overlap.from, overlap.to) = (overlap.from.min(began), overlap.to.max(began));
            let operation = step.takes.map(|(lock, turn)| OverlapOperation {
                node: node.or(step.thread.checked_sub(1)),
                at: began,
                takes: lock.text(),
                turn,
            });
            overlap.operations.extend(operation);
            done[step.thread] += usize::from(step.ends);
        }
        overlap
    }

    fn is_whole(&self) -> bool {
        self.end.is_some() && self.plan.is_whole()
    }
}

fn impossible(why: String) -> LogError {
    LogError::Impossible(why)
}
