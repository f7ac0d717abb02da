//! Stamps of ROS: times of the system clock, which may be set at any moment.
//!
//! A stamp that we gave out comes back in the header of an action. So it is looked up and
//! not computed: the age of the reading stays exact, whatever the system clock does.

use std::{
    collections::VecDeque,
    sync::{Mutex, PoisonError},
    time::{SystemTime, UNIX_EPOCH},
};

use ratelab::Time;

use super::cdr::Stamp;
use crate::{clock, packet::ClockMoment};

/// Stamps that are kept: seconds at usual rates.
const KEPT: usize = 1024;

/// The newest stamps that were given out.
#[derive(Debug, Default)]
pub(super) struct RosStamps(Mutex<VecDeque<(Stamp, Time)>>);

impl RosStamps {
    /// The stamp of run time `sensed`, which is `moment` of our clock.
    pub(super) fn stamp(&self, sensed: Time, moment: ClockMoment) -> Stamp {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((stamp, _)) = known.iter().rev().find(|(_, time)| *time == sensed) {
            return *stamp;
        }
        let ago = clock::now().saturating_sub(moment.at);
        let stamp = Stamp::from_nanos(system_now().saturating_sub(ago));
        known.push_back((stamp, sensed));
        if known.len() > KEPT {
            known.pop_front();
        }
        stamp
    }

    /// The run time of a stamp that was given out lately.
    pub(super) fn sensed(&self, stamp: Stamp) -> Option<Time> {
        let known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let found = known.iter().rev().find(|(known, _)| *known == stamp);
        found.map(|(_, time)| *time)
    }
}

/// The system clock (ns since 1970).
pub(super) fn system_now() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    let nanos = since.unwrap_or_default().as_nanos();
    i64::try_from(nanos).unwrap_or(i64::MAX)
}
