//! What linear theory says of each pair of rates.

use ratelab::{
    experiment::sweep::{Cell, Sweep},
    policy::PolicyKind,
    runtime::Hz,
    stability::{Rates, Stability, StabilityError},
};

use crate::error::Error;

/// The growth of a small deviation (1/s) by sensor and control rate; `None`
/// where it takes too long until the schedule repeats.
pub struct Theory(Vec<(Rates, Option<f64>)>);

impl Theory {
    /// That of all rates of `sweep`, or of none if it is not wanted.
    pub fn of(sweep: &Sweep, wanted: bool) -> Result<Self, Error> {
        let pairs = sweep.sensor_hz.iter().filter(|_| wanted);
        let pairs = pairs.flat_map(|sensor| sweep.control_hz.iter().map(move |c| (*sensor, *c)));
        let growth = pairs.map(|(sensor, control)| entry(sensor, control));
        growth.collect::<Result<_, _>>().map(Self)
    }

    /// That of the rates of `cell`, if its policy is the one that the theory is
    /// about.
    pub fn growth(&self, cell: &Cell) -> Option<f64> {
        let rates = Rates {
            sensor: cell.sensor_hz,
            control: cell.control_hz,
        };
        let known = self.0.iter().find(|(known, _)| *known == rates);
        known
            .filter(|_| cell.policy == PolicyKind::Scripted.into())
            .and_then(|(_, growth)| *growth)
    }
}

fn entry(sensor: Hz, control: Hz) -> Result<(Rates, Option<f64>), Error> {
    let rates = Rates { sensor, control };
    match Stability::of(rates) {
        Ok(stability) => Ok((rates, Some(stability.growth()))),
        Err(StabilityError::Aperiodic { .. }) => Ok((rates, None)),
        Err(error) => Err(Error::Theory(error)),
    }
}
