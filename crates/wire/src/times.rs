//! Run time here, moments of clocks anywhere.

use std::sync::{Arc, Mutex, PoisonError};

use ratelab::Time;
use ratelab_account::Observer;

use crate::{
    clock::{self, ClockId, Nanos},
    offset::Offsets,
    packet::ClockMoment,
    refusal::Refusal,
};

/// Converts between the run time of this process and the clocks of all.
pub struct Times {
    observer: Observer,
    /// The moment of run time zero, once known.
    zero: Mutex<Option<Nanos>>,
    offsets: Arc<Offsets>,
}

impl Times {
    /// Creates the times of the run that `observer` reads.
    pub fn new(observer: Observer, offsets: Arc<Offsets>) -> Self {
        Self {
            observer,
            zero: Mutex::default(),
            offsets,
        }
    }

    /// Whether times of `clock` can be converted.
    pub fn knows(&self, clock: ClockId) -> bool {
        self.offsets.estimate(clock).is_some()
    }

    /// The steps of other clocks against ours (ns) since the last call.
    pub fn take_steps(&self) -> Vec<(ClockId, Nanos)> {
        self.offsets.take_steps()
    }

    /// The moment of run time zero, by our clock; `None` before the run.
    pub fn zero(&self) -> Option<Nanos> {
        let mut known = self.zero.lock().unwrap_or_else(PoisonError::into_inner);
        if known.is_none() {
            *known = self.observer.zero().map(clock::moment_of);
        }
        *known
    }

    /// The run time now; `None` before the run.
    pub fn now(&self) -> Option<Time> {
        let passed = clock::now().saturating_sub(self.zero()?);
        u64::try_from(passed).ok().map(Time::from_nanos)
    }

    /// The moment of run time `time`; `None` before the run.
    pub fn moment(&self, time: Time) -> Option<ClockMoment> {
        let passed = Nanos::try_from(time.as_nanos()).ok()?;
        Some(ClockMoment {
            clock: ClockId::here(),
            at: self.zero()?.checked_add(passed)?,
        })
    }

    /// The run time of `moment`.
    ///
    /// # Errors
    /// [`Refusal`] if its clock is unknown, or it is before the run or in the future.
    pub fn time(&self, moment: ClockMoment) -> Result<Time, Refusal> {
        let zero = self.zero().ok_or(Refusal::Early)?;
        let estimate = self.offsets.estimate(moment.clock).ok_or(Refusal::Clock)?;
        let (ours, now) = (estimate.ours(moment.at), clock::now());
        if ours.saturating_sub(now) > estimate.bound {
            return Err(Refusal::Future);
        }
        let passed = ours.min(now).saturating_sub(zero);
        let passed = u64::try_from(passed).map_err(|_| Refusal::Early)?;
        Ok(Time::from_nanos(passed))
    }
}
