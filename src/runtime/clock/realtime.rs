//! What the operating system grants to threads that must wake on time, and to
//! those that must not be in their way.

use thiserror::Error;

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
    use nix::sys::{
        mman::{MlockAllFlags, mlockall},
        prctl,
    };
    use thread_priority::{
        NormalThreadSchedulePolicy, RealtimeThreadSchedulePolicy, ThreadPriority,
        ThreadSchedulePolicy, set_thread_priority_and_policy, thread_native_id,
    };

    use super::{RealtimeError, RealtimePriority};

    /// Middle of the range of SCHED_FIFO: above every ordinary thread, not above
    /// the kernel's own interrupt threads.
    const PRIORITY: u8 = 49;

    impl RealtimePriority {
        /// Asks for SCHED_FIFO on the node threads and locks the process in
        /// memory, so that neither another program nor a page fault delays a
        /// tick.
        ///
        /// # Errors
        /// [`RealtimeError`] says what was refused. Nothing is changed then
        /// that would keep a run from going on.
        pub fn request() -> Result<Self, RealtimeError> {
            let probe = std::thread::spawn(|| raise_priority().map_err(|e| format!("{e:?}")));
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

    /// Makes the calling thread wake as close to its deadlines as it may.
    pub(crate) fn prepare_thread(realtime: Option<&RealtimePriority>) {
        // The kernel's default slack of 50 µs would be half of all lateness. A
        // refusal costs accuracy only, and lateness is measured anyway.
        let _ = prctl::set_timerslack(1);
        if realtime.is_some() {
            // Granted to the probe of `request` a moment ago.
            let _ = raise_priority();
        }
    }

    /// Lowers the priority of the calling thread, and of those that it starts: they
    /// run only where no other thread wants the core. Where the system knows no
    /// such thing they run as any other.
    pub fn lower_priority() {
        let policy = ThreadSchedulePolicy::Normal(NormalThreadSchedulePolicy::Idle);
        // No right is needed to have less of a claim.
        let _ = set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Min, policy);
    }

    fn raise_priority() -> Result<(), thread_priority::Error> {
        let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
        let priority = ThreadPriority::Crossplatform(
            PRIORITY
                .try_into()
                .map_err(|_| thread_priority::Error::Priority("not within 0 to 99"))?,
        );
        set_thread_priority_and_policy(thread_native_id(), priority, policy)
    }
}

#[cfg(not(target_os = "linux"))]
mod system {
    use super::{RealtimeError, RealtimePriority};

    impl RealtimePriority {
        /// Asks for real-time scheduling, which this system has no common way
        /// to grant.
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

    /// Lowers the priority of the calling thread, and of those that it starts; not
    /// on this system.
    pub fn lower_priority() {}
}

pub use system::lower_priority;
pub(crate) use system::prepare_thread;
