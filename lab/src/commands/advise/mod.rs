//! `ratelab advise`: what would make the data younger, by what was measured.

mod text;

use std::sync::Arc;

use ratelab::{Interrupt, Time, Topology};
use ratelab_study::{
    advise::{AgeChange, changes, run_all},
    experiment::{Config, Experiment, RunAge, Summary, sweep::all_cores},
    system::{DataChain, System},
};

use crate::{
    cli::AdviseArgs,
    error::Error,
    options::{self, Defaults},
    output::{ProgressLine, print_result},
    program::Program,
    signals,
};

/// Defaults of the runs.
const DEFAULTS: Defaults =
    Defaults::virtual_only("advice runs on the virtual clock: leave --clock real out");

/// Number of changes that are tried two at a time, the best ones.
const FEW: usize = 12;

/// The share of the mean age below which a change helps.
const HELPS: f64 = 0.99;

/// A run with a change, or without any.
pub struct ChangedRun {
    pub change: AgeChange,
    pub summary: Summary,
    /// The age in question.
    pub age: RunAge,
    /// The share of the time within its limit, if it has one.
    pub within: Option<f64>,
}

impl ChangedRun {
    /// Whether its age is clearly younger than that of `other`.
    pub fn is_younger(&self, other: &Self) -> bool {
        self.age.mean_ns as f64 <= HELPS * other.age.mean_ns as f64
    }
}

/// Runs every change of the graph, then pairs of those that help most if none of them is enough;
/// prints what they do. Ctrl-C keeps the finished ones.
pub fn advise(program: &Program, args: &AdviseArgs) -> Result<(), Error> {
    let (config, _) = options::graph(program, &args.graph, &DEFAULTS)?;
    let advisor = Advisor {
        program,
        args,
        config,
        interrupt: signals::interrupt(),
    };
    let (base, topology) = advisor.base()?;
    let setup = &base.summary.config.setup;
    let singles = changes(&*program.system, setup, &topology, &base.age);
    let mut measured = advisor.measure(&base, singles);
    sort(&mut measured);
    if !is_enough(&base, &measured) {
        let both = advisor.younger_pairs(&base, &measured);
        measured.extend(both);
        sort(&mut measured);
    }
    let advice = text::of(program, &base, &measured);
    print_result(args.json, &text::json(&base, &measured), &advice)?;
    match advisor.interrupt.is_asked() {
        true => Err(Error::Unfinished(format!(
            "stopped after {} runs: the result is of these",
            measured.len()
        ))),
        false => Ok(()),
    }
}

/// Whether there is a limit, and one of the `measured` changes has it kept.
fn is_enough(base: &ChangedRun, measured: &[ChangedRun]) -> bool {
    let limited = base.within.is_some() || base.summary.verdict.is_lost();
    limited && measured.iter().any(|run| !run.summary.verdict.is_lost())
}

/// The best of the `measured` changes two at a time, each of another node or topic.
fn pairs(measured: &[ChangedRun]) -> Vec<AgeChange> {
    let best: Vec<&AgeChange> = measured.iter().take(FEW).map(|run| &run.change).collect();
    let pairs = best.iter().enumerate().flat_map(|(place, one)| {
        let others = best[..place].iter().filter(|other| other.of != one.of);
        others.map(|other| other.and(one))
    });
    pairs.collect()
}

/// Puts those that are not lost first, of them the youngest, and of these the ones with the fewest
/// messages.
fn sort(measured: &mut [ChangedRun]) {
    measured.sort_by_key(|run| {
        let sent = run.summary.topics.iter().map(|topic| topic.published);
        let sent = sent.fold(0, u64::saturating_add);
        (run.summary.verdict.is_lost(), run.age.mean_ns, sent)
    });
}

/// What all runs have in common.
struct Advisor<'a> {
    program: &'a Program,
    args: &'a AdviseArgs,
    config: Config,
    interrupt: Interrupt,
}

impl Advisor<'_> {
    /// The run without a change, and its graph.
    fn base(&self) -> Result<(ChangedRun, Topology), Error> {
        if self.config.end == Time::MAX {
            let why = "the runs of advice must end: give them --duration-s";
            return Err(Error::BadInput(why.to_owned()));
        }
        let system = &self.program.system;
        let mut experiment = Experiment::new(system.clone(), &self.config)?;
        let topology = experiment.observer().topology();
        experiment.watch_ages();
        let summary = experiment.run_until(&self.interrupt)?;
        let summary = summary.filter(|_| !self.interrupt.is_asked());
        let stopped = || Error::Unfinished("stopped before the first result".to_owned());
        let summary = summary.ok_or_else(stopped)?;
        let late = |age: &RunAge| {
            let chain = self.chain_of(age);
            chain.and_then(|chain| chain.excess(summary.sim_time, &summary.chains))
        };
        // The age in question is the one that is farthest from its limit.
        let ages = summary.ages.iter();
        let worst = ages.rev().max_by(|one, other| {
            let [one, other] = [one, other].map(|age| late(age).unwrap_or(f64::NEG_INFINITY));
            one.total_cmp(&other)
        });
        let Some(age) = worst.cloned() else {
            return Err(Error::BadInput(format!(
                "{} has no age to make younger in this run: nothing came to the end of a \
                 [chain.NAME], and nothing was pushed",
                system.name()
            )));
        };
        Ok((self.measured(AgeChange::default(), summary, age), topology))
    }

    /// The chain whose age it is; `None` for a push.
    fn chain_of(&self, age: &RunAge) -> Option<&DataChain> {
        let mut chains = self.program.system.about().chains.iter();
        chains.find(|chain| Some(chain.name()) == age.chain)
    }

    /// A run with its `age` in question.
    fn measured(&self, change: AgeChange, summary: Summary, age: RunAge) -> ChangedRun {
        let chain = self.chain_of(&age);
        let within = chain.and_then(|chain| chain.within_share(summary.sim_time, &summary.chains));
        ChangedRun {
            age,
            within,
            change,
            summary,
        }
    }

    /// Runs with two of the `measured` changes that are younger than with either alone.
    fn younger_pairs(&self, base: &ChangedRun, measured: &[ChangedRun]) -> Vec<ChangedRun> {
        let mut both = self.measure(base, pairs(measured));
        both.retain(|both| {
            let is_part = |part: &&ChangedRun| part.change.is_part_of(&both.change);
            let mut parts = measured.iter().filter(is_part);
            parts.all(|part| both.is_younger(part))
        });
        both
    }

    /// Runs with each of `changes`; without those that the graph cannot have.
    fn measure(&self, base: &ChangedRun, changes: Vec<AgeChange>) -> Vec<ChangedRun> {
        let runs = changes.into_iter().filter_map(|change| {
            let system: Arc<dyn System> = self.program.with(&change.with).ok()?.system;
            let mut config = self.config.clone();
            config.setup.extend(change.knobs.iter().cloned());
            Some((change, (system, config)))
        });
        let (changes, runs): (Vec<AgeChange>, Vec<_>) = runs.unzip();
        let bar = ProgressLine::of_runs(runs.len(), false, self.args.json);
        let threads = self.args.threads.unwrap_or_else(all_cores);
        let summaries = run_all(&runs, &self.interrupt, threads, || bar.advance());
        let known = changes.into_iter().zip(summaries);
        let measured = known.filter_map(|(change, summary)| {
            let summary = summary?;
            let mut ages = summary.ages.iter();
            let age = ages.find(|of| (of.chain, &of.node) == (base.age.chain, &base.age.node));
            let age = age?.clone();
            Some(self.measured(change, summary, age))
        });
        measured.collect()
    }
}
