//! The cliff map: which rates of a node and which starts go well, under the
//! conditions of the session.

mod fill;

use std::sync::Arc;

use ratelab::{
    experiment::{
        Config,
        sweep::{AxisError, Cell, CellResult, Sweep, SweepAxis, SweepError, SweepValue},
    },
    runtime::{Hz, Knob, KnobKind, Snapshot},
    system::{KnobText, Setup, System},
};

use super::{presets::Direction, settings::listed};
use crate::names::{first_alias, paced_node};
use fill::Fill;

/// How many rates the map has.
const RATES: u32 = 30;

/// The rates of the map are as many of these parts of the usual rate as there are
/// rates: 1 Hz to 30 Hz where that is 50 Hz.
const PARTS: f64 = 50.0;

/// How many starts it has.
const SEEDS: u64 = 100;

/// Runs over rates and seeds, as far as they are made, and a place among them.
pub struct CliffMap {
    sweep: Sweep,
    /// In the order in which they are shown.
    rates: Vec<Arc<SweepValue>>,
    /// Rate after rate, seed after seed.
    outcomes: Vec<Option<CellResult>>,
    /// Runs that are made.
    done: usize,
    /// Number of the rate and number of the seed.
    at: (usize, usize),
    fill: Fill,
}

impl CliffMap {
    /// The map around what `config` describes, to be filled from there outwards:
    /// over the first alias of a rate, or else over the rate of `node`. `graph` is
    /// that of the session.
    ///
    /// # Errors
    /// [`AxisError`] if there is no such rate.
    pub fn around(
        system: &Arc<dyn System>,
        graph: &Snapshot,
        node: &str,
        config: &Config,
    ) -> Result<Self, AxisError> {
        let alias = first_alias(&**system, KnobKind::Rate);
        let node = paced_node(&**system).unwrap_or(node);
        let name = axis_name(&**system, node);
        let runs = graph.node(node).map_or(PARTS, |node| node.hz.get());
        let usual = alias.and_then(|alias| alias.default.parse().ok());
        let part = usual.unwrap_or(runs) / PARTS;
        let rates = (1..=RATES).filter_map(|number| Hz::new(part * f64::from(number)).ok());
        let texts = rates.map(|hz| hz.get().to_string());
        let axis = SweepAxis::of(KnobText(system.aliases()), &name, texts)?;
        let now = config.setup.rate(node);
        Ok(Self::over(system, axis, now.map_or(runs, Hz::get), config))
    }

    /// The map over `axis`, filled from the rate `now` (Hz) outwards.
    fn over(system: &Arc<dyn System>, axis: SweepAxis, now: f64, config: &Config) -> Self {
        let rates = axis.values.clone();
        let distance = |value: &Arc<SweepValue>| (hz(value) - now).abs();
        let mut nearest = axis;
        nearest
            .values
            .sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        let rate = rates
            .iter()
            .position(|value| Some(value) == nearest.values.first());
        let seeds = seeds(config.seed);
        let seed = seeds.iter().position(|seed| *seed == config.seed);
        let sweep = Sweep {
            axes: vec![nearest],
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
        Self {
            outcomes: vec![None; rates.len() * sweep.seeds.len()],
            rates,
            done: 0,
            at: (rate.unwrap_or(0), seed.unwrap_or(0)),
            fill: Fill::start(sweep.clone()),
            sweep,
        }
    }

    /// Whether it is of the conditions that `config` describes, all but the rate and
    /// the seed only roughly, and over the rate of `node` or of an alias.
    pub fn is_of(&self, node: &str, config: &Config) -> bool {
        let (mine, theirs) = (&self.sweep.base.setup, &config.setup);
        self.sweep
            .axis(&axis_name(&*self.sweep.system, node))
            .is_some()
            && self.covers(mine, theirs)
            && self.covers(theirs, mine)
            && self.sweep.seeds.contains(&config.seed)
    }

    /// Whether all that `other` sets is the same in `setup`, but for the rate.
    fn covers(&self, setup: &Setup, other: &Setup) -> bool {
        let same = |knob: &Knob| self.turns(knob) || setup.iter().any(|known| known == knob);
        other.iter().all(same)
    }

    /// Whether `knob` is what the rates are of.
    fn turns(&self, knob: &Knob) -> bool {
        let first = self.rates.first();
        first.is_some_and(|value| value.knobs.iter().any(|own| own.is_of(knob)))
    }

    /// The conditions in words: what is set but for the rate.
    pub fn conditions(&self) -> String {
        let set = self.sweep.base.setup.iter();
        let set: Vec<Knob> = set.filter(|knob| !self.turns(knob)).cloned().collect();
        listed(&*self.sweep.system, &set)
    }

    /// Takes in the runs that were made since the last call; says whether there
    /// were any.
    ///
    /// # Errors
    /// [`SweepError`] if a run failed; no more of them are made.
    pub fn follow(&mut self) -> Result<bool, SweepError> {
        let before = self.done;
        while let Some((cell, outcome)) = self.fill.next()? {
            self.note(&cell, outcome);
        }
        Ok(self.done > before)
    }

    fn note(&mut self, cell: &Cell, outcome: CellResult) {
        let rate = cell.values.first();
        let rate = self.rates.iter().position(|value| Some(value) == rate);
        let seed = self.sweep.seeds.iter().position(|seed| *seed == cell.seed);
        let index = rate.zip(seed).map(|(rate, seed)| self.index(rate, seed));
        if let Some(known) = index.and_then(|index| self.outcomes.get_mut(index)) {
            self.done += usize::from(known.replace(outcome).is_none());
        }
    }

    fn index(&self, rate: usize, seed: usize) -> usize {
        rate * self.sweep.seeds.len() + seed
    }

    /// Goes to the next rate.
    pub fn move_rate(&mut self, direction: Direction) {
        self.at.0 = moved(self.at.0, direction, self.rates.len());
    }

    /// Goes to the next seed.
    pub fn move_seed(&mut self, direction: Direction) {
        self.at.1 = moved(self.at.1, direction, self.sweep.seeds.len());
    }

    /// The place: number of the rate, number of the seed.
    pub fn at(&self) -> (usize, usize) {
        self.at
    }

    /// The rate and the seed at the place.
    pub fn chosen(&self) -> (&SweepValue, u64) {
        (&self.rates[self.at.0], self.sweep.seeds[self.at.1])
    }

    /// The rates, upwards.
    pub fn rates(&self) -> &[Arc<SweepValue>] {
        &self.rates
    }

    /// The settings that the runs share.
    pub fn sweep(&self) -> &Sweep {
        &self.sweep
    }

    /// The result of a run, if it is made.
    pub fn outcome(&self, rate: usize, seed: usize) -> Option<&CellResult> {
        self.outcomes.get(self.index(rate, seed))?.as_ref()
    }

    /// How many runs at a rate went well, and how many were made.
    pub fn survival(&self, rate: usize) -> (usize, usize) {
        let seeds = 0..self.sweep.seeds.len();
        let outcomes = seeds.filter_map(|seed| self.outcome(rate, seed));
        outcomes.fold((0, 0), |(well, runs), outcome| {
            (well + usize::from(!outcome.verdict.is_lost()), runs + 1)
        })
    }

    /// Runs that are made, and all of them.
    pub fn progress(&self) -> (usize, usize) {
        (self.done, self.outcomes.len())
    }
}

/// The knob of the map: the first alias of a rate, or the rate of `node`.
fn axis_name(system: &dyn System, node: &str) -> String {
    let alias = first_alias(system, KnobKind::Rate);
    alias.map_or_else(|| format!("rate {node}"), |alias| alias.name.to_owned())
}

/// A value of the map (Hz).
fn hz(value: &SweepValue) -> f64 {
    value.text.parse().unwrap_or(f64::NAN)
}

/// The seeds of the same hundred as `seed`.
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
    //! A map to test with that nobody fills.

    use std::sync::Arc;

    use ratelab::{
        cartpole::{
            CartPole,
            verdict::{BALANCED, POLE_FELL},
        },
        experiment::{Config, Experiment, sweep::CellResult},
        runtime::Time,
        system::{System, Verdict},
    };

    use super::{CliffMap, Fill};

    /// The map around a run of the cart-pole.
    pub fn around(config: &Config) -> CliffMap {
        let system: Arc<dyn System> = Arc::new(CartPole::default());
        let experiment = Experiment::new(system.clone(), config).expect("experiment");
        let graph = experiment.observer().read_counters();
        CliffMap::around(&system, &graph, "", config).expect("a map")
    }

    /// Everything to 15 Hz is made: up from 8 Hz on, in between every third.
    pub fn half_filled() -> CliffMap {
        let mut map = around(&Config {
            seed: 103,
            ..CartPole::config("control-hz 7.5").expect("a knob")
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
    use ratelab::cartpole::CartPole;

    use super::{sample::around, *};

    fn filled(config: &Config) -> CliffMap {
        let mut map = around(config);
        while map.progress().0 < map.progress().1 {
            map.follow().expect("no run fails");
            std::thread::yield_now();
        }
        map
    }

    #[test]
    fn every_cell_is_the_run_that_it_names() {
        let map = filled(&Config::default());
        let names = [("5", 0, 43), ("5", 1, 60), ("7", 2, 228), ("10", 0, 501)];
        for (hz, seed, steps) in names {
            let rate = map.rates().iter().position(|rate| rate.text == hz);
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
        let (rate, seed) = map.chosen();
        assert_eq!((rate.text.as_str(), seed), ("7", 250));
        assert_eq!(map.sweep().seeds[0], 200);
        assert!(map.is_of("", &config));
        assert!(!map.is_of(
            "",
            &Config {
                seed: 300,
                ..config
            }
        ));
    }

    #[test]
    fn another_rate_is_on_the_same_map_and_another_depth_is_not() {
        let map = around(&Config::default());
        let of = |setup| map.is_of("", &CartPole::config(setup).expect("knobs"));
        assert!(of("control-hz 3"));
        assert!(!of("queue-depth 3"));
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
        assert_eq!(map.at(), (29, 0));
    }
}
