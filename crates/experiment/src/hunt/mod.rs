//! A hunt for a short list of faults that loses a run: found first, then shrunk.
//!
//! ```
//! use std::sync::Arc;
//! use ratelab_experiment::{Config, hunt::{Budget, Hunt, Hunted}};
//! use ratelab_system::graph_file::GraphFile;
//!
//! let robot = r#"
//!     name = "robot"
//!     node.camera = { rate = 10, publishes = ["/image"] }
//!     node.control = { rate = 10, reads = ["/image"], publishes = ["/cmd"] }
//!     chain.see = { path = ["camera", "/image", "control", "/cmd"], age_ms = 350 }
//! "#;
//! let hunt = Hunt::new(Arc::new(GraphFile::parse(robot)?.system(&[])?), Config::default());
//! let budget = Budget { topic: "/image".to_owned(), lose: 8, ..Budget::default() };
//! let Hunted::Lost(found) = hunt.run(&budget, &|| false)? else { panic!("it was held") };
//! let faults: Vec<String> = found.knobs.iter().map(|timed| timed.knob.to_string()).collect();
//! assert_eq!(faults, ["lose /image 1", "lose /image 2", "lose /image 3"]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! 1. *Windows*: adjacent faults of one kind, from each message or tick on. If the whole
//!    budget is enough anywhere, bisection finds the smallest number that is. Of several
//!    kinds the smallest list counts; if no kind is enough alone, all are tried at the
//!    same moment.
//! 2. *Random lists*, if no window is enough: [`RANDOM_LISTS`] of them, which the seed
//!    of the run chooses.
//! 3. *Larger windows*, of up to twice the budget, if those are not enough either: one that
//!    shrinks to a list within the budget counts.
//! 4. *Delta debugging* makes the list 1-minimal: without any one of its parts the run is
//!    held. Zeller and Hildebrandt, *Simplifying and isolating failure-inducing input*,
//!    IEEE Transactions on Software Engineering 28, 2002.
//! 5. *Every smaller list* is run, if they are [`MOST_SMALLER`] at the most, in the order
//!    of their size: if one of them is enough, it is the result, and all that are
//!    smaller than it have been run.
//!
//! A delay, a hang and a shift are lists of parts, whose lengths follow the periods of the graph (see
//! [`Budget::fitted`]); of shifts each one is tried, from the smallest on. The result is a smallest list
//! in the sense of 4 or 5; another one elsewhere in the run may be shorter.

mod fault;
mod trial;
mod windows;

use std::{num::NonZeroUsize, sync::Arc, time::Duration};

use thiserror::Error;

pub use fault::{LONGEST_PART, LONGEST_SHIFT, PartLengths};
pub use trial::MOST_SMALLER;
pub use windows::RANDOM_LISTS;

use ratelab::{ClockKind, Fault, Interrupt, Speed, Time, TimedKnob, millis};
use trial::{Halt, Trials, shrink};
use windows::Windows;

use super::{Config, Experiment, parallel::all_cores};
use ratelab_system::{BuildError, System, Verdict};

/// Maximum number of parts of a kind in a budget.
pub const MOST_PARTS: usize = 1_000;

/// A search for faults that lose a run.
#[derive(Clone)]
pub struct Hunt {
    system: Arc<dyn System>,
    base: Config,
    /// Number of threads; it changes the duration of the hunt alone.
    pub threads: NonZeroUsize,
    /// Stops the hunt, within a run as well.
    pub interrupt: Interrupt,
}

/// The upper limits of the faults.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Budget {
    /// The topic with lost or late messages.
    pub topic: String,
    /// Maximum number of lost messages.
    pub lose: usize,
    /// Maximum extra delay, summed over all messages.
    pub delay: Duration,
    /// A node, and the longest duration of one of its ticks in place of the usual one.
    pub hang: Option<(String, Duration)>,
    /// A node, and by how much its due times may be later, in the whole run.
    pub shift: Option<(String, Duration)>,
    /// The offset of that node without a shift.
    pub offset: Duration,
    /// The lengths of the smallest parts; a hunt [fits](Budget::fitted) them to its graph.
    pub parts: PartLengths,
}

/// The outcome of a hunt.
#[derive(Clone, Debug, PartialEq)]
pub enum Hunted {
    /// Faults within the budget that lose the run.
    Lost(Found),
    /// No list of faults lost the run.
    Held {
        /// Number of lists tried.
        runs: usize,
        /// Whether the hunt was stopped early.
        stopped: bool,
    },
}

/// Faults that lose a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// The faults, to be added to the configuration.
    pub knobs: Vec<TimedKnob>,
    /// The verdict on the run with these faults.
    pub verdict: Verdict,
    /// Evidence that the list is small.
    pub proof: Proof,
    /// Number of lists tried.
    pub runs: usize,
}

/// Evidence about the smaller lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Proof {
    /// The run is held with every smaller list of the same parts; contains their number.
    EverySmaller(usize),
    /// The run is held if any one part is left out; contains the number of parts.
    EachPart(usize),
    /// None: the hunt was stopped.
    Stopped,
}

/// The error of an impossible hunt.
#[derive(Debug, Error)]
pub enum HuntError {
    /// An empty budget.
    #[error(
        "no faults to try: allow messages to be lost or late, or a node to hang or to be shifted"
    )]
    NoBudget,
    /// A budget with too many parts.
    #[error("a budget has {MOST_PARTS} messages at most, or as many times 10 ms (1 ms of a shift)")]
    TooMuch,
    /// A budget with less than one part of something.
    #[error(
        "a {what} of {} ms is less than the smallest one that is tried: allow {} ms or more",
        millis::to_millis(*length),
        millis::to_millis(*part)
    )]
    TooLittle {
        /// What it is: a delay, a hang or a shift.
        what: &'static str,
        /// What is allowed.
        length: Duration,
        /// The length of the smallest part.
        part: Duration,
    },
    /// A graph whose runs are never lost.
    #[error(
        "no run of {0} can be lost, so there is nothing to hunt for: give a [chain.NAME] of its \
         graph file a limit, age_ms"
    )]
    NeverLost(String),
    /// Lost or late messages of a graph in which no node reads.
    #[error(
        "no node reads a topic in this graph, so no message can be lost or late: allow a hang or a shift"
    )]
    NoReader,
    /// A run without a duration.
    #[error("the runs of a hunt must end: give them a duration")]
    Endless,
    /// A target that is unknown, or has nothing to lose.
    #[error("{name}: {why}; expected one of {known}")]
    Target {
        /// Its name.
        name: String,
        /// The reason.
        why: &'static str,
        /// The accepted names.
        known: String,
    },
    /// The run is lost even without faults.
    #[error("without any fault: {0}; begin with a run that is not lost")]
    LostAnyway(Verdict),
    /// The graph could not be built.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// A node failed.
    #[error(transparent)]
    Fault(#[from] Fault),
}

impl Hunt {
    /// Creates a hunt for faults that lose the run of `base`, on the virtual clock and
    /// all cores.
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
            interrupt: Interrupt::default(),
        }
    }

    /// Returns the configuration with `faults`.
    pub fn with(&self, faults: &[TimedKnob]) -> Config {
        let mut config = self.base.clone();
        config.knobs.extend(faults.iter().cloned());
        config.knobs.sort_by_key(|timed| timed.at);
        config
    }

    /// Hunts within `budget`, to the end or until `stop` returns `true` before a run or
    /// [`interrupt`](Self::interrupt) is asked for, and then returns the best list so far. The
    /// outcome depends on the configuration and the budget alone.
    ///
    /// # Errors
    /// [`HuntError`] if the hunt is impossible, or a run failed.
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
        let verdicts = self.system.verdicts();
        if verdicts.iter().all(|verdict| !verdict.lost) {
            return Err(HuntError::NeverLost(self.system.name().to_owned()));
        }
        let graph = Experiment::from_resolved(self.system.clone(), resolved.base.clone())?;
        let mut setup = self.system.about().setup();
        setup.extend(resolved.base.setup.iter().cloned());
        let budget = &budget.fitted(&graph.observer().topology(), &setup);
        budget.check()?;
        let mut trials = Trials::new(&resolved, budget, stop);
        let usual = trials.summary(&[])?;
        let Some(usual) = usual.filter(|_| !self.interrupt.is_asked()) else {
            let (runs, stopped) = (0, true);
            return Ok(Hunted::Held { runs, stopped });
        };
        if usual.verdict.is_lost() {
            return Err(HuntError::LostAnyway(usual.verdict));
        }
        let windows = Windows::new(budget, &usual)?;
        let proof = match resolved.search(&windows, &mut trials) {
            Ok(proof) => proof,
            Err(Halt::Stopped) => Proof::Stopped,
            Err(Halt::Failed(why)) => return Err(why),
        };
        let (stopped, runs) = (proof == Proof::Stopped, trials.runs());
        Ok(match trials.best() {
            None => Hunted::Held { runs, stopped },
            Some((best, verdict)) => Hunted::Lost(Found {
                knobs: budget.knobs(best),
                verdict: verdict.clone(),
                proof,
                runs,
            }),
        })
    }

    /// Tries ever smaller lists; returns the evidence about the last one that loses the run.
    fn search(&self, windows: &Windows, trials: &mut Trials<'_>) -> Result<Proof, Halt> {
        windows.search(trials)?;
        // Of shifts alone all have been tried.
        if trials.best().is_none() && !windows.only_shift() {
            trials.first_lost(&windows.random(self.base.seed))?;
            if trials.best().is_none() {
                windows.search_beyond(trials)?;
            }
        }
        let Some((best, _)) = trials.best() else {
            return Ok(Proof::EachPart(0));
        };
        let mut best = best.clone();
        shrink(&mut best, trials)
    }
}

impl HuntError {
    fn target<'n>(name: &str, why: &'static str, known: impl Iterator<Item = &'n str>) -> Self {
        let known: Vec<&str> = known.collect();
        let (name, known) = (name.to_owned(), known.join(", "));
        Self::Target { name, why, known }
    }
}
