//! The cliff map: which control rates and which starts keep the pole up, under
//! the conditions of the session.

mod fill;

use ratelab::{
    experiment::{
        Config,
        sweep::{Cell, CellResult, Sweep, SweepError},
    },
    runtime::Hz,
};

use super::presets::Direction;
use fill::Fill;

/// The control rates of the map (Hz): from 1 to this.
const RATES: u32 = 30;

/// How many starts it has.
const SEEDS: u64 = 100;

/// Runs over control rates and seeds, as far as they are made, and a place
/// among them.
pub struct CliffMap {
    sweep: Sweep,
    /// In the order in which they are shown.
    rates: Vec<Hz>,
    /// Rate after rate, seed after seed.
    outcomes: Vec<Option<CellResult>>,
    /// Runs that are made.
    done: usize,
    /// Number of the rate and number of the seed.
    at: (usize, usize),
    fill: Fill,
}

impl CliffMap {
    /// The map around what `config` describes, to be filled from there outwards.
    pub fn around(config: &Config) -> Self {
        let rates: Vec<Hz> = (1..=RATES)
            .filter_map(|hz| Hz::new(hz.into()).ok())
            .collect();
        let distance = |hz: &Hz| (hz.get() - config.control_hz.get()).abs();
        let mut nearest = rates.clone();
        nearest.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        let sweep = Sweep {
            seeds: seeds(config.seed),
            ..conditions(config, nearest)
        };
        let rate = rates.iter().position(|hz| *hz == sweep.control_hz[0]);
        let seed = sweep.seeds.iter().position(|seed| *seed == config.seed);
        Self {
            outcomes: vec![None; rates.len() * sweep.seeds.len()],
            rates,
            done: 0,
            at: (rate.unwrap_or(0), seed.unwrap_or(0)),
            fill: Fill::start(sweep.clone()),
            sweep,
        }
    }

    /// Whether it is of the conditions that `config` describes: all but the
    /// control rate, and the seed only roughly.
    pub fn is_of(&self, config: &Config) -> bool {
        let wanted = conditions(config, Vec::new());
        let same = self.sweep.policies == wanted.policies
            && self.sweep.sensor_hz == wanted.sensor_hz
            && self.sweep.queue_depths == wanted.queue_depths;
        same && self.sweep.seeds.contains(&config.seed)
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
        let rate = self.rates.iter().position(|hz| *hz == cell.control_hz);
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

    /// The control rate and the seed at the place.
    pub fn chosen(&self) -> (Hz, u64) {
        (self.rates[self.at.0], self.sweep.seeds[self.at.1])
    }

    /// The control rates, upwards.
    pub fn rates(&self) -> &[Hz] {
        &self.rates
    }

    /// What the runs have in common.
    pub fn sweep(&self) -> &Sweep {
        &self.sweep
    }

    /// What a run came to, if it is made.
    pub fn outcome(&self, rate: usize, seed: usize) -> Option<&CellResult> {
        self.outcomes.get(self.index(rate, seed))?.as_ref()
    }

    /// How many runs at a rate stayed up, and how many were made.
    pub fn survival(&self, rate: usize) -> (usize, usize) {
        let seeds = 0..self.sweep.seeds.len();
        let outcomes = seeds.filter_map(|seed| self.outcome(rate, seed));
        outcomes.fold((0, 0), |(balanced, runs), outcome| {
            (balanced + usize::from(outcome.verdict.balanced()), runs + 1)
        })
    }

    /// Runs that are made, and all of them.
    pub fn progress(&self) -> (usize, usize) {
        (self.done, self.outcomes.len())
    }
}

/// The runs under the conditions of `config` at those rates, of ten seconds
/// each, however long the session is.
fn conditions(config: &Config, control_hz: Vec<Hz>) -> Sweep {
    Sweep {
        control_hz,
        ..Sweep::of(Config {
            end: Config::default().end,
            knobs: Vec::new(),
            ..config.clone()
        })
    }
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

    use ratelab::{
        experiment::{Config, Verdict, sweep::CellResult},
        runtime::Time,
    };

    use super::{CliffMap, Fill};

    /// Everything to 15 Hz is made: up from 8 Hz on, in between every third.
    pub fn half_filled() -> CliffMap {
        let mut map = CliffMap::around(&Config {
            control_hz: ratelab::runtime::Hz::new(7.5).expect("rate"),
            seed: 103,
            ..Config::default()
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
        CellResult {
            verdict: if up {
                Verdict::Balanced
            } else {
                Verdict::PoleFell { at: fell }
            },
            steps: 180,
            sim_time: if up { end } else { fell },
            mean_latency_s: Some(0.0779),
            obs_dropped: 12,
            action_dropped: 0,
            final_pole_angle: 0.21,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn filled(config: &Config) -> CliffMap {
        let mut map = CliffMap::around(config);
        while map.progress().0 < map.progress().1 {
            map.follow().expect("no run fails");
            std::thread::sleep(Duration::from_millis(5));
        }
        map
    }

    #[test]
    fn every_cell_is_the_run_that_it_names() {
        let map = filled(&Config::default());
        let names = [(5.0, 0, 43), (5.0, 1, 60), (7.0, 2, 228), (10.0, 0, 501)];
        for (hz, seed, steps) in names {
            let rate = map.rates().iter().position(|rate| rate.get() == hz);
            let outcome = map.outcome(rate.expect("a rate of the map"), seed);
            assert_eq!(outcome.expect("made").steps, steps, "{hz} Hz, seed {seed}");
        }
        assert_eq!(map.survival(4), (0, 100));
        assert_eq!(map.survival(9), (100, 100));
    }

    #[test]
    fn it_begins_where_the_session_is() {
        let config = Config {
            control_hz: Hz::new(7.0).expect("rate"),
            seed: 250,
            ..Config::default()
        };
        let map = CliffMap::around(&config);
        assert_eq!(map.chosen(), (config.control_hz, 250));
        assert_eq!(map.sweep().seeds[0], 200);
        assert!(map.is_of(&config));
        assert!(!map.is_of(&Config {
            seed: 300,
            ..config
        }));
    }

    #[test]
    fn the_last_seeds_of_all_have_a_map_too() {
        let map = CliffMap::around(&Config {
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
