//! Puts the entries of all threads of a stretch in an order in which they can be executed
//! again.
//!
//! An entry whose operations are all next in turn can run whole, on any thread. Where two
//! ticks overlap so that neither can, the smallest group that begins and ends at rest is a
//! overlap: it needs a thread for each of its nodes. Of several entries the one that began
//! first comes first.

use std::{
    cmp::Reverse,
    collections::{BTreeMap, BTreeSet, BinaryHeap},
};

use ratelab::{LockName, Operation, Time, sync::Arc};

use super::{entry::LoggedEntry, log::LogError, overlap::OverlapStep};

/// The next turn of each lock.
pub(crate) type Turns = BTreeMap<LockName, u64>;

/// The order of a stretch.
#[derive(Debug, Default)]
pub(crate) struct Plan {
    parts: Vec<Planned>,
    whole: bool,
}

/// A part of the plan: before and after it no node is in a tick.
#[derive(Debug)]
pub(crate) struct Planned {
    pub(crate) part: PlanPart,
    /// Run time of its latest entry.
    pub(crate) at: Time,
    /// Whether the graph is at rest after it: the schedulers know of all that was done.
    pub(crate) rests: bool,
}

/// What runs as one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum PlanPart {
    /// The next entry of this thread.
    Entry(usize),
    /// The next entries of several threads, which overlap, in steps.
    Overlap(Vec<OverlapStep>),
}

impl Plan {
    /// The plan for `threads` with these `names`, whose first operations take these
    /// `turns`. A log that is not `whole` is planned until an operation is missing.
    ///
    /// # Errors
    /// [`LogError`] if there is no such order.
    pub(crate) fn new(
        threads: &[Vec<LoggedEntry>],
        names: &[Arc<str>],
        turns: &mut Turns,
        whole: bool,
    ) -> Result<Self, LogError> {
        let mut planner = Planner::new(threads, names, turns)?;
        let parts = std::iter::from_fn(|| planner.next()).collect();
        let is_over = planner.is_over();
        if whole && !is_over {
            return Err(LogError::Impossible(planner.obstacle()));
        }
        turns.extend(planner.locks.iter().map(|(name, lock)| (*name, lock.next)));
        let whole = is_over;
        Ok(Self { parts, whole })
    }

    pub(crate) fn parts(&self) -> &[Planned] {
        &self.parts
    }

    /// Number of the parts up to the last rest at or before run time `at`; `None` if no part is
    /// later.
    pub(crate) fn rest_before(&self, at: Time) -> Option<usize> {
        let later = self.parts.iter().position(|planned| planned.at > at)?;
        let rest = self.parts[..later]
            .iter()
            .rposition(|planned| planned.rests);
        Some(rest.map_or(0, |rest| rest + 1))
    }

    /// Whether every entry is in it.
    pub(crate) fn is_whole(&self) -> bool {
        self.whole
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
    /// The thread that has the next turn.
    fn owner(&self) -> Option<usize> {
        let index = self
            .turns
            .binary_search_by_key(&self.next, |(turn, _)| *turn);
        Some(self.turns[index.ok()?].1)
    }
}

/// A thread with its position between two operations.
struct ThreadCursor<'a> {
    entries: &'a [LoggedEntry],
    /// Number of entries done.
    done: usize,
    /// Number of operations done of the next entry.
    taken: usize,
}

impl<'a> ThreadCursor<'a> {
    fn next(&self) -> Option<&'a LoggedEntry> {
        self.entries.get(self.done)
    }

    /// The next operation; `None` if the entry has none left.
    fn operation(&self) -> Option<&'a Operation> {
        self.next()?.operations.get(self.taken)
    }

    fn last(&self) -> Option<&'a LoggedEntry> {
        self.entries.get(self.done.checked_sub(1)?)
    }
}

struct Planner<'a> {
    names: &'a [Arc<str>],
    locks: BTreeMap<LockName, Lock>,
    threads: Vec<ThreadCursor<'a>>,
    /// Threads that may have a whole entry to run, by its run time.
    ready: BinaryHeap<Reverse<(Time, usize)>>,
    /// Threads in the midst of some work.
    working: BTreeSet<usize>,
}

impl<'a> Planner<'a> {
    fn new(
        threads: &'a [Vec<LoggedEntry>],
        names: &'a [Arc<str>],
        turns: &Turns,
    ) -> Result<Self, LogError> {
        let mut locks = BTreeMap::<LockName, Lock>::new();
        for (thread, entries) in threads.iter().enumerate() {
            for operation in entries.iter().flat_map(|logged| &logged.operations) {
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
        for (lock, Lock { turns, .. }) in &mut locks {
            turns.sort_unstable();
            let twice = turns.windows(2).find(|pair| pair[0].0 == pair[1].0);
            if let Some(&[(turn, one), (_, other)]) = twice {
                let (one, other, lock) = (&names[one], &names[other], lock.text());
                return Err(LogError::Impossible(format!(
                    "{one} and {other} both took turn {turn} of {lock}"
                )));
            }
        }
        let threads = threads.iter().map(|entries| ThreadCursor {
            entries,
            done: 0,
            taken: 0,
        });
        let mut planner = Self {
            names,
            locks,
            threads: threads.collect(),
            ready: BinaryHeap::new(),
            working: BTreeSet::new(),
        };
        planner.wake_all();
        Ok(planner)
    }

    /// The threads with entries left, by the run times of these.
    fn unfinished(&self) -> impl Iterator<Item = (Time, usize)> {
        let threads = self.threads.iter().enumerate();
        threads.filter_map(|(index, thread)| Some((thread.next()?.began, index)))
    }

    fn is_over(&self) -> bool {
        self.unfinished().next().is_none()
    }

    /// Looks at all threads again.
    fn wake_all(&mut self) {
        let locks = self.locks.values_mut();
        locks.for_each(|lock| lock.waiting.clear());
        self.ready = self.unfinished().map(Reverse).collect();
    }

    fn lock(&mut self, name: LockName) -> &mut Lock {
        self.locks.entry(name).or_default()
    }

    fn next(&mut self) -> Option<Planned> {
        self.next_whole().or_else(|| self.next_overlap())
    }

    /// Runs the first whole entry that can run.
    fn next_whole(&mut self) -> Option<Planned> {
        while let Some(Reverse((at, thread))) = self.ready.pop() {
            let Some(entry) = self.threads[thread].next() else {
                continue;
            };
            if let Err(lock) = self.run_whole(thread) {
                self.lock(lock).waiting.push(thread);
                continue;
            }
            let mut woken = vec![thread];
            for operation in &entry.operations {
                woken.append(&mut self.lock(operation.lock).waiting);
            }
            for thread in woken {
                let next = self.threads[thread].next();
                let next = next.map(|entry| Reverse((entry.began, thread)));
                self.ready.extend(next);
            }
            let part = PlanPart::Entry(thread);
            let rests = self.rests_after([thread]);
            return Some(Planned { part, at, rests });
        }
        None
    }

    /// Takes all turns of the next entry of a thread; or none of them, and returns the lock that
    /// is not there yet.
    fn run_whole(&mut self, thread: usize) -> Result<(), LockName> {
        loop {
            if let Err(lock) = self.can_step(thread) {
                while self.threads[thread].taken > 0 {
                    self.step_back(thread);
                }
                return Err(lock);
            }
            if self.step(thread).ends {
                return Ok(());
            }
        }
    }

    /// The overlap around the entry that began first; of a torn log, the first that is whole.
    fn next_overlap(&mut self) -> Option<Planned> {
        let mut starts: Vec<(Time, usize)> = self.unfinished().collect();
        starts.sort_unstable();
        let overlap = starts
            .into_iter()
            .find_map(|(at, start)| self.overlap(start, at));
        self.wake_all();
        overlap
    }

    /// The overlap around the next entry of `start`, which began at `latest`; `None` if it cannot
    /// end.
    fn overlap(&mut self, start: usize, mut latest: Time) -> Option<Planned> {
        let (mut steps, mut open) = (Vec::<OverlapStep>::new(), vec![start]);
        while let Some(first) = open.first() {
            let mut able = open.iter().filter(|thread| self.can_step(**thread).is_ok());
            let able = able.next().copied();
            let Some(thread) = able.or_else(|| self.needed_by(*first)) else {
                for step in steps.iter().rev() {
                    self.step_back(step.thread);
                }
                return None;
            };
            latest = self.threads[thread]
                .next()
                .map_or(latest, |entry| latest.max(entry.began));
            let step = self.step(thread);
            steps.push(step);
            open.retain(|other| *other != thread || !step.ends);
            if !step.ends && !open.contains(&thread) {
                open.push(thread);
            }
        }
        let rests = self.rests_after(steps.iter().map(|step| step.thread));
        Some(Planned {
            part: PlanPart::Overlap(steps),
            at: latest,
            rests,
        })
    }

    /// Whether no thread is in the midst of some work, after entries of these.
    fn rests_after(&mut self, threads: impl IntoIterator<Item = usize>) -> bool {
        for thread in threads {
            let last = self.threads[thread].last();
            match last.is_some_and(LoggedEntry::begins_work) {
                true => self.working.insert(thread),
                false => self.working.remove(&thread),
            };
        }
        self.working.is_empty()
    }

    /// Whether the next operation of a thread is next in turn; the lock if it is not.
    fn can_step(&self, thread: usize) -> Result<(), LockName> {
        match self.threads[thread].operation() {
            Some(operation) if self.locks[&operation.lock].next != operation.turn => {
                Err(operation.lock)
            }
            _ => Ok(()),
        }
    }

    /// Takes one step of a thread.
    fn step(&mut self, thread: usize) -> OverlapStep {
        let operation = self.threads[thread].operation();
        if let Some(operation) = operation {
            self.lock(operation.lock).next += 1;
        }
        let cursor = &mut self.threads[thread];
        cursor.taken += usize::from(operation.is_some());
        let ends = cursor.operation().is_none();
        if ends {
            (cursor.done, cursor.taken) = (cursor.done + 1, 0);
        }
        OverlapStep {
            thread,
            takes: operation.map(|operation| (operation.lock, operation.turn)),
            ends,
        }
    }

    /// Takes the last step of a thread back.
    fn step_back(&mut self, thread: usize) {
        let cursor = &mut self.threads[thread];
        if cursor.taken == 0 {
            cursor.done -= 1;
            cursor.taken = cursor.entries[cursor.done].operations.len();
        }
        cursor.taken = cursor.taken.saturating_sub(1);
        if let Some(operation) = cursor.operation() {
            self.lock(operation.lock).next -= 1;
        }
    }

    /// The thread that can go on, and that `thread` waits for, directly or not.
    fn needed_by(&self, mut thread: usize) -> Option<usize> {
        for _ in 0..=self.threads.len() {
            let operation = self.threads[thread].operation()?;
            thread = self.locks[&operation.lock].owner()?;
            if self.can_step(thread).is_ok() {
                return Some(thread);
            }
        }
        None
    }

    /// Why nothing can go on.
    fn obstacle(&self) -> String {
        let waits = self.threads.iter().zip(self.names);
        let waits = waits.filter_map(|(thread, name)| {
            let Operation { lock, turn, .. } = thread.operation()?;
            let next = self.locks[lock].next;
            let missing = match self.locks[lock].owner() {
                Some(_) => "",
                None => ", which nobody took",
            };
            let lock = lock.text();
            Some(format!(
                "{name} took turn {turn} of {lock} after turn {next}{missing}"
            ))
        });
        waits.collect::<Vec<_>>().join(", ")
    }
}
