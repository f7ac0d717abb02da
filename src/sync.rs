//! The concurrency primitives of this crate and of the crates that use it, in one place.
//!
//! What threads wait for goes through these names, so that the feature `model`
//! can replace the operating system by the shuttle model checker, which tries
//! interleavings that are rare on a real machine.

use std::time::Duration;

#[cfg(not(feature = "model"))]
pub use std::{
    sync::{Arc, Condvar, Mutex, MutexGuard, atomic},
    thread, thread_local,
    time::Instant,
};

#[cfg(feature = "model")]
pub use self::model::Instant;
#[cfg(feature = "model")]
pub use shuttle::{
    sync::{Arc, Condvar, Mutex, MutexGuard, atomic},
    thread, thread_local,
};

/// Locks a mutex, even after a panic elsewhere: no critical section leaves its data
/// half-changed, and the panic itself is reported as a fault.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// Returns the value of a mutex that nobody else can lock now.
pub fn get_mut<T>(mutex: &mut Mutex<T>) -> &mut T {
    mutex
        .get_mut()
        .unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// Waits on `condvar` for at most `timeout`. The model's condition variables have no
/// time-out, but its wall clock advances with every read: there a wait of up to an hour ends at
/// once, for its caller to look at that clock.
pub fn wait_timeout<'m, T>(
    condvar: &Condvar,
    mutex: &'m Mutex<T>,
    guard: MutexGuard<'m, T>,
    timeout: Duration,
) -> MutexGuard<'m, T> {
    if cfg!(feature = "model") && timeout <= Duration::from_secs(3600) {
        drop(guard);
        thread::yield_now();
        return lock(mutex);
    }
    match condvar.wait_timeout(guard, timeout) {
        Ok((guard, _)) => guard,
        Err(poisoned) => poisoned.into_inner().0,
    }
}

/// Keeps a core busy for about a microsecond.
pub fn spin() {
    #[cfg(not(feature = "model"))]
    (0..64).for_each(|_| std::hint::spin_loop());
    #[cfg(feature = "model")]
    thread::yield_now();
}

/// Spawns a scoped thread that debuggers show under its node's name. The model's threads have no
/// names and are unlimited.
pub fn spawn_named<'scope>(
    scope: &'scope thread::Scope<'scope, '_>,
    name: &str,
    run: impl FnOnce() + Send + 'scope,
) -> std::io::Result<()> {
    #[cfg(not(feature = "model"))]
    let thread = thread::Builder::new().name(name.to_owned());
    #[cfg(not(feature = "model"))]
    thread.spawn_scoped(scope, run)?;
    #[cfg(feature = "model")]
    let _ = (name, scope.spawn(run));
    Ok(())
}

#[cfg(feature = "model")]
mod model {
    use std::{
        cell::Cell,
        ops::{Add, Sub},
        time::Duration,
    };

    /// Nanoseconds by which each read advances the model's wall clock.
    const LOOK: u64 = 1_000_000;

    thread_local! {
        /// The checker runs all threads of a model on one system thread, so parallel
        /// checks keep separate clocks.
        static ELAPSED: Cell<u64> = const { Cell::new(0) };
    }

    /// A wall clock for model checking: it advances only when it is read, so a deadline
    /// passes after a bounded number of reads in any interleaving.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    pub struct Instant(Duration);

    impl Instant {
        /// Returns the model's wall time.
        pub fn now() -> Self {
            let elapsed = ELAPSED.get();
            ELAPSED.set(elapsed + LOOK);
            Self(Duration::from_nanos(elapsed))
        }

        /// Returns the time since this instant; zero if it is in the future.
        pub fn elapsed(&self) -> Duration {
            Self::now().0.saturating_sub(self.0)
        }

        /// This instant and `duration`, unless that overflows.
        pub fn checked_add(&self, duration: Duration) -> Option<Self> {
            self.0.checked_add(duration).map(Self)
        }

        /// This instant less `duration`, unless that is before the first.
        pub fn checked_sub(&self, duration: Duration) -> Option<Self> {
            self.0.checked_sub(duration).map(Self)
        }

        /// Returns the time from `earlier` to this instant; zero if it is not earlier.
        pub fn saturating_duration_since(&self, earlier: Self) -> Duration {
            self.0.saturating_sub(earlier.0)
        }
    }

    impl Add<Duration> for Instant {
        type Output = Self;
        fn add(self, duration: Duration) -> Self {
            Self(self.0 + duration)
        }
    }

    impl Sub for Instant {
        type Output = Duration;
        fn sub(self, earlier: Self) -> Duration {
            self.saturating_duration_since(earlier)
        }
    }
}
