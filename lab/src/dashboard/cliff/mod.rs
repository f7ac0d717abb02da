//! The cliff map: the results of runs over the rate of a node and the seed, under the
//! conditions of the session; or over any two knobs of the focus.

mod fill;
mod quantity;

use std::sync::Arc;

use ratelab::Knob;
use ratelab_account::Snapshot;
use ratelab_study::{
    experiment::{
        Config,
        sweep::{AxisError, Cell, CellResult, Sweep, SweepAxis, SweepError, SweepValue},
    },
    system::{Setup, System},
};

use fill::Fill;
use quantity::KnobQuantity;

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
    /// The axes with the next quantity for the columns.
    pub fn other_columns(self) -> Self {
        let mut numbers = (1..=quantity::COUNT).map(|step| (self.x + step) % quantity::COUNT);
        let x = numbers.find(|number| Some(*number) != self.y);
        Self {
            x: x.unwrap_or(self.x),
            ..self
        }
    }

    /// The axes with the next quantity for the rows; seeds follow the last quantity.
    pub fn other_rows(self) -> Self {
        let next = self.y.map_or(0, |y| y + 1);
        let y = (next..quantity::COUNT).find(|number| *number != self.x);
        Self { y, ..self }
    }
}

/// Runs over two quantities, as far as finished, with a cursor.
pub struct CliffMap {
    sweep: Sweep,
    axes: MapAxes,
    x: KnobQuantity,
    y: Option<KnobQuantity>,
    /// Values of the columns, in the order shown.
    columns: Vec<Arc<SweepValue>>,
    rows: Vec<MapRow>,
    /// Column by column, and row by row within a column.
    outcomes: Vec<Option<CellResult>>,
    /// Number of finished runs.
    done: usize,
    /// The cursor: number of the column and number of the row.
    at: (usize, usize),
    fill: Fill,
}

/// A row of the map: a seed, and a value if the rows are a quantity.
struct MapRow {
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
        let (seeds, values) = match &over_y {
            Some(axis) => (vec![config.seed], axis.values.iter().map(Some).collect()),
            None => (seeds(config.seed), vec![None]),
        };
        let row = |value: Option<&Arc<SweepValue>>, seed| MapRow {
            value: value.cloned(),
            seed,
        };
        let rows = values.iter();
        let rows = rows.flat_map(|value| seeds.iter().map(|seed| row(*value, *seed)));
        let rows: Vec<MapRow> = rows.collect();
        let sweep = Sweep {
            axes: [Some(nearest(over_x, now)), over_y]
                .into_iter()
                .flatten()
                .collect(),
            seeds,
            ..Sweep::of(
                system.clone(),
                Config {
                    end: Config::default().end,
                    knobs: Vec::new(),
                    ..config.clone()
                },
            )
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

    /// Whether the map has the conditions of `config`, apart from the seed's place in its
    /// hundred and the values on its axes, and is over `axes` of the nodes and topics in
    /// `focus`.
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

    /// Whether `setup` has all settings of `other`, apart from those on the axes.
    fn covers(&self, setup: &Setup, other: &Setup) -> bool {
        let same = |knob: &Knob| self.turns(knob) || setup.iter().any(|known| known == knob);
        other.iter().all(same)
    }

    /// Whether `knob` is the quantity of the columns or the rows.
    fn turns(&self, knob: &Knob) -> bool {
        let mut knobs = self.knobs((0, 0));
        knobs.any(|own| own.is_of(knob))
    }

    /// A description of the conditions: all settings but those on the axes.
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

    /// Number of rows.
    pub fn row_count(&self) -> usize {
        self.rows.len()
    }

    /// The label of a row: a seed, or a value.
    pub fn row_label(&self, row: usize) -> String {
        let row = &self.rows[row];
        let value = row.value.as_ref().map(|value| value.text.clone());
        value.unwrap_or_else(|| row.seed.to_string())
    }

    /// A short name of the quantity of the columns, with its unit.
    pub fn heading(&self) -> String {
        self.x.heading()
    }

    /// A name of the quantity of the rows, with its unit; `None` for seeds.
    pub fn row_heading(&self) -> Option<String> {
        self.y.as_ref().map(KnobQuantity::heading)
    }

    /// The common seed of all runs, if rows are a quantity.
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
        self.at.1 = moved(self.at.1, direction, self.row_count());
    }

    /// The cursor: number of the column, number of the row.
    pub fn at(&self) -> (usize, usize) {
        self.at
    }

    /// The knobs and the seed at the cursor.
    pub fn chosen(&self) -> (Vec<Knob>, u64) {
        (
            self.knobs(self.at).cloned().collect(),
            self.rows[self.at.1].seed,
        )
    }

    /// The knobs of a column and a row.
    fn knobs(&self, (column, row): (usize, usize)) -> impl Iterator<Item = &Knob> {
        let x = self.columns.get(column);
        let y = self.rows.get(row).and_then(|row| row.value.as_ref());
        x.into_iter().chain(y).flat_map(|value| &value.knobs)
    }

    /// The values of the columns, ascending.
    pub fn columns(&self) -> &[Arc<SweepValue>] {
        &self.columns
    }

    /// The common settings of the runs.
    pub fn sweep(&self) -> &Sweep {
        &self.sweep
    }

    /// The result of a run, if it is finished.
    pub fn outcome(&self, column: usize, row: usize) -> Option<&CellResult> {
        self.outcomes.get(self.index(column, row))?.as_ref()
    }

    /// Numbers of runs held and of finished runs in a column.
    pub fn survival(&self, column: usize) -> (usize, usize) {
        let rows = 0..self.row_count();
        let outcomes = rows.filter_map(|row| self.outcome(column, row));
        outcomes.fold((0, 0), |(well, runs), outcome| {
            (well + usize::from(!outcome.verdict.is_lost()), runs + 1)
        })
    }

    /// Numbers of finished runs and of all runs.
    pub fn progress(&self) -> (usize, usize) {
        (self.done, self.outcomes.len())
    }
}

/// `axis` ordered by distance from `now`, the nearest first.
fn nearest(mut axis: SweepAxis, now: f64) -> SweepAxis {
    let distance = |value: &Arc<SweepValue>| (number(value) - now).abs();
    axis.values
        .sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    axis
}

/// Index of the value nearest to `now`.
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

/// The seeds in the hundred of `seed`.
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

#[cfg(test)]
pub mod sample {
    //! A map for tests, without its background thread.

    use std::sync::Arc;

    use ratelab::Time;
    use ratelab_cart_pole::{
        CartPole,
        verdict::{BALANCED, POLE_FELL},
    };
    use ratelab_study::{
        experiment::{Config, Experiment, sweep::CellResult},
        system::{System, Verdict},
    };

    use super::{CliffMap, Fill, KnobFocus, MapAxes};

    /// The map around a run of the cart-pole.
    pub fn around(config: &Config) -> CliffMap {
        over(MapAxes::default(), config)
    }

    /// The same map, over `axes`.
    pub fn over(axes: MapAxes, config: &Config) -> CliffMap {
        let system: Arc<dyn System> = Arc::new(CartPole::default());
        let experiment = Experiment::new(system.clone(), config).expect("experiment");
        let graph = experiment.observer().read_counters();
        let focus = KnobFocus::new(&*system, &graph);
        CliffMap::around(&system, &graph, &focus, axes, config).expect("a map")
    }

    /// All runs up to 15 Hz are finished: held from 8 Hz on, and every third at 6 and 7 Hz.
    pub fn half_filled() -> CliffMap {
        let mut map = around(&Config {
            seed: 103,
            ..CartPole::config("control-hz 7").expect("a knob")
        });
        map.fill = Fill::nobody();
        map.outcomes.fill(None);
        map.done = 0;
        for index in 0..15 * map.sweep.seeds.len() {
            let (rate, seed) = (index / map.sweep.seeds.len(), index % map.sweep.seeds.len());
            let up = rate >= 7 || rate >= 5 && seed % 3 == 0;
            map.outcomes[index] = Some(outcome(up));
            map.done += 1;
        }
        map
    }

    fn outcome(up: bool) -> CellResult {
        let fell = Time::from_nanos(3_580_000_000);
        let end = Config::default().end;
        let (kind, sim_time) = if up {
            (&BALANCED, end)
        } else {
            (&POLE_FELL, fell)
        };
        CellResult {
            push_age: None,
            cost: None,
            verdict: Verdict::new(kind, sim_time),
            steps: 180,
            sim_time,
            mean_latency_s: Some(0.0779),
            dropped: vec![12, 0],
            state: [].into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use ratelab_cart_pole::CartPole;

    use super::{sample::around, *};

    fn filled(config: &Config) -> CliffMap {
        let mut map = around(config);
        fill(&mut map);
        map
    }

    fn fill(map: &mut CliffMap) {
        while map.progress().0 < map.progress().1 {
            map.fill.wait();
            map.follow().expect("no run fails");
        }
    }

    #[test]
    fn every_cell_is_the_run_that_it_names() {
        let map = filled(&Config::default());
        let names = [("5", 0, 43), ("5", 1, 60), ("7", 2, 228), ("10", 0, 501)];
        for (hz, seed, steps) in names {
            let rate = map.columns().iter().position(|value| value.text == hz);
            let outcome = map.outcome(rate.expect("a rate of the map"), seed);
            assert_eq!(outcome.expect("made").steps, steps, "{hz} Hz, seed {seed}");
        }
        assert_eq!(map.survival(4), (0, 100));
        assert_eq!(map.survival(9), (100, 100));
    }

    #[test]
    fn it_begins_where_the_session_is() {
        let config = Config {
            seed: 250,
            ..CartPole::config("control-hz 7").expect("a knob")
        };
        let map = around(&config);
        assert_eq!(map.place(), ("7 Hz".to_owned(), "seed 250".to_owned()));
        assert_eq!(map.sweep().seeds[0], 200);
        let (focus, axes) = (focus(), MapAxes::default());
        assert!(map.is_of(&focus, axes, &config));
        assert!(!map.is_of(
            &focus,
            axes,
            &Config {
                seed: 300,
                ..config
            }
        ));
    }

    #[test]
    fn it_begins_at_the_rate_in_force_which_has_a_column() {
        for (hz, columns) in [(50.0, 31), (7.0, 30), (7.5, 31), (200.0, 31)] {
            let config = CartPole::config(&format!("control-hz {hz}")).expect("a knob");
            let map = around(&config);
            assert_eq!(map.place().0, format!("{hz} Hz"));
            assert_eq!(map.columns().len(), columns, "{hz} Hz");
            assert!(map.columns().is_sorted_by(|a, b| number(a) < number(b)));
        }
        // The digits of a rate are rows of the map.
        let long = around(&CartPole::config("control-hz 7.654321").expect("a knob"));
        assert_eq!(long.place().0, "8 Hz");
    }

    #[test]
    fn another_rate_is_on_the_same_map_and_another_depth_is_not() {
        let map = around(&Config::default());
        let axes = MapAxes::default();
        let of = |setup| map.is_of(&focus(), axes, &CartPole::config(setup).expect("knobs"));
        assert!(of("control-hz 3"));
        assert!(!of("queue-depth 3"));
    }

    fn focus() -> KnobFocus {
        KnobFocus {
            node: "policy".to_owned(),
            topics: vec!["/action".to_owned()],
        }
    }

    #[test]
    fn two_knobs_are_on_one_map_and_each_cell_is_the_run_of_both() {
        let config = Config {
            seed: 3,
            ..Config::default()
        };
        let axes = MapAxes { x: 1, y: Some(0) };
        let mut map = sample::over(axes, &config);
        assert_eq!(map.only_seed(), Some(3));
        assert_eq!(map.heading(), "/obs delay ms");
        assert_eq!(map.row_heading().as_deref(), Some("control Hz"));
        fill(&mut map);
        for (column, row) in [(0, 29), (10, 24), (25, 24), (5, 9)] {
            let mut alone = config.clone();
            map.at = (column, row);
            let (knobs, seed) = map.chosen();
            alone.setup.extend(knobs);
            assert_eq!(seed, 3);
            let system = std::sync::Arc::new(CartPole::default());
            let alone = ratelab_study::experiment::Experiment::new(system, &alone).expect("a run");
            let alone = CellResult::from(&alone.run().expect("no fault"));
            assert_eq!(map.outcome(column, row), Some(&alone));
        }
        assert!(!map.is_of(&focus(), MapAxes::default(), &config));
    }

    #[test]
    fn the_last_seeds_of_all_have_a_map_too() {
        let map = around(&Config {
            seed: u64::MAX,
            ..Config::default()
        });
        assert_eq!(map.chosen().1, u64::MAX);
    }

    #[test]
    fn the_edges_are_not_passed() {
        let mut map = sample::half_filled();
        for _ in 0..200 {
            map.move_rate(Direction::Up);
            map.move_seed(Direction::Down);
        }
        assert_eq!(map.at(), (map.columns().len() - 1, 0));
    }
}
