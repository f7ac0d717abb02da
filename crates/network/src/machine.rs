//! This machine: its name, and the clock behind every time on the wire.

use std::{
    collections::hash_map::RandomState,
    fs,
    hash::{BuildHasher, Hasher},
    process,
    sync::OnceLock,
    time::{Duration, Instant},
};

use rustix::time::{ClockId as Kind, clock_gettime};
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::xxh3_64;

/// A moment of a monotonic clock (ns since an arbitrary zero).
pub type Nanos = i64;

/// Which clock a moment belongs to. Processes of one machine share a clock, even from
/// different network namespaces, so that ages between them are exact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct ClockId(pub u64);

impl ClockId {
    /// Returns the clock of this process: from the boot of its machine and its time namespace,
    /// which may shift it. Where the system has neither it is this process's own.
    pub fn here() -> Self {
        static HERE: OnceLock<ClockId> = OnceLock::new();
        *HERE.get_or_init(|| {
            let boot = fs::read("/proc/sys/kernel/random/boot_id");
            let shift = fs::read("/proc/self/timens_offsets").unwrap_or_default();
            boot.map_or_else(
                |_| Self(random()),
                |boot| Self(xxh3_64(&[boot, shift].concat())),
            )
        })
    }
}

/// A moment of a known clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClockMoment {
    /// The clock.
    pub clock: ClockId,
    /// Its reading (ns).
    pub at: Nanos,
}

impl ClockMoment {
    /// Returns the present moment of this machine's clock.
    pub fn now() -> Self {
        let clock = ClockId::here();
        Self { clock, at: now() }
    }
}

/// Returns the present moment of this machine's clock.
pub fn now() -> Nanos {
    let now = clock_gettime(Kind::Monotonic);
    now.tv_sec.saturating_mul(1_000_000_000) + now.tv_nsec
}

/// Returns the moment of this machine's clock at `instant`.
pub fn moment_of(instant: Instant) -> Nanos {
    let (read, now) = (Instant::now(), now());
    let nanos = |duration: Duration| Nanos::try_from(duration.as_nanos()).unwrap_or(Nanos::MAX);
    match read.checked_duration_since(instant) {
        Some(passed) => now.saturating_sub(nanos(passed)),
        None => now.saturating_add(nanos(instant.saturating_duration_since(read))),
    }
}

/// Returns its name.
pub fn host() -> String {
    let name = rustix::system::uname();
    name.nodename().to_string_lossy().into_owned()
}

/// Returns a random number, for names that are used once.
pub fn random() -> u64 {
    // The standard library seeds each of these from the system's random numbers.
    let mut hasher = RandomState::new().build_hasher();
    hasher.write_i64(now());
    hasher.write_u32(process::id());
    hasher.finish()
}
