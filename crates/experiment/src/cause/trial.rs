//! The run again without its causes: only what was tried is said to mend it.

use std::{sync::Arc, time::Duration};

use ratelab::{ClockKind, Knob, Speed, Time};
use ratelab_system::{Setup, System};

use crate::{Config, Experiment, Summary};

/// Run time of a trial, at least and at most; in between, twice that of the run.
const LENGTH: [Duration; 2] = [Duration::from_secs(10), Duration::from_secs(60)];

/// The outcome of trials with cures.
#[derive(Clone, Debug, PartialEq)]
pub struct Tried {
    /// The cures, the most important first.
    pub cures: Vec<Knob>,
    /// Indices of the needed cures; `None` if all of them together are not enough.
    pub needed: Option<Vec<usize>>,
    /// The age without a cure, and with the first one alone.
    pub ages: Option<[Duration; 2]>,
}

/// A run to be executed again with cures.
pub struct Trial {
    system: Arc<dyn System>,
    config: Config,
}

impl Trial {
    /// Creates the trial of a run of `config` at run time `now`, with `setup` in force: what the
    /// next run will be.
    pub fn new(system: Arc<dyn System>, config: &Config, setup: Setup, now: Time) -> Self {
        let [least, most] = LENGTH;
        let length = (now.since(Time::ZERO) * 2).clamp(least, most);
        let config = Config {
            clock: ClockKind::Virtual,
            speed: Speed::Unlimited,
            end: Time::ZERO + length,
            setup,
            knobs: Vec::new(),
            ..config.clone()
        };
        Self { system, config }
    }

    /// Returns the configuration of the run without a cure.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// Executes it without a cure and with some of `cures`; `None` if without one it is
    /// not lost, so that nothing is proven.
    pub fn run(&self, cures: &[Knob]) -> Option<Tried> {
        let all: Vec<usize> = (0..cures.len()).collect();
        if cures.is_empty() {
            return None;
        }
        let before = self.with(cures, &[]).filter(|run| run.verdict.is_lost())?;
        let first = self.with(cures, &all[..1])?;
        let stands = |some: &[usize]| {
            let run = self.with(cures, some);
            run.is_some_and(|run| !run.verdict.is_lost())
        };
        let enough = (1..=all.len()).find(|count| stands(&all[..*count]));
        let needed = enough.map(|count| {
            let mut needed = all[..count].to_vec();
            for index in (0..count).rev() {
                let rest = needed.iter().copied().filter(|other| *other != index);
                let rest: Vec<usize> = rest.collect();
                if stands(&rest) {
                    needed = rest;
                }
            }
            needed
        });
        let age = |run: &Summary| run.push_age().map(|age| age.late_s);
        let ages = age(&before).zip(age(&first));
        Some(Tried {
            cures: cures.to_vec(),
            needed,
            ages: ages.map(|(before, first)| [before, first].map(Duration::from_secs_f64)),
        })
    }

    /// Returns the run with the `cures` at the indices in `some`.
    fn with(&self, cures: &[Knob], some: &[usize]) -> Option<Summary> {
        let (mut config, about) = (self.config.clone(), self.system.about());
        let cures = some.iter().map(|index| &cures[*index]);
        config.setup.extend(about.with_followers(cures));
        let experiment = Experiment::new(self.system.clone(), &config).ok()?;
        experiment.run().ok()
    }
}
