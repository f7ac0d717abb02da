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

#[cfg(test)]
mod tests {
    use ratelab_system::graph_file::GraphFile;

    use super::*;

    /// A loop whose data may be 150 ms old, with a link that takes 300 ms.
    const ROBOT: &str = "
        name = 'robot'
        node.camera = { rate = 'control / 1', publishes = ['/image'] }
        node.control = { rate = 20, reads = ['/image'], publishes = ['/cmd'] }
        chain.see = { path = ['camera', '/image', 'control', '/cmd'], age_ms = 150 }
    ";

    fn trial(setup: &str, now: Duration) -> Trial {
        let file = GraphFile::parse(ROBOT).expect("a graph");
        let system = Arc::new(file.system(&[]).expect("a system"));
        let setup = knobs(setup).into_iter().collect();
        Trial::new(system, &Config::default(), setup, Time::ZERO + now)
    }

    fn knobs(list: &str) -> Vec<Knob> {
        let knobs = list.split("; ").filter(|text| !text.is_empty());
        knobs.map(|text| text.parse().expect(text)).collect()
    }

    #[test]
    fn a_trial_lasts_twice_as_long_as_the_run_from_ten_seconds_to_a_minute() {
        for (ran, lasts) in [(0, 10), (4, 10), (7, 14), (100, 60)] {
            let trial = trial("", Duration::from_secs(ran));
            let end = trial.config().end;
            assert_eq!(end, Time::ZERO + Duration::from_secs(lasts), "{ran} s");
        }
    }

    #[test]
    fn the_cures_that_it_takes_are_told_apart_from_all_others() {
        const SLOW: &str = "link /image delay:300";
        for (setup, cures, needed) in [
            (SLOW, "link /image none", Some(Some(vec![0]))),
            (
                SLOW,
                "depth /image 2; link /image none",
                Some(Some(vec![1])),
            ),
            (SLOW, "depth /image 2", Some(None)),
            (
                "link /image delay:300; rate control 2",
                "link /image none; rate control 20",
                Some(Some(vec![0, 1])),
            ),
            // A run that is not lost proves nothing, and neither does no cure.
            ("", "link /image none", None),
            (SLOW, "", None),
        ] {
            let tried = trial(setup, Duration::ZERO).run(&knobs(cures));
            assert_eq!(tried.map(|tried| tried.needed), needed, "{setup}: {cures}");
        }
    }
}
