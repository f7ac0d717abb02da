//! The turns that a thread has to keep to.

use std::cell::Cell;

use ratelab::{
    journal::{LockName, Operation, TurnFollower},
    sync::Arc,
};

use super::watch::Watch;

/// The operations that a thread is to do in an entry.
pub(crate) struct Script {
    pub(crate) watch: Arc<Watch>,
    /// Number of the thread.
    pub(crate) thread: usize,
    pub(crate) operations: Arc<[Operation]>,
    /// Number of operations done.
    pub(crate) done: Cell<usize>,
}

impl Script {
    fn expected(&self) -> Option<&Operation> {
        self.operations.get(self.done.get())
    }

    /// Checks that the entry has done all its operations.
    pub(crate) fn finish(&self) {
        if let Some(next) = self.expected() {
            let (name, lock) = (self.watch.name(self.thread), next.lock.text());
            let why = format!("{name} ended its tick where the recorded run took {lock}");
            self.watch.differs(why);
        }
    }
}

impl TurnFollower for Script {
    fn next(&self, lock: LockName) -> Option<u64> {
        let expected = self.expected();
        if let Some(operation) = expected.filter(|operation| operation.lock == lock) {
            self.done.set(self.done.get() + 1);
            return self.watch.pass(self.thread).then_some(operation.turn);
        }
        self.watch.differs(format!(
            "{} took {} where the recorded run took {}",
            self.watch.name(self.thread),
            lock.text(),
            expected
                .map(|operation| operation.lock.text())
                .as_deref()
                .unwrap_or("nothing more")
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
        self.watch.waits(self.thread, waits);
    }

    fn is_blocked(&self) {
        self.watch.let_go_if_held();
    }
}
