//! The entries of all threads of a stretch, and an order in which they can be executed
//! again.
//!
//! An entry whose operations are all next in turn can run whole, on any thread. Where two
//! ticks overlap so that neither can, the smallest group that begins and ends at rest is an
//! overlap: it needs a thread for each of its nodes. Of several entries the one that began
//! first comes first.

use std::{
    cmp::Reverse,
    collections::{BTreeMap, BTreeSet, BinaryHeap},
    ops::Range,
    time::Duration,
};

use ratelab::{
    Time,
    journal::{Entry, LockName, Operation},
    sync::Arc,
};

use crate::log::LogError;

/// An entry of a thread, with what follows from earlier entries.
#[derive(Debug)]
pub(crate) struct LoggedEntry {
    pub(crate) entry: Entry,
    pub(crate) operations: Arc<[Operation]>,
    /// Run time at which it began: the end of some work began with it. That of the one before for
    /// an entry without a time.
    pub(crate) began: Time,
    /// The node that did its work, if it is about some.
    pub(crate) node: Option<usize>,
}

impl LoggedEntry {
    /// Creates the entry after `last`.
    pub(crate) fn after(last: Option<&Self>, entry: Entry, operations: Vec<Operation>) -> Self {
        let (at, node) = match entry {
            Entry::Look { at, node, .. } => (Some(at), node),
            Entry::Finish { at, node } => (Some(at), Some(node)),
            Entry::Done { .. } => (None, last.and_then(|last| last.node)),
            entry => (entry.at(), None),
        };
        Self {
            entry,
            operations: operations.into(),
            began: at.or(last.map(|last| last.began)).unwrap_or_default(),
            node,
        }
    }

    /// Returns whether it began some work, which is over with the next entry.
    pub(crate) fn begins_work(&self) -> bool {
        self.node.is_some() && !matches!(self.entry, Entry::Done { .. })
    }
}

/// Returns the duration of the work that the first of these `entries` began; zero for one without
/// any.
pub(crate) fn took(entries: &[LoggedEntry]) -> Duration {
    match entries {
        [first, next, ..] if first.begins_work() => {
            next.entry.at().unwrap_or_default().since(first.began)
        }
        _ => Duration::ZERO,
    }
}

/// The next turn of each lock.
pub(crate) type Turns = BTreeMap<LockName, u64>;

/// A place in the log of a stretch: an operation of an entry, or an entry without any.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlanStep {
    pub(crate) thread: usize,
    pub(crate) entry: usize,
    pub(crate) operation: usize,
}

/// The order of a stretch.
#[derive(Debug, Default)]
pub(crate) struct Plan {
    pub(crate) steps: Vec<PlanStep>,
    /// The steps, divided where no entry is half done.
    pub(crate) parts: Vec<PlanPart>,
}

/// What runs as one: an entry, or several that overlap.
#[derive(Debug)]
pub(crate) struct PlanPart {
    /// Its place among the steps.
    pub(crate) steps: Range<usize>,
    pub(crate) overlaps: bool,
    /// Run time of its latest entry.
    pub(crate) at: Time,
    /// Whether the graph is at rest after it: the schedulers know of all that was done.
    pub(crate) rests: bool,
}

impl Plan {
    /// Returns the plan for `threads` with these `names`, whose first operations take these
    /// `turns`. A log that is not `whole` is planned until an operation is missing: then this
    /// returns `false` beside the plan.
    ///
    /// # Errors
    /// [`LogError`] if no such order exists.
    pub(crate) fn new(
        threads: &[Vec<LoggedEntry>],
        names: &[Arc<str>],
        turns: &mut Turns,
        whole: bool,
    ) -> Result<(Self, bool), LogError> {
        let mut planner = Planner::new(threads, turns)?;
        while let Some(part) = planner.next() {
            planner.plan.parts.push(part);
        }
        let is_over = planner.unfinished().next().is_none();
        if whole && !is_over {
            return Err(LogError::Impossible(planner.obstacle(names)));
        }
        turns.extend(planner.locks.iter().map(|(name, lock)| (*name, lock.next)));
        Ok((planner.plan, is_over))
    }

    /// Forgets what comes after the last rest at or before run time `at`; `false` if no part is
    /// later.
    pub(crate) fn cut(&mut self, at: Time) -> bool {
        let Some(later) = self.parts.iter().position(|part| part.at > at) else {
            return false;
        };
        let rest = self.parts[..later].iter().rposition(|part| part.rests);
        self.parts.truncate(rest.map_or(0, |rest| rest + 1));
        let steps = self.parts.last().map_or(0, |last| last.steps.end);
        self.steps.truncate(steps);
        true
    }
}

/// A lock with the order of its turns.
#[derive(Default)]
struct Lock {
    next: u64,
    /// All turns with their threads, in order.
    turns: Vec<(u64, usize)>,
    /// Threads whose next entry waits for this lock.
    waiting: Vec<usize>,
}

impl Lock {
    /// Returns the thread that has the next turn.
    fn owner(&self) -> Option<usize> {
        let index = self
            .turns
            .binary_search_by_key(&self.next, |(turn, _)| *turn);
        Some(self.turns[index.ok()?].1)
    }
}

struct Planner<'a> {
    threads: &'a [Vec<LoggedEntry>],
    /// The next step of each thread.
    next: Vec<PlanStep>,
    locks: BTreeMap<LockName, Lock>,
    /// Threads that may have a whole entry to run, by its run time.
    ready: BinaryHeap<Reverse<(Time, usize)>>,
    /// Threads in the midst of some work.
    working: BTreeSet<usize>,
    plan: Plan,
}

impl<'a> Planner<'a> {
    fn new(threads: &'a [Vec<LoggedEntry>], turns: &Turns) -> Result<Self, LogError> {
        let mut locks = BTreeMap::<LockName, Lock>::new();
        for (thread, entries) in threads.iter().enumerate() {
            for operation in entries.iter().flat_map(|logged| &*logged.operations) {
                let name = operation.lock;
                let lock = locks.entry(name).or_insert_with(|| Lock {
                    next: turns.get(&name).copied().unwrap_or(0),
                    ..Lock::default()
                });
                // Before its first turn in a stretch anybody may have been there.
                if operation.outside && operation.turn != lock.next {
                    return Err(LogError::Outside(name.text().to_string()));
                }
                lock.turns.push((operation.turn, thread));
            }
        }
        locks
            .values_mut()
            .for_each(|lock| lock.turns.sort_unstable());
        let first = |thread| PlanStep {
            thread,
            entry: 0,
            operation: 0,
        };
        let mut planner = Self {
            threads,
            next: (0..threads.len()).map(first).collect(),
            locks,
            ready: BinaryHeap::new(),
            working: BTreeSet::new(),
            plan: Plan::default(),
        };
        planner.wake_all();
        Ok(planner)
    }

    /// Returns the next entry of a thread.
    fn entry(&self, thread: usize) -> Option<&'a LoggedEntry> {
        self.threads[thread].get(self.next[thread].entry)
    }

    /// Returns the operation of a step; `None` for an entry without any.
    fn operation(&self, step: PlanStep) -> Option<&'a Operation> {
        let entry = self.threads[step.thread].get(step.entry)?;
        entry.operations.get(step.operation)
    }

    /// Returns the threads with entries left, by the run times of these.
    fn unfinished(&self) -> impl Iterator<Item = (Time, usize)> {
        let threads = 0..self.threads.len();
        threads.filter_map(|thread| Some((self.entry(thread)?.began, thread)))
    }

    /// Looks at all threads again.
    fn wake_all(&mut self) {
        self.locks
            .values_mut()
            .for_each(|lock| lock.waiting.clear());
        self.ready = self.unfinished().map(Reverse).collect();
    }

    fn lock(&mut self, name: LockName) -> &mut Lock {
        self.locks.entry(name).or_default()
    }

    /// Returns the first whole entry that can run, or else the overlap around the entry that began
    /// first; of a torn log, the first that is whole.
    fn next(&mut self) -> Option<PlanPart> {
        while let Some(Reverse((_, thread))) = self.ready.pop() {
            match self.part(thread, false) {
                Ok(part) => {
                    self.wake(thread, part.steps.clone());
                    return Some(part);
                }
                Err(lock) => self.lock(lock).waiting.push(thread),
            }
        }
        let mut starts: Vec<(Time, usize)> = self.unfinished().collect();
        starts.sort_unstable();
        let overlap = starts
            .into_iter()
            .find_map(|(_, start)| self.part(start, true).ok());
        self.wake_all();
        overlap
    }

    /// Looks again at a `thread` that took these `steps`, and at threads that waited for it.
    fn wake(&mut self, thread: usize, steps: Range<usize>) {
        let mut woken = vec![thread];
        for step in steps {
            if let Some(operation) = self.operation(self.plan.steps[step]) {
                woken.append(&mut self.lock(operation.lock).waiting);
            }
        }
        for thread in woken {
            let next = self.entry(thread);
            self.ready
                .extend(next.map(|entry| Reverse((entry.began, thread))));
        }
    }

    /// Takes the steps of the next entry of `start`; if it `overlaps`, with the steps of threads
    /// that it waits for. Takes none if it cannot end, and returns the lock that it waits for.
    fn part(&mut self, start: usize, overlaps: bool) -> Result<PlanPart, LockName> {
        let (from, mut open) = (self.plan.steps.len(), vec![start]);
        while let Some(&first) = open.first() {
            let thread = match self.can_step(first) {
                Ok(()) => first,
                Err(lock) => {
                    let able = open
                        .iter()
                        .copied()
                        .find(|thread| self.can_step(*thread).is_ok());
                    let needed = || self.needed_by(first).filter(|_| overlaps);
                    let Some(thread) = able.or_else(needed) else {
                        self.back_to(from);
                        return Err(lock);
                    };
                    thread
                }
            };
            let ends = self.step(thread);
            open.retain(|other| *other != thread || !ends);
            if !ends && !open.contains(&thread) {
                open.push(thread);
            }
        }
        Ok(self.ended(from, overlaps))
    }

    /// Returns the part of the steps after the first `from`.
    fn ended(&mut self, from: usize, overlaps: bool) -> PlanPart {
        let mut latest = Time::ZERO;
        for step in &self.plan.steps[from..] {
            let entry = &self.threads[step.thread][step.entry];
            latest = latest.max(entry.began);
            if entry.begins_work() {
                self.working.insert(step.thread)
            } else {
                self.working.remove(&step.thread)
            };
        }
        PlanPart {
            steps: from..self.plan.steps.len(),
            overlaps,
            at: latest,
            rests: self.working.is_empty(),
        }
    }

    /// Returns whether the next operation of a thread is next in turn; the lock if it is not.
    fn can_step(&self, thread: usize) -> Result<(), LockName> {
        match self.operation(self.next[thread]) {
            Some(operation) if self.locks[&operation.lock].next != operation.turn => {
                Err(operation.lock)
            }
            _ => Ok(()),
        }
    }

    /// Takes one step of a thread; returns whether the entry ends with it.
    fn step(&mut self, thread: usize) -> bool {
        let step = self.next[thread];
        if let Some(operation) = self.operation(step) {
            self.lock(operation.lock).next += 1;
        }
        self.plan.steps.push(step);
        let operations = self.threads[thread][step.entry].operations.len();
        let ends = step.operation + 1 >= operations;
        let next = &mut self.next[thread];
        (next.entry, next.operation) = if ends {
            (step.entry + 1, 0)
        } else {
            (step.entry, step.operation + 1)
        };
        ends
    }

    /// Takes back all steps but the first `from`.
    fn back_to(&mut self, from: usize) {
        for step in self.plan.steps.split_off(from).into_iter().rev() {
            if let Some(operation) = self.operation(step) {
                self.lock(operation.lock).next -= 1;
            }
            self.next[step.thread] = step;
        }
    }

    /// Returns the thread that can go on, and that `thread` waits for, directly or not.
    fn needed_by(&self, mut thread: usize) -> Option<usize> {
        for _ in 0..=self.threads.len() {
            let operation = self.operation(self.next[thread])?;
            thread = self.locks[&operation.lock].owner()?;
            if self.can_step(thread).is_ok() {
                return Some(thread);
            }
        }
        None
    }

    /// Returns why nothing can go on, for threads with these `names`.
    fn obstacle(&self, names: &[Arc<str>]) -> String {
        let waits = self.next.iter().zip(names).filter_map(|(next, name)| {
            let Operation { lock, turn, .. } = self.operation(*next)?;
            let next = self.locks[lock].next;
            let missing = match self.locks[lock].owner() {
                Some(_) => "",
                None => ", which nobody took",
            };
            let lock_name = lock.text();
            Some(format!(
                "{name} took turn {turn} of {lock_name} after turn {next}{missing}"
            ))
        });
        waits.collect::<Vec<_>>().join(", ")
    }
}
