//! Thread priorities: real-time for threads that must wake on time, low for background threads; and
//! cores that threads share by priority: that of their nodes, or by deadlines, where the earlier a
//! deadline is, the higher is the priority.
//!
//! A thread without work waits above all others of its executor, so that it takes note of what is
//! due at once, and finds its place among them before its tick begins.

use ratelab::{
    Time,
    sync::{Arc, Mutex, lock},
};
use thiserror::Error;

pub use system::lower_priority;
pub(crate) use system::{
    ThreadId, core_time, prepare_thread, set_rank, share_cores, spare_cores, this_thread,
};

/// Proof that real-time scheduling and locked memory were granted; see
/// [`RealtimePriority::request`].
#[derive(Clone, Debug)]
pub struct RealtimePriority(());

/// Real-time scheduling or locked memory was refused.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "{what} was refused ({why}): it needs root or the limits rtprio and memlock; the run goes on without"
)]
pub struct RealtimeError {
    what: &'static str,
    why: String,
}

#[cfg(target_os = "linux")]
mod system {
    use std::time::Duration;

    use nix::{
        sched::{CpuSet, sched_getaffinity, sched_setaffinity},
        sys::{
            mman::{MlockAllFlags, mlockall},
            prctl,
        },
        time::{ClockId, clock_gettime},
        unistd::Pid,
    };
    pub(crate) use thread_priority::ThreadId;
    use thread_priority::{
        NormalThreadSchedulePolicy, RealtimeThreadSchedulePolicy, ThreadPriority,
        ThreadSchedulePolicy, set_thread_priority_and_policy, thread_native_id,
    };

    use super::{RealtimeError, RealtimePriority};

    /// Middle of the range of SCHED_FIFO: above every ordinary thread, below the kernel's
    /// own interrupt threads.
    const PRIORITY: u8 = 49;

    /// A priority of ordinary threads, of 0 to 99: a niceness of 10, about a tenth of the share
    /// of a thread with the usual one.
    const LOW: u8 = 23;

    impl RealtimePriority {
        /// Requests SCHED_FIFO for the node threads and locks the process in memory, so
        /// that neither another program nor a page fault delays a tick.
        ///
        /// # Errors
        /// [`RealtimeError`] with the refused request. The run can still go on without
        /// it.
        pub fn request() -> Result<Self, RealtimeError> {
            let probe =
                std::thread::spawn(|| raise_priority(PRIORITY).map_err(|e| format!("{e:?}")));
            let raised = probe.join().unwrap_or_else(|_| Err("no thread".to_owned()));
            raised.map_err(|why| RealtimeError {
                what: "SCHED_FIFO",
                why,
            })?;
            mlockall(MlockAllFlags::MCL_CURRENT | MlockAllFlags::MCL_FUTURE).map_err(|errno| {
                RealtimeError {
                    what: "locked memory",
                    why: errno.desc().to_owned(),
                }
            })?;
            Ok(Self(()))
        }
    }

    /// Makes the calling thread wake as close to its deadlines as possible.
    pub(crate) fn prepare_thread(realtime: Option<&RealtimePriority>) {
        // The kernel's default slack of 50 µs would be half of all lateness. A refusal
        // only costs accuracy, and lateness is measured anyway.
        let _ = prctl::set_timerslack(1);
        if realtime.is_some() {
            // `request` has tested this permission already.
            let _ = raise_priority(PRIORITY);
        }
    }

    /// Returns the cores for executors with priorities: all but the first, which is for the rest.
    pub(crate) fn spare_cores() -> Vec<usize> {
        let allowed = sched_getaffinity(Pid::from_raw(0)).unwrap_or_default();
        let all = 0..CpuSet::count();
        all.filter(|core| allowed.is_set(*core).unwrap_or_default())
            .skip(1)
            .collect()
    }

    /// Binds the calling thread to these cores with its rank there: below the threads of other
    /// nodes, so that what comes from outside is on time.
    pub(crate) fn share_cores(rank: usize, cores: &[usize]) {
        set_rank(this_thread(), rank);
        let mut set = CpuSet::new();
        for core in cores {
            let _ = set.set(*core);
        }
        let _ = sched_setaffinity(Pid::from_raw(0), &set);
    }

    /// Returns the calling thread.
    pub(crate) fn this_thread() -> ThreadId {
        thread_native_id()
    }

    /// Ranks a thread among the threads that share cores; the first has the highest priority.
    pub(crate) fn set_rank(thread: ThreadId, rank: usize) {
        let below = u8::try_from(rank).unwrap_or(u8::MAX).saturating_add(1);
        // `request` has tested this permission already.
        let _ = set_priority(thread, PRIORITY.saturating_sub(below).max(1));
    }

    /// Returns the time that the calling thread has had on a core.
    pub(crate) fn core_time() -> Duration {
        let time = clock_gettime(ClockId::CLOCK_THREAD_CPUTIME_ID);
        time.map(Duration::from).unwrap_or_default()
    }

    /// Lowers the priority of the calling thread and of the threads it starts: beside other
    /// threads they have a small share of a core, and never none, so that their work ends on a
    /// busy machine as well. Has no effect on systems without such a priority.
    pub fn lower_priority() {
        let policy = ThreadSchedulePolicy::Normal(NormalThreadSchedulePolicy::Other);
        if let Ok(low) = LOW.try_into() {
            let low = ThreadPriority::Crossplatform(low);
            // Lowering a priority needs no permission.
            let _ = set_thread_priority_and_policy(thread_native_id(), low, policy);
        }
    }

    fn raise_priority(priority: u8) -> Result<(), thread_priority::Error> {
        set_priority(this_thread(), priority)
    }

    fn set_priority(thread: ThreadId, priority: u8) -> Result<(), thread_priority::Error> {
        let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
        let priority = ThreadPriority::Crossplatform(
            priority
                .try_into()
                .map_err(|_| thread_priority::Error::Priority("not within 0 to 99"))?,
        );
        set_thread_priority_and_policy(thread, priority, policy)
    }
}

#[cfg(not(target_os = "linux"))]
mod system {
    use std::time::Duration;

    use super::{RealtimeError, RealtimePriority};

    impl RealtimePriority {
        /// Requests real-time scheduling, which has no common interface on this system.
        ///
        /// # Errors
        /// Always, on this system.
        pub fn request() -> Result<Self, RealtimeError> {
            Err(RealtimeError {
                what: "SCHED_FIFO",
                why: "only Linux has it".to_owned(),
            })
        }
    }

    pub(crate) fn prepare_thread(_: Option<&RealtimePriority>) {}

    pub(crate) fn spare_cores() -> Vec<usize> {
        Vec::new()
    }

    pub(crate) fn share_cores(_: usize, _: &[usize]) {}

    /// The number of a thread.
    pub(crate) type ThreadId = usize;

    pub(crate) fn this_thread() -> ThreadId {
        0
    }

    pub(crate) fn set_rank(_: ThreadId, _: usize) {}

    /// Nobody asks without real-time scheduling.
    pub(crate) fn core_time() -> Duration {
        Duration::ZERO
    }

    /// Does nothing on this system.
    pub fn lower_priority() {}
}

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
