//! Many runs as a value: combinations of knobs and seeds, run on all cores.
//!
//! ```
//! use std::{ops::ControlFlow, sync::Arc};
//! use ratelab_experiment::{Config, sweep::{Axis, Sweep, SweepAxis, all_cores}};
//! use ratelab_system::{graph_file::GraphFile, KnobText};
//!
//! let robot = r#"
//!     name = "robot"
//!     node.camera = { rate = 30, publishes = ["/image"] }
//!     node.control = { rate = 30, reads = ["/image"], publishes = ["/cmd"] }
//!     chain.see = { path = ["camera", "/image", "control", "/cmd"], age_ms = 150 }
//! "#;
//! let system = Arc::new(GraphFile::parse(robot)?.system(&[])?);
//! let sweep = Sweep {
//!     axes: vec![SweepAxis::parse(KnobText::default(), "rate control", "5,10")?],
//!     seeds: "0..2".parse::<Axis<u64>>()?.into(),
//!     ..Sweep::new(system, Config::default())
//! };
//! let swept = sweep.run(all_cores(), |_cell, _result| ControlFlow::Continue(()))?;
//! let held: Vec<usize> = swept.survival().map(|rate| rate.held).collect();
//! assert_eq!(held, [0, 3]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod axis;
mod result;

use std::{num::NonZeroUsize, ops::ControlFlow, sync::Arc};

use ratelab::{ClockKind, Fault, Interrupt, Knob, KnobKind, Speed, Time};
use thiserror::Error;

pub use axis::{Axis, AxisError, Decimal, Quantity, SweepAxis, SweepValue};
pub use result::{AgeBin, AgeSplit, ByAge, CellResult, Survival, Swept};

pub use super::parallel::all_cores;
use super::{Config, Experiment, parallel::in_parallel};
use ratelab_system::{BuildError, System};

/// The maximum number of cells of a sweep: about twenty minutes on two cores with runs of
/// ten seconds.
pub const MAX_CELLS: usize = 2_000_000;

/// A set of runs: every combination of the listed values is a cell. See the
/// [module](self) for an example.
#[derive(Clone)]
pub struct Sweep {
    /// The system.
    pub system: Arc<dyn System>,
    /// All settings without a list. Its clock is ignored: a sweep runs on the virtual
    /// clock, without pacing.
    pub base: Config,
    /// The knobs, with the slowest to change first.
    pub axes: Vec<SweepAxis>,
    /// The seeds, which change fastest.
    pub seeds: Vec<u64>,
    /// Whether the results have the ages of the runs with their parts.
    pub parts: bool,
}

/// The values that identify one run of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    /// A value for each axis.
    pub values: Vec<Arc<SweepValue>>,
    /// Seed of the run.
    pub seed: u64,
}

impl Cell {
    /// Returns the value on the axis called `axis`, as text.
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

/// An error of a sweep.
#[derive(Debug, Error)]
pub enum SweepError {
    /// A list without values.
    #[error("a sweep without {0} has no runs: list at least one")]
    Empty(String),
    /// Too many combinations.
    #[error("{0} runs are too many for a sweep: list fewer values, {MAX_CELLS} runs at most")]
    TooMany(u128),
    /// The runs have no end.
    #[error("the runs of a sweep must end: give them a duration")]
    Endless,
    /// The system refuses a message.
    #[error(transparent)]
    Setting(#[from] BuildError),
    /// Building a cell failed.
    #[error("{cell}: {source}")]
    Build {
        /// The cell.
        cell: Box<Cell>,
        /// The error.
        source: BuildError,
    },
    /// A node of a cell failed.
    #[error("{cell}: {source}")]
    Fault {
        /// The cell.
        cell: Box<Cell>,
        /// The error.
        source: Fault,
    },
}

impl Sweep {
    /// Creates a sweep with the single run `base`, to which lists can be added.
    pub fn new(system: Arc<dyn System>, base: Config) -> Self {
        Self {
            system,
            axes: Vec::new(),
            seeds: vec![base.seed],
            parts: false,
            base,
        }
    }

    /// Returns the axis called `name`.
    pub fn axis(&self, name: &str) -> Option<&SweepAxis> {
        self.axes.iter().find(|axis| axis.name == name)
    }

    /// Returns the number of runs.
    ///
    /// # Errors
    /// [`SweepError`] if it is zero or above [`MAX_CELLS`], or if the runs have no end.
    pub fn cells(&self) -> Result<usize, SweepError> {
        let axes = self
            .axes
            .iter()
            .map(|axis| (axis.name.as_str(), axis.values.len()));
        let lists: Vec<_> = axes.chain([("seeds", self.seeds.len())]).collect();
        if let Some((name, _)) = lists.iter().find(|(_, values)| *values == 0) {
            return Err(SweepError::Empty((*name).to_owned()));
        }
        if self.base.end == Time::MAX {
            return Err(SweepError::Endless);
        }
        let counts = lists.iter().map(|(_, values)| *values as u128);
        let cells = counts.fold(1, u128::saturating_mul);
        usize::try_from(cells)
            .ok()
            .filter(|cells| *cells <= MAX_CELLS)
            .ok_or(SweepError::TooMany(cells))
    }

    /// Cell number `index`, counted from zero. The seed changes fastest, then the
    /// last axis, the first one slowest.
    pub fn cell(&self, index: usize) -> Option<Cell> {
        let mut rest = index;
        let seed = *turn(&self.seeds, &mut rest)?;
        let values = self
            .axes
            .iter()
            .rev()
            .map(|axis| turn(&axis.values, &mut rest).cloned());
        let mut values = values.collect::<Option<Vec<_>>>()?;
        values.reverse();
        (rest == 0).then_some(Cell { values, seed })
    }

    /// Configuration of the run of `cell`.
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

    /// This sweep with its messages in recordable form; see
    /// [`SystemKnobs::resolve`](ratelab_system::SystemKnobs::resolve). Files named by messages are
    /// read once, before the first run.
    fn resolved(&self) -> Result<Self, BuildError> {
        let mut resolved = self.clone();
        resolved.add_followers();
        let Some(first) = self.cell(0) else {
            return Ok(resolved);
        };
        // A message that an axis replaces is never resolved.
        resolved.base = self.config(&first).resolved(&*self.system)?;
        let messages = resolved
            .axes
            .iter_mut()
            .filter(|axis| axis.kind == KnobKind::Send);
        for value in messages.flat_map(|axis| &mut axis.values) {
            let mut config = resolved.base.clone();
            config.setup.extend(value.knobs.iter().cloned());
            let setup = config.resolved(&*self.system)?.setup;
            let knobs = setup
                .iter()
                .filter(|knob| value.knobs.iter().any(|of| of.is_of(knob)));
            Arc::make_mut(value).knobs = knobs.cloned().collect();
        }
        Ok(resolved)
    }

    /// Adds to each value what follows from it for other nodes, unless that is set by itself.
    fn add_followers(&mut self) {
        let about = self.system.about();
        let axes = self.axes.iter().flat_map(|axis| &axis.values);
        let own: Vec<Knob> = axes
            .flat_map(|value| &value.knobs)
            .chain(self.base.setup.iter())
            .cloned()
            .collect();
        for value in self.axes.iter_mut().flat_map(|axis| &mut axis.values) {
            let followers: Vec<Knob> = value
                .knobs
                .iter()
                .flat_map(|knob| about.followers(knob))
                .filter(|follower| !own.iter().any(|knob| knob.is_of(follower)))
                .collect();
            if !followers.is_empty() {
                Arc::make_mut(value).knobs.extend(followers);
            }
        }
    }

    /// Runs all cells on `threads` threads; the results are independent of their number.
    /// Calls `finished` on the calling thread for each cell, roughly in order. If it
    /// breaks, no further cell begins, and the finished ones are kept.
    ///
    /// # Errors
    /// [`SweepError`] if the sweep is empty or too large, or if a cell failed.
    pub fn run(
        &self,
        threads: NonZeroUsize,
        finished: impl FnMut(&Cell, &CellResult) -> ControlFlow<()>,
    ) -> Result<Swept, SweepError> {
        self.run_until(&Interrupt::default(), threads, finished)
    }

    /// Runs all cells until `interrupt` is asked for, which stops the runs that go on as well.
    ///
    /// # Errors
    /// [`SweepError`] if the sweep is empty or too large, or if a cell failed.
    pub fn run_until(
        &self,
        interrupt: &Interrupt,
        threads: NonZeroUsize,
        mut finished: impl FnMut(&Cell, &CellResult) -> ControlFlow<()>,
    ) -> Result<Swept, SweepError> {
        let (cells, sweep) = (self.cells()?, self.resolved()?);
        let (mut outcomes, mut is_over) = (vec![None; cells], false);
        let mut failed: Option<(usize, SweepError)> = None;
        let run = |index| {
            let cell = sweep.cell(index).filter(|_| !interrupt.is_asked())?;
            let outcome = sweep.execute(&cell, interrupt).transpose()?;
            Some((cell, outcome))
        };
        in_parallel(threads, cells, run, |index, (cell, outcome)| {
            is_over |= interrupt.is_asked();
            match outcome {
                Ok(outcome) => {
                    is_over = is_over || finished(&cell, &outcome).is_break();
                    outcomes[index] = Some(outcome);
                }
                // The error of the first cell, whichever thread was quicker.
                Err(error) => {
                    if failed.as_ref().is_none_or(|(first, _)| index < *first) {
                        failed = Some((index, error));
                    }
                    is_over = true;
                }
            }
            if is_over {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
        failed.map_or(Ok(Swept { sweep, outcomes }), |(_, error)| Err(error))
    }

    /// Runs one cell; `None` if `interrupt` stopped it.
    fn execute(
        &self,
        cell: &Cell,
        interrupt: &Interrupt,
    ) -> Result<Option<CellResult>, SweepError> {
        let which = || Box::new(cell.clone());
        let mut experiment = Experiment::from_resolved(self.system.clone(), self.config(cell))
            .map_err(|source| SweepError::Build {
                cell: which(),
                source,
            })?;
        if self.parts {
            experiment.watch_ages();
        }
        let summary = experiment
            .run_until(interrupt)
            .map_err(|source| SweepError::Fault {
                cell: which(),
                source,
            })?;
        Ok(summary.map(|summary| CellResult::new(&*self.system, &summary)))
    }
}

/// Returns the value of `list` that `rest` selects, and leaves in `rest` the selection in
/// slower lists, like reading a digit of a number.
fn turn<'l, T>(list: &'l [T], rest: &mut usize) -> Option<&'l T> {
    let digit = rest.checked_rem(list.len())?;
    *rest /= list.len();
    list.get(digit)
}

#[cfg(test)]
mod tests {
    use ratelab_system::{KnobText, graph_file::GraphFile};

    use super::*;

    /// A camera, and a planner with a fourth of its rate.
    const ROBOT: &str = "
        name = 'robot'
        node.camera = { rate = 40, publishes = ['/image'] }
        node.planner = { rate = 'camera / 4', reads = ['/image'], publishes = ['/plan'] }
    ";

    fn sweep(lists: &[(&str, &str)]) -> Sweep {
        let file = GraphFile::parse(ROBOT).expect("a graph");
        let system = Arc::new(file.system(&[]).expect("a system"));
        let axis = |(name, list): &(&str, &str)| {
            SweepAxis::parse(KnobText::default(), name, list).expect(list)
        };
        Sweep {
            axes: lists.iter().map(axis).collect(),
            ..Sweep::new(system, Config::default())
        }
    }

    #[test]
    fn the_grid_has_every_combination_with_the_seed_fastest() {
        let sweep = Sweep {
            seeds: vec![7, 9],
            ..sweep(&[("rate camera", "10,20"), ("depth /image", "1..3")])
        };
        let count = sweep.cells().expect("a grid");
        let cells: Vec<String> = (0..count)
            .map(|index| sweep.cell(index).expect("a cell").to_string())
            .collect();
        assert_eq!(cells.len(), 2 * 3 * 2);
        assert_eq!(cells[0], "rate camera 10, depth /image 1, seed 7");
        assert_eq!(cells[1], "rate camera 10, depth /image 1, seed 9");
        assert_eq!(cells[2], "rate camera 10, depth /image 2, seed 7");
        assert_eq!(cells[6], "rate camera 20, depth /image 1, seed 7");
        assert_eq!(sweep.cell(count), None);
    }

    #[test]
    fn a_grid_without_values_of_too_many_or_without_an_end_is_refused() {
        let many: Vec<u64> = (0..2_000).collect();
        let with_seeds = |seeds: Vec<u64>| Sweep {
            seeds,
            ..sweep(&[("depth /image", "1..1000")])
        };
        for (sweep, expected) in [
            (with_seeds(Vec::new()), "a sweep without seeds has no runs"),
            (
                with_seeds((0..2_001).collect()),
                "2001000 runs are too many",
            ),
            (
                Sweep {
                    base: Config {
                        end: Time::MAX,
                        ..Config::default()
                    },
                    ..sweep(&[])
                },
                "the runs of a sweep must end",
            ),
        ] {
            let error = sweep.cells().expect_err(expected).to_string();
            assert!(error.contains(expected), "{error}");
        }
        assert_eq!(with_seeds(many).cells().ok(), Some(MAX_CELLS));
    }

    #[test]
    fn a_divided_rate_follows_the_swept_one_unless_it_is_set_by_itself() {
        for (lists, setup, planner) in [
            (&[("rate camera", "20,60")][..], "", [5.0, 15.0]),
            (&[("rate camera", "20,60")], "rate planner 3", [3.0, 3.0]),
            (
                &[("rate camera", "20"), ("rate planner", "2,8")],
                "",
                [2.0, 8.0],
            ),
            (&[("depth /image", "1,2")], "", [10.0, 10.0]),
        ] {
            let mut sweep = sweep(lists);
            let knobs = setup
                .split_terminator(';')
                .map(|knob| knob.parse().expect(knob));
            sweep.base.setup.extend(knobs);
            let sweep = sweep.resolved().expect("a sweep");
            let found = [0, 1].map(|index| {
                let config = sweep.config(&sweep.cell(index).expect("a cell"));
                config.setup.rate("planner").map(|hz| hz.get())
            });
            assert_eq!(found, planner.map(Some), "{lists:?} {setup}");
        }
    }

    #[test]
    fn a_cell_runs_on_the_virtual_clock_with_its_seed_and_its_values() {
        let mut sweep = sweep(&[("rate camera", "10")]);
        (sweep.base.clock, sweep.seeds) = (ClockKind::Real, vec![5]);
        let config = sweep.config(&sweep.cell(0).expect("a cell"));
        assert_eq!((config.clock, config.seed), (ClockKind::Virtual, 5));
        assert_eq!(config.setup.rate("camera").map(|hz| hz.get()), Some(10.0));
    }
}
