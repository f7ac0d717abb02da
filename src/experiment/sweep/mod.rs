//! Many runs as a value: which rates, depths and seeds; on all cores.
//!
//! ```
//! use std::ops::ControlFlow;
//! use ratelab::experiment::{Config, sweep::{Axis, Sweep, all_cores}};
//! use ratelab::runtime::Hz;
//!
//! let sweep = Sweep {
//!     control_hz: "5,10".parse::<Axis<Hz>>()?.into(),
//!     seeds: "0..2".parse::<Axis<u64>>()?.into(),
//!     ..Sweep::of(Config::default())
//! };
//! let swept = sweep.run(all_cores(), |_cell, _outcome| ControlFlow::Continue(()))?;
//! let balanced: Vec<usize> = swept.survival().map(|rate| rate.balanced).collect();
//! assert_eq!(balanced, [0, 3]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod axis;
mod result;
mod work;

use std::time::Duration;

use thiserror::Error;

pub use axis::{Axis, AxisError, Quantity};
pub use result::{CellResult, Survival, Swept};
pub use work::all_cores;

use super::{Config, Experiment, SetupError};
use crate::{
    policy::{PolicyCache, PolicyError, PolicySpec},
    runtime::{ClockKind, Depth, Fault, Hz, Speed, Time},
};

/// The most cells that a sweep may have: about twenty minutes of two cores with
/// runs of ten seconds, and 150 MB.
pub const MAX_CELLS: usize = 2_000_000;

/// Runs to make: every combination of the values listed. Each is a cell. See the
/// [module](self) for one that is run.
#[derive(Clone, Debug, PartialEq)]
pub struct Sweep {
    /// Everything that no list says. Its clock and thinking time do not count:
    /// a sweep runs on the virtual clock, flat out.
    pub base: Config,
    /// Policies.
    pub policies: Vec<PolicySpec>,
    /// How often the sensor publishes.
    pub sensor_hz: Vec<Hz>,
    /// How many messages `/obs` and `/action` keep.
    pub queue_depths: Vec<Depth>,
    /// How often the policy decides.
    pub control_hz: Vec<Hz>,
    /// Starts.
    pub seeds: Vec<u64>,
}

/// One run of a sweep by what sets it apart from the others.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cell {
    /// The policy.
    pub policy: PolicySpec,
    /// How often the sensor publishes.
    pub sensor_hz: Hz,
    /// How many messages `/obs` and `/action` keep.
    pub queue_depth: Depth,
    /// How often the policy decides.
    pub control_hz: Hz,
    /// The start.
    pub seed: u64,
}

/// A sweep that cannot be run.
#[derive(Debug, Error)]
pub enum SweepError {
    /// One of the lists has no value.
    #[error("a sweep without {0} has no runs: list at least one")]
    Empty(&'static str),
    /// There are too many combinations.
    #[error("{0} runs are too many for a sweep: list fewer values, {MAX_CELLS} runs at most")]
    TooMany(u128),
    /// Its runs would never end.
    #[error("the runs of a sweep must end: give them a duration")]
    Endless,
    /// A policy cannot be had.
    #[error(transparent)]
    Policy(#[from] PolicyError),
    /// A cell could not be set up.
    #[error("{}: {source}", describe(cell))]
    Setup {
        /// Which.
        cell: Box<Cell>,
        /// Why.
        source: SetupError,
    },
    /// A node of a cell failed.
    #[error("{}: {source}", describe(cell))]
    Fault {
        /// Which.
        cell: Box<Cell>,
        /// Why.
        source: Fault,
    },
}

fn describe(cell: &Cell) -> String {
    let Cell {
        policy,
        sensor_hz,
        queue_depth,
        control_hz,
        seed,
    } = cell;
    format!("{policy}, sensor {sensor_hz}, control {control_hz}, depth {queue_depth}, seed {seed}")
}

impl Sweep {
    /// The one run that `base` is, for its lists to be replaced.
    pub fn of(base: Config) -> Self {
        Self {
            policies: vec![base.policy.clone()],
            sensor_hz: vec![base.sensor_hz],
            queue_depths: vec![base.queue_depth],
            control_hz: vec![base.control_hz],
            seeds: vec![base.seed],
            base,
        }
    }

    /// How many runs it is.
    ///
    /// # Errors
    /// [`SweepError`] if it is none, more than [`MAX_CELLS`], or without end.
    pub fn cells(&self) -> Result<usize, SweepError> {
        let lists = [
            ("policies", self.policies.len()),
            ("sensor rates", self.sensor_hz.len()),
            ("queue depths", self.queue_depths.len()),
            ("control rates", self.control_hz.len()),
            ("seeds", self.seeds.len()),
        ];
        if let Some((name, _)) = lists.iter().find(|(_, values)| *values == 0) {
            return Err(SweepError::Empty(name));
        }
        if self.base.end == Time::MAX {
            return Err(SweepError::Endless);
        }
        let counts = lists.iter().map(|(_, values)| *values as u128);
        let cells = counts.fold(1, u128::saturating_mul);
        let few = usize::try_from(cells).ok();
        few.filter(|cells| *cells <= MAX_CELLS)
            .ok_or(SweepError::TooMany(cells))
    }

    /// Cell number `index`, counted from zero. The seed changes fastest, then
    /// the control rate, the depth, the sensor's rate and the policy.
    pub fn cell(&self, index: usize) -> Option<Cell> {
        let mut rest = index;
        let cell = Cell {
            seed: turn(&self.seeds, &mut rest)?,
            control_hz: turn(&self.control_hz, &mut rest)?,
            queue_depth: turn(&self.queue_depths, &mut rest)?,
            sensor_hz: turn(&self.sensor_hz, &mut rest)?,
            policy: turn(&self.policies, &mut rest)?,
        };
        (rest == 0).then_some(cell)
    }

    /// Every policy that its runs need.
    pub(super) fn needed_policies(&self) -> impl Iterator<Item = &PolicySpec> {
        self.policies.iter().chain(self.base.knob_policies())
    }

    /// The run that `cell` is.
    pub fn config(&self, cell: &Cell) -> Config {
        Config {
            seed: cell.seed,
            clock: ClockKind::Virtual,
            speed: Speed::Unlimited,
            sensor_hz: cell.sensor_hz,
            control_hz: cell.control_hz,
            queue_depth: cell.queue_depth,
            policy: cell.policy.clone(),
            think: Duration::ZERO,
            ..self.base.clone()
        }
    }

    /// Runs one cell.
    fn execute(&self, cell: &Cell, cache: &PolicyCache) -> Result<CellResult, SweepError> {
        let which = || Box::new(cell.clone());
        let experiment = Experiment::with_cache(&self.config(cell), cache.clone());
        let experiment = experiment.map_err(|source| SweepError::Setup {
            cell: which(),
            source,
        })?;
        let summary = experiment.run();
        let summary = summary.map_err(|source| SweepError::Fault {
            cell: which(),
            source,
        })?;
        Ok(CellResult::from(&summary))
    }
}

/// The value of `list` that `rest` selects, and in `rest` what is left to
/// select from slower lists; like reading a digit of a number.
fn turn<T: Clone>(list: &[T], rest: &mut usize) -> Option<T> {
    let digit = rest.checked_rem(list.len())?;
    *rest /= list.len();
    list.get(digit).cloned()
}
