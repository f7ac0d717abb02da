//! Run times and the clock behind them, and the newest pairs of two kinds of times.

use std::{
    collections::VecDeque,
    sync::{Arc, Mutex, OnceLock},
};

use ratelab::{Time, clock::RunWriter, sync::lock};
use ratelab_metrics::Observer;

use crate::{
    machine::{self, ClockId, ClockMoment, Nanos},
    offset::Offsets,
    sender::Refusal,
};

/// Converts between the run time of this process and the clocks of all.
pub struct Times {
    /// Reads the run.
    pub(crate) observer: Observer,
    /// Logs what is heard of other processes.
    pub(crate) run: RunWriter,
    /// The moment of run time zero, once known.
    zero: OnceLock<Nanos>,
    pub(crate) offsets: Arc<Offsets>,
    /// Whether clocks of the graph are wrong by its settings: stamps may be from the future or from
    /// before the run then.
    wrong_clocks: bool,
    /// Times of this run and the moments that they came from.
    origins: Recent<Time, ClockMoment>,
}

impl Times {
    /// Creates the times of the run that `observer` reads and `run` writes, with `wrong_clocks` or
    /// without.
    pub(crate) fn new(
        observer: Observer,
        run: RunWriter,
        offsets: Arc<Offsets>,
        wrong_clocks: bool,
    ) -> Self {
        Self {
            observer,
            run,
            zero: OnceLock::new(),
            offsets,
            wrong_clocks,
            origins: Recent::default(),
        }
    }

    /// Returns the moment of run time zero, by our clock; `None` before the run.
    pub fn zero(&self) -> Option<Nanos> {
        self.zero.get().copied().or_else(|| {
            let zero = machine::moment_of(self.observer.zero()?);
            Some(*self.zero.get_or_init(|| zero))
        })
    }

    /// Returns the run time now; `None` before the run.
    pub(crate) fn now(&self) -> Option<Time> {
        let passed = machine::now().saturating_sub(self.zero()?);
        u64::try_from(passed).ok().map(Time::from_nanos)
    }

    /// Returns the moment of run time `time`; `None` before the run.
    pub(crate) fn moment(&self, time: Time) -> Option<ClockMoment> {
        let passed = Nanos::try_from(time.as_nanos()).ok()?;
        Some(ClockMoment {
            clock: ClockId::here(),
            at: self.zero()?.checked_add(passed)?,
        })
    }

    /// Returns the run time of `moment`; with wrong clocks as they stamp it, zero before the run.
    ///
    /// # Errors
    /// [`Refusal`] if its clock is unknown, or it is before the run or in the future without a wrong
    /// clock.
    pub(crate) fn time(&self, moment: ClockMoment) -> Result<Time, Refusal> {
        let zero = self.zero().ok_or(Refusal::Early)?;
        let estimate = self.offsets.estimate(moment.clock).ok_or(Refusal::Clock)?;
        let (ours, now) = (estimate.ours(moment.at), machine::now());
        if self.wrong_clocks {
            let shown = self.passed(moment)?.max(0);
            return Ok(Time::from_nanos(shown.unsigned_abs()));
        }
        if ours.saturating_sub(now) > estimate.bound {
            return Err(Refusal::Future);
        }
        let passed = ours.min(now).saturating_sub(zero);
        let passed = u64::try_from(passed).map_err(|_| Refusal::Early)?;
        Ok(Time::from_nanos(passed))
    }

    /// Returns the run time of `moment` (ns), negative before the run.
    ///
    /// # Errors
    /// [`Refusal`] before the run, and if the clock is unknown.
    pub(crate) fn passed(&self, moment: ClockMoment) -> Result<Nanos, Refusal> {
        let zero = self.zero().ok_or(Refusal::Early)?;
        let estimate = self.offsets.estimate(moment.clock).ok_or(Refusal::Clock)?;
        Ok(estimate.ours(moment.at).saturating_sub(zero))
    }

    /// Remembers that run time `time` came from `moment`.
    pub(crate) fn remember(&self, time: Time, moment: ClockMoment) {
        self.origins.keep(time, moment);
    }

    /// Returns the moment that run time `time` came from lately, or else is.
    pub(crate) fn origin(&self, time: Time) -> Option<ClockMoment> {
        self.origins
            .find(|known, _| *known == time)
            .map(|(_, moment)| moment)
            .or_else(|| self.moment(time))
    }
}

/// Pairs that are kept: seconds at usual rates.
const KEPT: usize = 1024;

/// The newest pairs.
#[derive(Debug)]
pub(crate) struct Recent<A, B>(Mutex<VecDeque<(A, B)>>);

impl<A, B> Default for Recent<A, B> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<A: Copy, B: Copy> Recent<A, B> {
    /// Keeps a pair.
    pub(crate) fn keep(&self, a: A, b: B) {
        let mut pairs = lock(&self.0);
        pairs.push_back((a, b));
        if pairs.len() > KEPT {
            pairs.pop_front();
        }
    }

    /// Returns the newest pair that is `wanted`.
    pub(crate) fn find(&self, wanted: impl Fn(&A, &B) -> bool) -> Option<(A, B)> {
        let pairs = lock(&self.0);
        pairs.iter().rev().find(|(a, b)| wanted(a, b)).copied()
    }
}
