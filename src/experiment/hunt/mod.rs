//! The least that loses a run: a short list of faults, found and then shrunk.
//!
//! ```
//! use std::sync::Arc;
//! use ratelab::cartpole::CartPole;
//! use ratelab::experiment::hunt::{Budget, Hunt, Hunted};
//!
//! let hunt = Hunt::new(Arc::new(CartPole::default()), CartPole::config("control-hz 15")?);
//! let budget = Budget { topic: "/action".to_owned(), lose: 8, ..Budget::default() };
//! let Hunted::Lost(found) = hunt.run(&budget, &|| false)? else { panic!("it was held") };
//! let faults: Vec<String> = found.knobs.iter().map(|timed| timed.knob.to_string()).collect();
//! assert_eq!(faults, ["lose /action 1", "lose /action 2", "lose /action 3"]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! 1. *Windows*: faults of one kind next to each other, beginning with each message or
//!    tick. If as many as the budget has are enough anywhere, the smallest number that is
//!    comes by bisection. Of several kinds the smallest list goes on; if none is enough
//!    alone, all are tried at the same moment.
//! 2. *Random lists*, if no window is enough: [`RANDOM_LISTS`] of them, which the seed
//!    of the run chooses.
//! 3. *Delta debugging* makes the list 1-minimal: without any one of its parts the run is
//!    held. Zeller and Hildebrandt, *Simplifying and isolating failure-inducing input*,
//!    IEEE Transactions on Software Engineering 28, 2002.
//! 4. *Every smaller list* is run, if they are [`MOST_SMALLER`] at the most, in the order
//!    of their size: if one of them is enough, it is the result, and all that are
//!    smaller than it have been run.
//!
//! A delay and a hang are lists of parts of [`UNIT`] each. The result is a smallest list
//! in the sense of 3 or 4; another one elsewhere in the run may be shorter.

mod fault;
mod shrink;
mod trial;
mod windows;

use std::{num::NonZeroUsize, sync::Arc, time::Duration};

use thiserror::Error;

pub use shrink::MOST_SMALLER;
pub use windows::RANDOM_LISTS;

use super::{Config, Summary, sweep::all_cores};
use crate::{
    runtime::{ClockKind, Fault, Speed, Time, TimedKnob},
    system::{BuildError, System, Verdict},
};
use fault::{Part, Targets};
use trial::{Halt, Trials};
use windows::Windows;

/// The smallest part of a delay or a hang.
pub const UNIT: Duration = Duration::from_millis(10);

/// The most parts that a budget may have of a kind.
pub const MOST_PARTS: usize = 1_000;

/// A run whose loss is hunted for.
#[derive(Clone)]
pub struct Hunt {
    system: Arc<dyn System>,
    base: Config,
    /// Threads to run on, which change nothing but the time it takes.
    pub threads: NonZeroUsize,
}

/// What may go wrong, at the most.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Budget {
    /// The topic whose messages are lost or late.
    pub topic: String,
    /// How many are lost.
    pub lose: usize,
    /// How much later they are delivered than they would be, all together.
    pub delay: Duration,
    /// A node, and what one of its ticks takes instead of the usual.
    pub hang: Option<(String, Duration)>,
}

/// The outcome of a hunt.
#[derive(Clone, Debug, PartialEq)]
pub enum Hunted {
    /// Faults within the budget that are enough.
    Lost(Found),
    /// Nothing that was tried is.
    Held {
        /// Lists of faults that were tried.
        runs: usize,
        /// Whether there would have been more to try.
        stopped: bool,
    },
}

/// Faults that lose a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// The faults, beside which the configuration stays as it is.
    pub knobs: Vec<TimedKnob>,
    /// What becomes of the run.
    pub verdict: Verdict,
    /// How small the list is.
    pub proof: Proof,
    /// Lists of faults that were tried.
    pub runs: usize,
}

/// What is known of lists that are smaller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Proof {
    /// The run is held with each of the lists that are part of it, which are so many.
    EverySmaller(usize),
    /// The run is held without any one of its parts, which are so many.
    EachPart(usize),
    /// None: the hunt was stopped.
    Stopped,
}

/// A hunt that cannot be.
#[derive(Debug, Error)]
pub enum HuntError {
    /// There is nothing that may go wrong.
    #[error("nothing may go wrong: allow messages to be lost or late, or a node to hang")]
    NoBudget,
    /// It would take too long.
    #[error("a budget has {MOST_PARTS} messages at most, or as many times 10 ms")]
    TooMuch,
    /// Its runs would never end.
    #[error("the runs of a hunt must end: give them a duration")]
    Endless,
    /// There is no such topic or node, or nothing to lose of it.
    #[error("{name}: {why}; expected one of {known}")]
    Target {
        /// Its name.
        name: String,
        /// What is the matter.
        why: &'static str,
        /// The names that there are.
        known: String,
    },
    /// Nothing has to go wrong.
    #[error("without any fault: {0}; hunt for what loses a run that goes well")]
    LostAnyway(Verdict),
    /// The graph could not be built as asked.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// A node failed.
    #[error(transparent)]
    Fault(#[from] Fault),
}

impl Hunt {
    /// A hunt for what loses the run that `base` is, on the virtual clock, on all cores.
    pub fn new(system: Arc<dyn System>, base: Config) -> Self {
        let base = Config {
            clock: ClockKind::Virtual,
            speed: Speed::Unlimited,
            ..base
        };
        let threads = all_cores();
        Self {
            system,
            base,
            threads,
        }
    }

    /// The run with `faults`.
    pub fn with(&self, faults: &[TimedKnob]) -> Config {
        let mut config = self.base.clone();
        config.knobs.extend(faults.iter().cloned());
        config.knobs.sort_by_key(|timed| timed.at);
        config
    }

    /// Hunts within `budget`, until it is done or `stop` asks for what is found so far.
    /// The outcome depends on the configuration and the budget alone.
    ///
    /// # Errors
    /// [`HuntError`] if there is nothing to hunt, or a run failed.
    pub fn run(
        &self,
        budget: &Budget,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Hunted, HuntError> {
        let resolved = Self {
            base: self.base.resolved(&*self.system)?,
            ..self.clone()
        };
        if self.base.end == Time::MAX {
            return Err(HuntError::Endless);
        }
        let targets = Targets::of(budget)?;
        let mut trials = Trials::new(&resolved, &targets, stop);
        let usual = trials.summary(&[])?;
        if usual.verdict.is_lost() {
            return Err(HuntError::LostAnyway(usual.verdict));
        }
        let windows = Windows::of(budget, &usual)?;
        let mut best = None;
        let proof = match resolved.search(&windows, &mut trials, &mut best) {
            Ok(proof) => proof,
            Err(Halt::Stopped) => Proof::Stopped,
            Err(Halt::Failed(why)) => return Err(why),
        };
        let (stopped, runs) = (proof == Proof::Stopped, trials.runs());
        let Some(best) = best else {
            return Ok(Hunted::Held { runs, stopped });
        };
        Ok(Hunted::Lost(Found {
            verdict: trials.summary(&best)?.verdict,
            knobs: targets.knobs(&best),
            proof,
            runs,
        }))
    }

    /// Puts into `best` what is enough, less and less; what is known of it at last.
    fn search(
        &self,
        windows: &Windows,
        trials: &mut Trials<'_>,
        best: &mut Option<Vec<Part>>,
    ) -> Result<Proof, Halt> {
        windows.search(trials, best)?;
        if best.is_none() {
            let lists = windows.random(self.base.seed);
            *best = trials.first_lost(&lists)?.map(|index| lists[index].clone());
        }
        match best {
            Some(best) => shrink::shrink(best, |lists| trials.first_lost(lists)),
            None => Ok(Proof::EachPart(0)),
        }
    }
}

/// The names in `names` as a list.
fn listed<'n>(names: impl Iterator<Item = &'n str>) -> String {
    names.collect::<Vec<_>>().join(", ")
}

impl HuntError {
    fn topic(name: &str, why: &'static str, usual: &Summary) -> Self {
        let read = usual.topics.iter().filter(|topic| topic.read);
        let known = listed(read.map(|topic| topic.name.as_str()));
        let name = name.to_owned();
        Self::Target { name, why, known }
    }

    fn node(name: &str, why: &'static str, usual: &Summary) -> Self {
        let known = listed(usual.nodes.iter().map(|node| node.name.as_str()));
        let name = name.to_owned();
        Self::Target { name, why, known }
    }
}
