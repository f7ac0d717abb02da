//! Runs drawn at random, in which one of several causes makes the pushes old.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex},
};

use ratelab::sync::lock;
use ratelab_experiment::{
    Config, Experiment,
    sweep::{ByAge, CellResult},
};
use ratelab_system::{StepMs, WorldKind};

use rayon::prelude::*;

use crate::framework::{Failure, SplitMix, cart_pole, own_world};

/// Runs of each cause.
pub const RUNS: u64 = 200;

/// Number of different starts to draw from.
const STARTS: usize = 1_000;

/// Step of the physics: as long as the period of the actuator.
const STEP: StepMs = StepMs::ALL[1];

/// The runs of a cause, once they are measured.
type KeptRuns = Arc<Mutex<Option<Arc<ByAge>>>>;

/// A cause of old pushes, with values on both sides of what the pole bears.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AgeCause {
    /// A slow policy.
    Rate,
    /// A constant delay of `/action`.
    Delay,
    /// Random loss of messages on `/action`, the last one held.
    Loss,
    /// A slow policy that ticks long after the sensor.
    Phase,
    /// A policy that takes time to decide.
    Thinking,
    /// A random delay of `/action`.
    Jitter,
}

impl AgeCause {
    /// The causes that follow the law.
    pub const LAWFUL: [Self; 5] = [
        Self::Rate,
        Self::Delay,
        Self::Loss,
        Self::Phase,
        Self::Thinking,
    ];

    /// Returns its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rate => "rate",
            Self::Delay => "delay",
            Self::Loss => "loss",
            Self::Phase => "phase",
            Self::Thinking => "thinking",
            Self::Jitter => "jitter",
        }
    }

    /// Knobs with a value that is drawn.
    fn knobs(self, chance: &mut SplitMix) -> String {
        let mut value = |from, to| format!("{:.2}", chance.within(from, to));
        match self {
            // A period of 25 to 200 ms.
            Self::Rate => format!("control-hz {:.2}", 1e3 / chance.within(25.0, 200.0)),
            Self::Delay => format!("link /action delay:{}", value(0.0, 130.0)),
            Self::Loss => format!("link /action loss:{}", value(0.3, 0.95)),
            Self::Phase => format!(
                "sensor-hz 8, control-hz 8, offset policy {}",
                value(0.0, 120.0)
            ),
            Self::Thinking => format!("think-ms {}", value(0.0, 130.0)),
            Self::Jitter => format!("link /action delay:0..{}", value(40.0, 600.0)),
        }
    }

    /// Returns the run number `run` drawn from the learner's number `seed`.
    fn config(self, seed: u64, run: u64) -> Result<Config, Failure> {
        let chance = &mut SplitMix::new(seed, self as u64, run);
        let knobs = self.knobs(chance);
        Ok(Config {
            seed: chance.below(STARTS) as u64,
            world: WorldKind::Own { step_ms: STEP },
            ..own_world(&format!("rate actuator 500, {knobs}"))?
        })
    }

    fn run(self, seed: u64, run: u64) -> Result<CellResult, Failure> {
        let experiment = Experiment::new(cart_pole(), &self.config(seed, run)?)?;
        Ok(CellResult::new(&*cart_pole(), &experiment.run()?))
    }

    /// Returns all its runs by age, drawn from the learner's number `seed`.
    ///
    /// They take seconds, and two questions need the same: the first result is kept, and who asks
    /// for it meanwhile waits.
    pub fn by_age(self, seed: u64) -> Result<Arc<ByAge>, Failure> {
        static KNOWN: Mutex<BTreeMap<(u64, u64), KeptRuns>> = Mutex::new(BTreeMap::new());
        let kept = lock(&KNOWN).entry((seed, self as u64)).or_default().clone();
        let mut kept = lock(&kept);
        if let Some(known) = &*kept {
            return Ok(known.clone());
        }
        let runs: Vec<CellResult> = (0..RUNS)
            .into_par_iter()
            .map(|run| self.run(seed, run))
            .collect::<Result<_, Failure>>()?;
        Ok(kept.insert(Arc::new(ByAge::new(&runs))).clone())
    }
}
