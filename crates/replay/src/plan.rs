//! Puts the entries of all threads of a stretch in an order in which they can be executed
//! again.
//!
//! An entry whose operations are all next in turn can run whole, on any thread. Where two
//! ticks overlap so that neither can, the smallest group that begins and ends at rest is a
//! knot: it needs a thread for each of its nodes. Of several entries the one that began
//! first comes first.

use std::{
    cmp::Reverse,
    collections::{BTreeMap, BTreeSet, BinaryHeap},
};

use ratelab::{LockName, Time};

use super::{knot::KnotStep, log::LogError, thread::Thread};

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
    Knot(Vec<KnotStep>),
}

/// The threads of a knot, each with its number of entries.
pub(crate) fn entries_of(knot: &[KnotStep]) -> Vec<(usize, usize)> {
    let mut counts = BTreeMap::new();
    for step in knot {
        *counts.entry(step.thread).or_insert(0) += usize::from(step.ends);
    }
    counts.into_iter().collect()
}

impl Plan {
    /// The plan for `threads` with these `names`, whose first operations take these
    /// `turns`. A log that is not `whole` is planned until an operation is missing.
    ///
    /// # Errors
    /// [`LogError`] if there is no such order.
    pub(crate) fn new(
        threads: &[Thread],
        names: Vec<&str>,
        turns: &mut Turns,
        whole: bool,
    ) -> Result<Self, LogError> {
        let mut planner = Planner::new(threads, names, turns)?;
        let mut parts = Vec::new();
        loop {
            if let Some(thread) = planner.next_whole() {
                parts.push(thread);
            } else if planner.is_over() {
                break;
            } else if let Some(knot) = planner.next_knot() {
                parts.push(knot);
            } else if whole {
                return Err(LogError::Impossible(planner.obstacle()));
            } else {
                break;
            }
        }
        let whole = planner.is_over();
        planner.hand_on(turns);
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
struct Lock {
    name: LockName,
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

/// A thread on its way through its entries.
struct Way<'a> {
    thread: &'a Thread,
    /// All operations: the index of the lock, and the turn.
    operations: Vec<(usize, u64)>,
    /// The end of the operations of each entry.
    ends: Vec<usize>,
    /// Number of entries done.
    entry: usize,
    /// Number of operations done.
    done: usize,
}

impl Way<'_> {
    fn is_over(&self) -> bool {
        self.entry == self.ends.len()
    }

    fn at(&self) -> Time {
        self.thread.at(self.entry)
    }

    /// Whether it is between two entries.
    fn rests(&self) -> bool {
        self.done == self.entry.checked_sub(1).map_or(0, |last| self.ends[last])
    }
}

struct Planner<'a> {
    names: Vec<&'a str>,
    locks: Vec<Lock>,
    ways: Vec<Way<'a>>,
    /// Threads that may have a whole entry to run, by its run time.
    ready: BinaryHeap<Reverse<(Time, usize)>>,
    /// Threads in the midst of some work.
    working: BTreeSet<usize>,
}

impl<'a> Planner<'a> {
    fn new(threads: &'a [Thread], names: Vec<&'a str>, turns: &Turns) -> Result<Self, LogError> {
        let mut planner = Self {
            names,
            locks: Vec::new(),
            ways: Vec::new(),
            ready: BinaryHeap::new(),
            working: BTreeSet::new(),
        };
        let mut known = BTreeMap::new();
        for (index, thread) in threads.iter().enumerate() {
            let mut way = Way {
                thread,
                operations: Vec::new(),
                ends: Vec::new(),
                entry: 0,
                done: 0,
            };
            let mut entries = 0..thread.len();
            while let Some((_, operations)) = entries.next().and_then(|at| thread.entry(at)) {
                for operation in operations {
                    let lock = *known.entry(operation.lock).or_insert_with(|| {
                        planner.locks.push(Lock {
                            name: operation.lock,
                            next: turns.get(&operation.lock).copied().unwrap_or(0),
                            turns: Vec::new(),
                            waiting: Vec::new(),
                        });
                        planner.locks.len() - 1
                    });
                    let lock_of = &mut planner.locks[lock];
                    // Before its first turn in a stretch anybody may have been there.
                    if operation.outside && operation.turn != lock_of.next {
                        return Err(LogError::Outside(lock_of.name.text().to_string()));
                    }
                    lock_of.turns.push((operation.turn, index));
                    way.operations.push((lock, operation.turn));
                }
                way.ends.push(way.operations.len());
            }
            planner.ways.push(way);
        }
        planner.sort_turns()?;
        planner.wake_all();
        Ok(planner)
    }

    fn sort_turns(&mut self) -> Result<(), LogError> {
        for lock in &mut self.locks {
            lock.turns.sort_unstable();
            let twice = lock.turns.windows(2).find(|pair| pair[0].0 == pair[1].0);
            if let Some(&[(turn, one), (_, other)]) = twice {
                let (name, names) = (lock.name.text(), &self.names);
                let (one, other) = (names[one], names[other]);
                return Err(LogError::Impossible(format!(
                    "{one} and {other} both took turn {turn} of {name}"
                )));
            }
        }
        Ok(())
    }

    fn is_over(&self) -> bool {
        self.ways.iter().all(Way::is_over)
    }

    /// Looks at all threads again.
    fn wake_all(&mut self) {
        self.locks.iter_mut().for_each(|lock| lock.waiting.clear());
        let unfinished = self
            .ways
            .iter()
            .enumerate()
            .filter(|(_, way)| !way.is_over());
        self.ready = unfinished
            .map(|(index, way)| Reverse((way.at(), index)))
            .collect();
    }

    /// Runs the first whole entry that can run.
    fn next_whole(&mut self) -> Option<Planned> {
        while let Some(Reverse((at, thread))) = self.ready.pop() {
            let way = &self.ways[thread];
            let range = way.done..way.ends[way.entry];
            match self.take_turns(thread, range.clone()) {
                Err(lock) => self.locks[lock].waiting.push(thread),
                Ok(()) => {
                    for operation in range.clone() {
                        let lock = self.ways[thread].operations[operation].0;
                        for other in std::mem::take(&mut self.locks[lock].waiting) {
                            self.ready.push(Reverse((self.ways[other].at(), other)));
                        }
                    }
                    let way = &mut self.ways[thread];
                    (way.done, way.entry) = (range.end, way.entry + 1);
                    if !way.is_over() {
                        self.ready.push(Reverse((way.at(), thread)));
                    }
                    let part = PlanPart::Entry(thread);
                    let rests = self.rests_after([thread]);
                    return Some(Planned { part, at, rests });
                }
            }
        }
        None
    }

    /// Takes the turns of these operations, or none of them and returns the lock that is
    /// not there yet.
    fn take_turns(&mut self, thread: usize, range: std::ops::Range<usize>) -> Result<(), usize> {
        let operations = &self.ways[thread].operations[range];
        for (index, (lock, turn)) in operations.iter().enumerate() {
            if self.locks[*lock].next != *turn {
                for (lock, _) in &operations[..index] {
                    self.locks[*lock].next -= 1;
                }
                return Err(*lock);
            }
            self.locks[*lock].next += 1;
        }
        Ok(())
    }

    /// The knot around the entry that began first; of a torn log, the first that is whole.
    fn next_knot(&mut self) -> Option<Planned> {
        let mut starts: Vec<(Time, usize)> = self
            .ways
            .iter()
            .enumerate()
            .filter(|(_, way)| !way.is_over())
            .map(|(index, way)| (way.at(), index))
            .collect();
        starts.sort_unstable();
        let knot = starts.into_iter().find_map(|(_, start)| self.knot(start));
        self.wake_all();
        knot
    }

    /// The knot around the next entry of `start`; `None` if it cannot end.
    fn knot(&mut self, start: usize) -> Option<Planned> {
        let (mut steps, mut open) = (Vec::new(), vec![start]);
        let mut latest = self.ways[start].at();
        while !open.is_empty() {
            let next = match open.iter().copied().find(|thread| self.can_step(*thread)) {
                Some(thread) => Some(thread),
                None => self.needed_by(open[0]),
            };
            let Some(thread) = next else {
                self.undo(steps);
                return None;
            };
            latest = latest.max(self.ways[thread].at());
            steps.push(self.step(thread));
            match self.ways[thread].rests() {
                true => open.retain(|other| *other != thread),
                false if open.contains(&thread) => {}
                false => open.push(thread),
            }
        }
        let rests = self.rests_after(steps.iter().map(|step| step.thread));
        Some(Planned {
            part: PlanPart::Knot(steps),
            at: latest,
            rests,
        })
    }

    /// Whether no thread is in the midst of some work, after entries of these.
    fn rests_after(&mut self, threads: impl IntoIterator<Item = usize>) -> bool {
        for thread in threads {
            let way = &self.ways[thread];
            let last = way.entry.checked_sub(1);
            match last.is_some_and(|last| way.thread.works_after(last)) {
                true => self.working.insert(thread),
                false => self.working.remove(&thread),
            };
        }
        self.working.is_empty()
    }

    /// The next operation of a thread; `None` if its entry has none left.
    fn operation(&self, thread: usize) -> Option<(usize, u64)> {
        let way = &self.ways[thread];
        let entry = way.operations.get(way.done..*way.ends.get(way.entry)?)?;
        entry.first().copied()
    }

    fn can_step(&self, thread: usize) -> bool {
        match self.operation(thread) {
            Some((lock, turn)) => self.locks[lock].next == turn,
            None => !self.ways[thread].is_over(),
        }
    }

    /// Takes one step of a thread.
    fn step(&mut self, thread: usize) -> KnotStep {
        let operation = self.operation(thread);
        let way = &mut self.ways[thread];
        if let Some((lock, _)) = operation {
            self.locks[lock].next += 1;
            way.done += 1;
        }
        let ends = way.done == way.ends[way.entry];
        way.entry += usize::from(ends);
        KnotStep {
            thread,
            takes: operation.map(|(lock, turn)| (self.locks[lock].name, turn)),
            ends,
        }
    }

    /// The thread that can go on, and that `thread` waits for, directly or not.
    fn needed_by(&self, thread: usize) -> Option<usize> {
        let mut thread = thread;
        for _ in 0..=self.ways.len() {
            let (lock, _) = self.operation(thread)?;
            thread = self.locks[lock].owner()?;
            if self.can_step(thread) {
                return Some(thread);
            }
        }
        None
    }

    /// Takes back the last `steps`.
    fn undo(&mut self, steps: Vec<KnotStep>) {
        for step in steps.into_iter().rev() {
            let way = &mut self.ways[step.thread];
            way.entry -= usize::from(step.ends);
            if step.takes.is_some() {
                way.done -= 1;
                self.locks[way.operations[way.done].0].next -= 1;
            }
        }
    }

    /// Why nothing can go on.
    fn obstacle(&self) -> String {
        let waiting = (0..self.ways.len()).filter(|thread| !self.ways[*thread].is_over());
        let waits = waiting.filter_map(|thread| {
            let (lock, turn) = self.operation(thread)?;
            let (name, lock) = (self.names[thread], &self.locks[lock]);
            let missing = match lock.owner() {
                Some(_) => "",
                None => ", which nobody took",
            };
            let next = lock.next;
            let lock = lock.name.text();
            Some(format!(
                "{name} took turn {turn} of {lock} after turn {next}{missing}"
            ))
        });
        waits.collect::<Vec<_>>().join(", ")
    }

    /// Hands the turns on to the next stretch.
    fn hand_on(self, turns: &mut Turns) {
        turns.extend(self.locks.into_iter().map(|lock| (lock.name, lock.next)));
    }
}
