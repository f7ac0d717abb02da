//! Where times of this run came from, so that they go on as exactly as they came.
//!
//! An action rests on a reading that another machine sensed. Its time is converted to run
//! time here, and would be converted back there, with the error of two estimates. So the
//! original moment is kept, and sent back as it was: the plant measures the age of its own
//! readings by its own clock alone.

use std::{
    collections::VecDeque,
    sync::{Mutex, PoisonError},
};

use ratelab::Time;

use crate::packet::ClockMoment;

/// Moments that are kept: seconds at usual rates.
const KEPT: usize = 512;

/// The original moments of the newest times from the wire.
#[derive(Debug, Default)]
pub struct Origins(Mutex<VecDeque<(Time, ClockMoment)>>);

impl Origins {
    /// Remembers that run time `time` stands for `moment`.
    pub fn remember(&self, time: Time, moment: ClockMoment) {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        known.push_back((time, moment));
        if known.len() > KEPT {
            known.pop_front();
        }
    }

    /// The original moment of run time `time`, if it came from the wire lately.
    pub fn original(&self, time: Time) -> Option<ClockMoment> {
        let known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let found = known.iter().rev().find(|(at, _)| *at == time);
        found.map(|(_, moment)| *moment)
    }
}
