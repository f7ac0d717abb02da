//! A log in sections: stretches of threads, and commands at rest between them.

use std::{collections::BTreeSet, iter::Peekable, vec::IntoIter};

use ratelab::{
    Event, EventKind, Time,
    journal::{End, Entry, Operation},
    sync::Arc,
};

use super::{
    log::{Log, LogError},
    plan::{Plan, PlanPart, Turns},
};
use crate::{log::Coder, plan::LoggedEntry};

/// A part of a run under the real clock.
#[derive(Debug)]
pub(crate) enum Section {
    /// Threads ran.
    Stretch(Stretch),
    /// A command during a pause, by its position in the event log.
    Rest(usize),
    /// Nobody was left to end a pause.
    Abandoned,
    /// A branch leaves the recorded run.
    Left,
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

/// What a thread logged: each entry with its operations.
type Logged = (Entry, Vec<Operation>);

/// Reads the parts of a run from the logs of its threads.
pub(crate) struct SectionReader<'a> {
    threads: Vec<Peekable<IntoIter<Logged>>>,
    events: &'a [Event],
    names: &'a [Arc<str>],
    whole: bool,
    turns: Turns,
    /// Positions in the event log of what happened under the real clock.
    pub(crate) known: BTreeSet<usize>,
}

impl<'a> SectionReader<'a> {
    /// Reads `log`, of a run with these `events` and threads with these `names`. A log that
    /// is not `whole` may end anywhere.
    ///
    /// # Errors
    /// [`LogError`] if it is not a log, or a log of another graph.
    pub(crate) fn new(
        log: &Log,
        events: &'a [Event],
        names: &'a [Arc<str>],
        whole: bool,
    ) -> Result<Self, LogError> {
        let threads = log
            .threads()
            .iter()
            .map(|bytes| Ok(Coder::read(bytes)?.into_iter().peekable()));
        let mut threads: Vec<_> = threads.collect::<Result<_, LogError>>()?;
        if threads.len() > names.len() {
            // The supervisor is not a node.
            let (nodes, names) = (threads.len() - 1, names.len() - 1);
            let why = format!("it has {nodes} nodes, and the graph {names}");
            return Err(LogError::Damaged(why));
        }
        threads.resize_with(names.len(), || Vec::new().into_iter().peekable());
        Ok(Self {
            threads,
            events,
            names,
            whole,
            turns: Turns::new(),
            known: BTreeSet::new(),
        })
    }

    /// Returns the parts of the run in order, up to the first that is cut off.
    ///
    /// # Errors
    /// [`LogError`] if it is the log of no run.
    pub(crate) fn read(&mut self) -> Result<Vec<Section>, LogError> {
        let mut sections = Vec::new();
        while let Some((entry, _)) = self.threads[0].next() {
            let (section, is_whole) = match entry {
                Entry::Begin => {
                    let (stretch, is_whole) = self.stretch()?;
                    (Section::Stretch(stretch), is_whole)
                }
                Entry::Rest { event } => match self.event(event)? {
                    Some(event) => (Section::Rest(event), true),
                    None => return Ok(sections),
                },
                Entry::Abandoned => (Section::Abandoned, true),
                other => return Err(impossible(format!("{other:?} between two stretches"))),
            };
            sections.push(section);
            if !is_whole {
                return Ok(sections);
            }
        }
        let more = self
            .threads
            .iter_mut()
            .any(|thread| thread.next().is_some());
        if more && self.whole {
            Err(impossible("a node ran after the end".to_owned()))
        } else {
            Ok(sections)
        }
    }

    /// Returns the stretch that the supervisor has begun, and whether it is whole.
    fn stretch(&mut self) -> Result<(Stretch, bool), LogError> {
        let supervisor = &mut self.threads[0];
        let own = take_while(supervisor, |entry| matches!(entry, Entry::Obey { .. }));
        let end_entry = supervisor.next_if(|(entry, _)| matches!(entry, Entry::End(_)));
        let end = end_entry.and_then(|(entry, _)| match entry {
            Entry::End(end) => Some(end),
            _ => None,
        });
        let mut threads = vec![self.thread(own)?];
        for thread in 1..self.threads.len() {
            let entries = &mut self.threads[thread];
            let began = entries.next_if(|(entry, _)| *entry == Entry::Begin);
            if began.is_none() && self.whole {
                let name = &self.names[thread];
                return Err(impossible(format!("{name} is missing in a stretch")));
            }
            let logged = take_while(entries, |entry| *entry != Entry::Begin);
            threads.push(self.thread(logged)?);
        }
        let (plan, is_over) = Plan::new(&threads, self.names, &mut self.turns, self.whole)?;
        let is_whole = is_over && end.is_some();
        if self.whole && !is_whole {
            Err(LogError::Damaged("a stretch of it has no end".to_owned()))
        } else {
            Ok((Stretch { threads, plan, end }, is_whole))
        }
    }

    /// Returns the entries of a thread, up to the first that cannot be known.
    fn thread(&mut self, logged: Vec<Logged>) -> Result<Vec<LoggedEntry>, LogError> {
        let mut entries = Vec::<LoggedEntry>::new();
        for (entry, operations) in logged {
            if let Entry::Obey { event, .. } = entry
                && self.event(event)?.is_none()
            {
                break;
            }
            let last = entries.last();
            let works = last.is_some_and(LoggedEntry::begins_work);
            if works != matches!(entry, Entry::Done { .. }) {
                return Err(impossible(format!("{entry:?} in the midst of another one")));
            }
            entries.push(LoggedEntry::after(last, entry, operations));
        }
        Ok(entries)
    }

    /// Returns the position of an event that a thread mentions; `None` where the events are cut off
    /// before it.
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
                "event {event} is not a command, or came twice"
            ))),
        }
    }
}

/// Returns the next entries of a thread that are of a `kind`.
fn take_while(
    entries: &mut Peekable<IntoIter<Logged>>,
    kind: impl Fn(&Entry) -> bool,
) -> Vec<Logged> {
    std::iter::from_fn(|| entries.next_if(|(entry, _)| kind(entry))).collect()
}

fn impossible(why: String) -> LogError {
    LogError::Impossible(why)
}

/// Ticks and commands that overlap, so that none of them can be executed whole before the
/// others.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Overlap {
    /// Run time at which the first of them began.
    pub from: Time,
    /// Run time at which the last of them began.
    pub to: Time,
    /// Their operations in order.
    pub operations: Vec<OverlapOperation>,
}

/// An access to what nodes share, within an [`Overlap`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OverlapOperation {
    /// Index of the node in the graph; `None` for the thread that supervises them.
    pub node: Option<usize>,
    /// Run time at which its tick began.
    pub at: Time,
    /// Name of the topic, or of the [`Shared`](ratelab::Shared) value.
    pub takes: Arc<str>,
    /// Its turn there, counted from zero.
    pub turn: u64,
}

impl Stretch {
    /// Returns its ticks that overlap.
    pub(crate) fn overlaps(&self) -> impl Iterator<Item = Overlap> {
        self.plan
            .parts
            .iter()
            .filter(|part| part.overlaps)
            .map(|part| self.overlap(part))
    }

    fn overlap(&self, part: &PlanPart) -> Overlap {
        let mut overlap = Overlap {
            from: Time::MAX,
            to: part.at,
            operations: Vec::new(),
        };
        for step in &self.plan.steps[part.steps.clone()] {
            let entry = &self.threads[step.thread][step.entry];
            overlap.from = overlap.from.min(entry.began);
            let operation = entry.operations.get(step.operation);
            overlap
                .operations
                .extend(operation.map(|operation| OverlapOperation {
                    node: entry.node.or(step.thread.checked_sub(1)),
                    at: entry.began,
                    takes: operation.lock.text(),
                    turn: operation.turn,
                }));
        }
        overlap
    }

    /// Cuts it off after the last rest at or before run time `at`; `false` if nothing of it is
    /// later.
    pub(crate) fn cut(&mut self, at: Time) -> bool {
        let is_cut = self.plan.cut(at);
        self.end = self.end.filter(|_| !is_cut);
        is_cut
    }
}
