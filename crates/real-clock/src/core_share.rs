//! Threads that share cores: by the priorities of their nodes, or by deadlines, where the earlier a
//! deadline is, the higher is the priority.
//!
//! A thread without work waits above all others of its executor, so that it takes note of what is
//! due at once, and finds its place among them before its tick begins.

use ratelab::{
    Time,
    sync::{Arc, Mutex, lock},
};

use crate::priority::{ThreadId, set_rank, this_thread};

/// The cores that a thread shares with threads of other priorities.
#[derive(Clone, Debug)]
pub(crate) struct CoreShare {
    /// Place of its priority in the executor, the highest first.
    pub(crate) rank: usize,
    /// Numbers of the cores.
    pub(crate) cores: Vec<usize>,
    /// The threads of the executor that have work, if deadlines decide.
    pub(crate) deadlines: Option<Arc<DeadlineRanks>>,
}

/// The threads of an executor that have work, the earliest deadline first.
#[derive(Debug, Default)]
pub(crate) struct DeadlineRanks(Mutex<Vec<(Time, ThreadId)>>);

impl DeadlineRanks {
    /// Gives the calling thread the place of its `deadline`; the first without one.
    pub(crate) fn place(&self, deadline: Option<Time>) {
        let this = this_thread();
        // Nobody of the executor takes its core away while it has the lock.
        set_rank(this, 0);
        let rank = self.move_to(this, deadline);
        set_rank(this, rank);
    }

    /// Ranks all other threads around this one, and returns its own rank.
    fn move_to(&self, this: ThreadId, deadline: Option<Time>) -> usize {
        let mut threads = lock(&self.0);
        threads.retain(|(_, thread)| *thread != this);
        let place = deadline.map(|deadline| {
            let place = threads.partition_point(|(other, _)| *other <= deadline);
            threads.insert(place, (deadline, this));
            place
        });
        let others = threads
            .iter()
            .enumerate()
            .filter(|(_, (_, thread))| *thread != this);
        others.for_each(|(place, (_, thread))| set_rank(*thread, place + 1));
        place.map_or(0, |place| place + 1)
    }
}
