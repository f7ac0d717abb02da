//! Many runs as a value: which knobs and seeds; on all cores.
//!
//! ```
//! use std::{ops::ControlFlow, sync::Arc};
//! use ratelab::cartpole::CartPole;
//! use ratelab::experiment::{Config, sweep::{Axis, Sweep, SweepAxis, all_cores}};
//!
//! let sweep = Sweep {
//!     axes: vec![SweepAxis::parse(CartPole::KNOBS, "control-hz", "5,10")?],
//!     seeds: "0..2".parse::<Axis<u64>>()?.into(),
//!     ..Sweep::of(Arc::new(CartPole::default()), Config::default())
//! };
//! let swept = sweep.run(all_cores(), |_cell, _result| ControlFlow::Continue(()))?;
//! let held: Vec<usize> = swept.survival().map(|rate| rate.held).collect();
//! assert_eq!(held, [0, 3]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod axis;
mod knobs;
mod result;
mod work;

use std::sync::Arc;

use thiserror::Error;

pub use axis::{Axis, AxisError, Decimal, Quantity};
pub use knobs::{SweepAxis, SweepValue};
pub use result::{CellResult, Survival, Swept};
pub use work::all_cores;

use super::{Config, Experiment};
use crate::{
    runtime::{ClockKind, Fault, KnobKind, Speed, Time},
    system::{BuildError, System},
};

/// The most cells that a sweep may have: about twenty minutes of two cores with
/// runs of ten seconds.
pub const MAX_CELLS: usize = 2_000_000;

/// Runs to make: every combination of the values listed. Each is a cell. See the
/// [module](self) for one that is run.
#[derive(Clone)]
pub struct Sweep {
    /// The system to run.
    pub system: Arc<dyn System>,
    /// Everything that no list says. Its clock does not count: a sweep runs on the
    /// virtual clock, without pacing.
    pub base: Config,
    /// Knobs, the slowest to change first.
    pub axes: Vec<SweepAxis>,
    /// Starts, which change fastest.
    pub seeds: Vec<u64>,
}

/// One run of a sweep by what sets it apart from the others.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    /// A value for each axis.
    pub values: Vec<Arc<SweepValue>>,
    /// The start.
    pub seed: u64,
}

impl Cell {
    /// The value on the axis called `axis`, as text.
    pub fn value(&self, axis: &str) -> Option<&str> {
        let value = self.values.iter().find(|value| value.axis == axis);
        value.map(|value| value.text.as_str())
    }
}

impl std::fmt::Display for Cell {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for value in &self.values {
            write!(f, "{} {}, ", value.axis, value.text)?;
        }
        write!(f, "seed {}", self.seed)
    }
}

/// A sweep that cannot be run.
#[derive(Debug, Error)]
pub enum SweepError {
    /// One of the lists has no value.
    #[error("a sweep without {0} has no runs: list at least one")]
    Empty(String),
    /// There are too many combinations.
    #[error("{0} runs are too many for a sweep: list fewer values, {MAX_CELLS} runs at most")]
    TooMany(u128),
    /// Its runs would never end.
    #[error("the runs of a sweep must end: give them a duration")]
    Endless,
    /// A message is set that the system does not take.
    #[error(transparent)]
    Setting(#[from] BuildError),
    /// A cell could not be set up.
    #[error("{cell}: {source}")]
    Build {
        /// Which.
        cell: Box<Cell>,
        /// Why.
        source: BuildError,
    },
    /// A node of a cell failed.
    #[error("{cell}: {source}")]
    Fault {
        /// Which.
        cell: Box<Cell>,
        /// Why.
        source: Fault,
    },
}

impl Sweep {
    /// The one run that `base` is, for lists to be added.
    pub fn of(system: Arc<dyn System>, base: Config) -> Self {
        Self {
            system,
            axes: Vec::new(),
            seeds: vec![base.seed],
            base,
        }
    }

    /// The axis called `name`.
    pub fn axis(&self, name: &str) -> Option<&SweepAxis> {
        self.axes.iter().find(|axis| axis.name == name)
    }

    /// How many runs it is.
    ///
    /// # Errors
    /// [`SweepError`] if it is none, more than [`MAX_CELLS`], or without end.
    pub fn cells(&self) -> Result<usize, SweepError> {
        let axes = self.axes.iter();
        let axes = axes.map(|axis| (axis.name.as_str(), axis.values.len()));
        let lists: Vec<_> = axes.chain([("seeds", self.seeds.len())]).collect();
        if let Some((name, _)) = lists.iter().find(|(_, values)| *values == 0) {
            return Err(SweepError::Empty((*name).to_owned()));
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

    /// Cell number `index`, counted from zero. The seed changes fastest, then the
    /// last axis, the first one slowest.
    pub fn cell(&self, index: usize) -> Option<Cell> {
        let mut rest = index;
        let seed = *turn(&self.seeds, &mut rest)?;
        let values = self.axes.iter().rev();
        let values = values.map(|axis| turn(&axis.values, &mut rest).cloned());
        let mut values = values.collect::<Option<Vec<_>>>()?;
        values.reverse();
        (rest == 0).then_some(Cell { values, seed })
    }

    /// The run that `cell` is.
    pub fn config(&self, cell: &Cell) -> Config {
        let mut config = Config {
            seed: cell.seed,
            clock: ClockKind::Virtual,
            speed: Speed::Unlimited,
            ..self.base.clone()
        };
        let knobs = cell.values.iter().flat_map(|value| &value.knobs);
        config.setup.extend(knobs.cloned());
        config
    }

    /// The same sweep, its messages in the form in which they are recorded; see
    /// [`System::resolve`]. What they name is read once, before the first run.
    fn resolved(&self) -> Result<Self, BuildError> {
        let mut resolved = self.clone();
        let Some(first) = self.cell(0) else {
            return Ok(resolved);
        };
        // What an axis sets in its place is not read.
        resolved.base = self.config(&first).resolved(&*self.system)?;
        let axes = resolved.axes.iter_mut();
        let messages = axes.filter(|axis| axis.kind == KnobKind::Send);
        for value in messages.flat_map(|axis| &mut axis.values) {
            let mut config = resolved.base.clone();
            config.setup.extend(value.knobs.iter().cloned());
            let setup = config.resolved(&*self.system)?.setup;
            let knobs = setup.iter();
            let knobs = knobs.filter(|knob| value.knobs.iter().any(|of| of.is_of(knob)));
            Arc::make_mut(value).knobs = knobs.cloned().collect();
        }
        Ok(resolved)
    }

    /// Runs one cell.
    fn execute(&self, cell: &Cell) -> Result<CellResult, SweepError> {
        let which = || Box::new(cell.clone());
        let experiment = Experiment::of_resolved(self.system.clone(), self.config(cell));
        let experiment = experiment.map_err(|source| SweepError::Build {
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
fn turn<'l, T>(list: &'l [T], rest: &mut usize) -> Option<&'l T> {
    let digit = rest.checked_rem(list.len())?;
    *rest /= list.len();
    list.get(digit)
}
