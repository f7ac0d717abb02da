//! The turns that a thread has to keep to.

use std::{cell::RefCell, rc::Rc};

use ratelab::{Following, LockName, Operation, TurnFollower, sync::Arc};

use super::watch::Watch;

/// The operations that a thread is to do in its entry.
pub(crate) struct Script {
    watch: Arc<Watch>,
    entry: RefCell<EntryLines>,
}

#[derive(Default)]
struct EntryLines {
    /// Index of the thread.
    thread: usize,
    expected: Vec<Operation>,
    done: usize,
}

impl Script {
    pub(crate) fn new(watch: &Arc<Watch>) -> Rc<Self> {
        Rc::new(Self {
            watch: watch.clone(),
            entry: RefCell::default(),
        })
    }

    /// Has the calling thread keep to these turns, while the result lives.
    pub(crate) fn follow(self: &Rc<Self>) -> Following {
        Following::new(self.clone())
    }

    /// Sets the operations of the next entry of this thread, which is number `thread`.
    pub(crate) fn expect(&self, thread: usize, operations: &[Operation]) {
        let mut entry = self.entry.borrow_mut();
        entry.thread = thread;
        entry.expected.clear();
        entry.expected.extend_from_slice(operations);
        entry.done = 0;
    }

    /// Checks that the entry has done all its operations.
    pub(crate) fn finish_entry(&self) {
        let entry = self.entry.borrow();
        if let Some(next) = entry.expected.get(entry.done) {
            let (name, lock) = (self.watch.name(entry.thread), next.lock.text());
            let why = format!("{name} ended its tick where the recorded run took {lock}");
            self.watch.differs(why);
        }
    }
}

impl TurnFollower for Script {
    fn next(&self, lock: LockName) -> Option<u64> {
        if self.watch.is_over() {
            return None;
        }
        let mut entry = self.entry.borrow_mut();
        let expected = entry.expected.get(entry.done).copied();
        if let Some(operation) = expected.filter(|operation| operation.lock == lock) {
            entry.done += 1;
            self.watch.perturb();
            self.watch.hold().pass(entry.thread);
            return Some(operation.turn);
        }
        let expected = expected.map(|operation| operation.lock.text());
        self.watch.differs(format!(
            "{} took {} where the recorded run took {}",
            self.watch.name(entry.thread),
            lock.text(),
            expected.as_deref().unwrap_or("nothing more")
        ));
        None
    }

    fn missed(&self, lock: LockName, turn: u64) {
        let name = lock.text();
        let why = format!("turn {turn} of {name} was taken by another");
        self.watch.differs(why);
    }

    fn is_free(&self) -> bool {
        self.watch.is_over()
    }

    fn waits(&self, waits: bool) {
        self.watch.waits(self.entry.borrow().thread, waits);
    }

    fn holds(&self) -> bool {
        self.watch.hold().is_on()
    }

    fn let_go(&self) {
        self.watch.hold().let_go();
    }
}
