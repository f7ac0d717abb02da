//! The cliff map: the results of runs over the rate of a node and the seed, under the
//! conditions of the session; or over any two knobs of the focus.

mod quantity;
#[cfg(test)]
pub mod tests;

use std::sync::Arc;

use ratelab::Knob;
use ratelab_experiment::{
    Config,
    sweep::{AxisError, Cell, CellResult, Sweep, SweepAxis, SweepError, SweepValue},
};
use ratelab_metrics::Snapshot;
use ratelab_system::{Setup, System};

use quantity::{Fill, KnobQuantity};

use super::knobs::{Direction, KnobFocus, listed};

/// Number of seeds.
const SEEDS: u64 = 100;

/// The quantities of columns and rows: numbers of quantities of the focused node and
/// topic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MapAxes {
    /// Number of the quantity of the columns.
    pub x: usize,
    /// Number of the quantity of the rows; `None` for seeds.
    pub y: Option<usize>,
}

impl MapAxes {
    /// Returns the axes with the next quantity for the columns.
    pub fn other_columns(self) -> Self {
        let mut numbers = (1..=quantity::COUNT).map(|step| (self.x + step) % quantity::COUNT);
        let x = numbers.find(|number| Some(*number) != self.y);
        Self {
            x: x.unwrap_or(self.x),
            ..self
        }
    }

    /// Returns the axes with the next quantity for the rows; seeds follow the last quantity.
    pub fn other_rows(self) -> Self {
        let next = self.y.map_or(0, |y| y + 1);
        let y = (next..quantity::COUNT).find(|number| *number != self.x);
        Self { y, ..self }
    }
}

/// Runs over two quantities, as far as finished, with a cursor.
pub struct CliffMap {
    /// The common settings of the runs.
    pub sweep: Sweep,
    axes: MapAxes,
    /// The quantity of the columns.
    pub x: KnobQuantity,
    y: Option<KnobQuantity>,
    /// Values of the columns, ascending.
    pub columns: Vec<Arc<SweepValue>>,
    /// Seeds, or values.
    pub rows: Vec<MapRow>,
    /// Column by column, and row by row within a column.
    outcomes: Vec<Option<CellResult>>,
    /// Number of finished runs.
    done: usize,
    /// The cursor: number of the column and number of the row.
    pub at: (usize, usize),
    fill: Fill,
}

/// A row of the map: a seed, and a value if the rows are a quantity.
pub struct MapRow {
    value: Option<Arc<SweepValue>>,
    seed: u64,
}

impl CliffMap {
    /// Creates the map around the run of `config`, filled from there outwards: over
    /// `axes` of the nodes and topics in `focus`. `graph` is the session's graph.
    ///
    /// # Errors
    /// [`AxisError`] for an unknown knob.
    pub fn around(
        system: &Arc<dyn System>,
        graph: &Snapshot,
        focus: &KnobFocus,
        axes: MapAxes,
        config: &Config,
    ) -> Result<Self, AxisError> {
        let quantity =
            |number| KnobQuantity::number(&**system, graph, focus, &config.setup, number);
        let (x, y) = (quantity(axes.x), axes.y.map(quantity));
        let now = x.value(graph, &config.setup);
        let over_x = x.axis(&**system)?;
        let columns = over_x.values.clone();
        let over_y = y.as_ref().map(|y| y.axis(&**system)).transpose()?;
        let row = |value, seed| MapRow { value, seed };
        let (seeds, rows): (Vec<u64>, Vec<MapRow>) = match &over_y {
            Some(axis) => {
                let values = axis.values.iter().cloned();
                let rows = values.map(|value| row(Some(value), config.seed));
                (vec![config.seed], rows.collect())
            }
            None => {
                let seeds = seeds(config.seed);
                let rows = seeds.iter().map(|seed| row(None, *seed)).collect();
                (seeds, rows)
            }
        };
        let base = Config {
            end: Config::default().end,
            knobs: Vec::new(),
            ..config.clone()
        };
        let sweep = Sweep {
            axes: [nearest(over_x, now)].into_iter().chain(over_y).collect(),
            seeds,
            ..Sweep::new(system.clone(), base)
        };
        let mut map = Self {
            outcomes: vec![None; columns.len() * rows.len()],
            axes,
            x,
            y,
            columns,
            rows,
            done: 0,
            at: (0, 0),
            fill: Fill::start(sweep.clone()),
            sweep,
        };
        map.go_to(graph, config);
        Ok(map)
    }

    /// Returns whether the map has the conditions of `config`, apart from the seed's place in its
    /// hundred and the values on its axes, and is over `axes` of the nodes and topics in `focus`.
    pub fn is_of(&self, focus: &KnobFocus, axes: MapAxes, config: &Config) -> bool {
        let (mine, theirs) = (&self.sweep.base.setup, &config.setup);
        let is_of = |quantity: &KnobQuantity| quantity.is_of(&*self.sweep.system, focus);
        self.axes == axes
            && is_of(&self.x)
            && self.y.as_ref().is_none_or(is_of)
            && self.covers(mine, theirs)
            && self.covers(theirs, mine)
            && self.sweep.seeds.contains(&config.seed)
    }

    /// Moves the cursor to the run of `config`; returns whether its rate is on the map.
    pub fn go_to(&mut self, graph: &Snapshot, config: &Config) -> bool {
        let now = self.x.value(graph, &config.setup);
        let row = match &self.y {
            None => self.rows.iter().position(|row| row.seed == config.seed),
            Some(y) => {
                let values = self.rows.iter().filter_map(|row| row.value.as_ref());
                index_of(values, y.value(graph, &config.setup))
            }
        };
        let column = index_of(&self.columns, now);
        self.at = (column.unwrap_or(0), row.unwrap_or(0));
        self.x.covers(now)
    }

    /// Returns whether `setup` has all settings of `other`, apart from the axes.
    fn covers(&self, setup: &Setup, other: &Setup) -> bool {
        let same = |knob: &Knob| self.turns(knob) || setup.iter().any(|known| known == knob);
        other.iter().all(same)
    }

    /// Returns whether `knob` is the quantity of the columns or the rows.
    fn turns(&self, knob: &Knob) -> bool {
        let mut knobs = self.knobs((0, 0));
        knobs.any(|own| own.is_of(knob))
    }

    /// Describes the conditions: all settings except the axes.
    pub fn conditions(&self) -> String {
        let set = self.sweep.base.setup.iter();
        let set: Vec<Knob> = set.filter(|knob| !self.turns(knob)).cloned().collect();
        listed(&*self.sweep.system, &set)
    }

    /// Adds the runs finished since the last call; returns whether there were any.
    ///
    /// # Errors
    /// [`SweepError`] if a run failed, which ends the sweep.
    pub fn follow(&mut self) -> Result<bool, SweepError> {
        let before = self.done;
        while let Some((cell, outcome)) = self.fill.next()? {
            self.note(&cell, outcome);
        }
        Ok(self.done > before)
    }

    fn note(&mut self, cell: &Cell, outcome: CellResult) {
        let (x, y) = (cell.values.first(), cell.values.get(1));
        let column = self.columns.iter().position(|value| Some(value) == x);
        let is_it = |row: &MapRow| row.value.as_ref() == y && row.seed == cell.seed;
        let place = column.zip(self.rows.iter().position(is_it));
        let index = place.map(|(column, row)| self.index(column, row));
        if let Some(known) = index.and_then(|index| self.outcomes.get_mut(index)) {
            self.done += usize::from(known.replace(outcome).is_none());
        }
    }

    fn index(&self, column: usize, row: usize) -> usize {
        column * self.rows.len() + row
    }

    /// Returns the label of a row: a seed, or a value.
    pub fn row_label(&self, row: usize) -> String {
        let row = &self.rows[row];
        let value = row.value.as_ref().map(|value| value.text.clone());
        value.unwrap_or_else(|| row.seed.to_string())
    }

    /// Returns a name of the quantity of the rows, with its unit; `None` for seeds.
    pub fn row_heading(&self) -> Option<String> {
        self.y.as_ref().map(KnobQuantity::heading)
    }

    /// Returns the common seed of all runs, if rows are a quantity.
    pub fn only_seed(&self) -> Option<u64> {
        self.y.as_ref().map(|_| self.rows[0].seed)
    }

    /// Descriptions of the column and the row at the cursor.
    pub fn place(&self) -> (String, String) {
        let column = self.x.with_unit(&self.columns[self.at.0].text);
        let row = match &self.y {
            Some(y) => y.with_unit(&self.row_label(self.at.1)),
            None => format!("seed {}", self.row_label(self.at.1)),
        };
        (column, row)
    }

    /// Moves the cursor to the next column.
    pub fn move_rate(&mut self, direction: Direction) {
        self.at.0 = moved(self.at.0, direction, self.columns.len());
    }

    /// Moves the cursor to the next row.
    pub fn move_seed(&mut self, direction: Direction) {
        self.at.1 = moved(self.at.1, direction, self.rows.len());
    }

    /// Returns the knobs and the seed at the cursor.
    pub fn chosen(&self) -> (Vec<Knob>, u64) {
        (
            self.knobs(self.at).cloned().collect(),
            self.rows[self.at.1].seed,
        )
    }

    /// Returns the knobs of a column and a row.
    fn knobs(&self, (column, row): (usize, usize)) -> impl Iterator<Item = &Knob> {
        let x = self.columns.get(column);
        let y = self.rows.get(row).and_then(|row| row.value.as_ref());
        x.into_iter().chain(y).flat_map(|value| &value.knobs)
    }

    /// Returns the result of a run, if it is finished.
    pub fn outcome(&self, column: usize, row: usize) -> Option<&CellResult> {
        self.outcomes.get(self.index(column, row))?.as_ref()
    }

    /// Returns the finished runs in a column.
    pub fn survival(&self, column: usize) -> HeldRuns {
        let rows = 0..self.rows.len();
        let outcomes = rows.filter_map(|row| self.outcome(column, row));
        outcomes.fold(HeldRuns::default(), |runs, outcome| HeldRuns {
            held: runs.held + usize::from(!outcome.is_lost()),
            finished: runs.finished + 1,
        })
    }

    /// Returns the number of finished runs.
    pub fn done(&self) -> usize {
        self.done
    }

    /// Returns the number of all runs.
    pub fn runs(&self) -> usize {
        self.outcomes.len()
    }
}

/// Finished runs, and how many of them were held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HeldRuns {
    /// Number of runs that were not lost.
    pub held: usize,
    /// Number of finished runs.
    pub finished: usize,
}

/// Returns `axis` ordered by distance from `now`, the nearest first.
fn nearest(mut axis: SweepAxis, now: f64) -> SweepAxis {
    let distance = |value: &Arc<SweepValue>| (number(value) - now).abs();
    axis.values
        .sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    axis
}

/// Returns the index of the value nearest to `now`.
fn index_of<'a>(values: impl IntoIterator<Item = &'a Arc<SweepValue>>, now: f64) -> Option<usize> {
    let distances = values.into_iter().map(|value| (number(value) - now).abs());
    let nearest = distances
        .enumerate()
        .min_by(|(_, a), (_, b)| a.total_cmp(b));
    nearest.map(|(index, _)| index)
}

fn number(value: &SweepValue) -> f64 {
    value.text.parse().unwrap_or(f64::NAN)
}

/// Returns the seeds in the hundred of `seed`.
fn seeds(seed: u64) -> Vec<u64> {
    let first = seed - seed % SEEDS;
    (first..=first.saturating_add(SEEDS - 1)).collect()
}

fn moved(place: usize, direction: Direction, count: usize) -> usize {
    match direction {
        Direction::Up => (place + 1).min(count.saturating_sub(1)),
        Direction::Down => place.saturating_sub(1),
    }
}
