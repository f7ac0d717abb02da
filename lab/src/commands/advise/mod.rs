//! `ratelab advise`: what would make the data younger, or spare overruns, by what was measured.

mod text;

use std::{sync::Arc, time::Duration};

use ratelab::{Interrupt, Time, Topology};
use ratelab_experiment::{
    Config, Experiment, RunAge, Summary,
    advise::{AgeChange, Aim, changes, run_all},
    sweep::all_cores,
};
use ratelab_system::{DataChain, System, Unmatched, graph_file::key_of};

use crate::{
    cli::AdviseArgs,
    error::Error,
    options::{self, Defaults},
    output::{ProgressLine, note, print_result},
    program::Program,
    signals,
};

/// Defaults of the runs.
const DEFAULTS: Defaults =
    Defaults::virtual_only("advice runs on the virtual clock: leave --clock real out");

/// Number of changes that are tried two at a time, the best ones.
const FEW: usize = 12;

/// Runs every change of the graph, then pairs of the best changes if none of them is enough;
/// prints what they do. Ctrl-C keeps the finished ones.
pub fn advise(program: &Program, args: &AdviseArgs) -> Result<(), Error> {
    let (config, _) = options::graph(program, &args.graph, &DEFAULTS)?;
    let advisor = Advisor {
        program,
        args,
        config,
        interrupt: signals::interrupt(),
        aged: None,
    };
    let (summary, topology) = advisor.base()?;
    let aged = advisor.oldest(&summary).cloned();
    let late = late_nodes(&summary);
    let unmatched: Vec<String> = summary
        .silence()
        .unmatched
        .iter()
        .map(with_way_out)
        .collect();
    let aim = match &aged {
        Some(age) => Aim::Age(age),
        None if !late.is_empty() => Aim::Overruns(&late),
        None => {
            let why = if unmatched.is_empty() {
                NO_AIM.to_owned()
            } else {
                unmatched.join("; ")
            };
            let name = program.system.name();
            let why = format!("{name} has nothing to improve in this run: {why}");
            return Err(Error::BadInput(why));
        }
    };
    unmatched.iter().for_each(|text| note(text));
    let singles = changes(&*program.system, &summary.config.setup, &topology, &aim);
    let advisor = Advisor {
        aged: aged.as_ref(),
        ..advisor
    };
    let Some(base) = advisor.measured(AgeChange::default(), summary.clone()) else {
        return Err(Error::BadInput("the run has no age".to_owned()));
    };
    let mut measured = advisor.measure(singles);
    sort(&mut measured);
    if !is_enough(&base, &measured) {
        let both = advisor.better_pairs(&measured);
        measured.extend(both);
        sort(&mut measured);
    }
    let topic = text::Subject::new(program, aged.as_ref());
    let advice = text::render(&topic, &base, &measured);
    print_result(
        args.json,
        &text::Advice::new(&topic, &base, &measured),
        &advice,
    )?;
    if advisor.interrupt.is_asked() {
        let runs = measured.len();
        let why = format!("stopped after {runs} runs: the result is of these");
        return Err(Error::Unfinished(why));
    }
    Ok(())
}

/// Why no advice is given, if nothing more is known.
const NO_AIM: &str = "no node skipped a period, nothing came to the end of a [chain.NAME], and \
                      nothing was pushed";

/// Returns why a node never ticked, and what to try.
fn with_way_out(unmatched: &Unmatched<'_>) -> String {
    let (why, node) = (unmatched.text(), key_of(unmatched.node));
    format!(
        "{why}: try --with 'node.{node}.match = \"approximate:10\"', or messages that copy one \
         stamp (the key stamp)"
    )
}

/// Returns the nodes that skipped periods.
fn late_nodes(summary: &Summary) -> Vec<&str> {
    summary
        .nodes
        .iter()
        .filter(|node| node.overruns > 0)
        .map(|node| &*node.name)
        .collect()
}

/// Returns whether one of the `measured` changes has the limit kept, or no period skipped.
fn is_enough(base: &ChangedRun, measured: &[ChangedRun]) -> bool {
    let limited = base.within.is_some() || base.summary.verdict.is_lost();
    measured.iter().any(|run| match run.score {
        Score::Age { .. } => limited && !run.summary.verdict.is_lost(),
        Score::Overruns { skipped, .. } => skipped == 0,
    })
}

/// Returns the best of the `measured` changes two at a time, each of another node or topic.
fn pairs(measured: &[ChangedRun]) -> Vec<AgeChange> {
    let best: Vec<&AgeChange> = measured.iter().take(FEW).map(|run| &run.change).collect();
    let pairs = best.iter().enumerate().flat_map(|(place, one)| {
        let others = best[..place].iter().filter(|other| other.of != one.of);
        others.map(|other| other.and(one))
    });
    pairs.collect()
}

/// Puts the runs that are not lost first, of these the smallest score, then the fewest messages.
fn sort(measured: &mut [ChangedRun]) {
    measured.sort_by_key(|run| {
        let sent = run
            .summary
            .topics
            .iter()
            .map(|topic| topic.published)
            .fold(0, u64::saturating_add);
        (run.summary.verdict.is_lost(), run.score.rank(), sent)
    });
}

/// What all runs have in common.
struct Advisor<'a> {
    program: &'a Program,
    args: &'a AdviseArgs,
    config: Config,
    interrupt: Interrupt,
    /// The age in question; without one the overruns are.
    aged: Option<&'a RunAge>,
}

impl Advisor<'_> {
    /// Returns the run without a change, and its graph.
    fn base(&self) -> Result<(Summary, Topology), Error> {
        if self.config.end == Time::MAX {
            let why = "the runs of advice must end: give them --duration-s";
            return Err(Error::BadInput(why.to_owned()));
        }
        let mut experiment = Experiment::new(self.program.system.clone(), &self.config)?;
        let topology = experiment.observer().topology();
        experiment.watch_ages();
        let summary = experiment
            .run_until(&self.interrupt)?
            .filter(|_| !self.interrupt.is_asked());
        let stopped = || Error::Unfinished("stopped before the first result".to_owned());
        Ok((summary.ok_or_else(stopped)?, topology))
    }

    /// Returns the age in question: the one that is farthest from its limit.
    fn oldest<'s>(&self, summary: &'s Summary) -> Option<&'s RunAge> {
        let late = |age: &RunAge| {
            let chain = self.chain_of(age);
            chain
                .and_then(|chain| chain.excess(summary.sim_time, &summary.chains))
                .unwrap_or(f64::NEG_INFINITY)
        };
        summary
            .ages
            .iter()
            .rev()
            .max_by(|one, other| late(one).total_cmp(&late(other)))
    }

    /// Returns the chain whose age it is; `None` for a push.
    fn chain_of(&self, age: &RunAge) -> Option<&DataChain> {
        self.program
            .system
            .about()
            .chains
            .iter()
            .find(|chain| Some(chain.name()) == age.chain.as_deref())
    }

    /// Returns a run with its score; `None` if it has no age, where an age is.
    fn measured(&self, change: AgeChange, summary: Summary) -> Option<ChangedRun> {
        let Some(aged) = self.aged else {
            return Some(ChangedRun {
                score: Score::overruns(&summary),
                within: None,
                within_text: None,
                change,
                summary,
            });
        };
        let age = summary
            .ages
            .iter()
            .find(|age| (&age.chain, &age.node) == (&aged.chain, &aged.node))?;
        let (at, row, chain) = (summary.sim_time, &summary.chains, self.chain_of(aged));
        // The mean over run time is measured by the chain itself; parts are worked out afterwards.
        let mean_ms = match chain {
            Some(chain) => chain.mean_ms(at, row),
            None => summary.push_age().map(|age| age.run_s * 1e3),
        };
        Some(ChangedRun {
            score: Score::Age {
                mean_ns: (mean_ms? * 1e6).round() as i64,
                p99_ns: age.p99_ns,
            },
            within: chain.and_then(|chain| chain.within_share(at, row)),
            within_text: chain.and_then(|chain| chain.within_text(at, row)),
            change,
            summary,
        })
    }

    /// Runs with two of the `measured` changes that are better than with either alone.
    fn better_pairs(&self, measured: &[ChangedRun]) -> Vec<ChangedRun> {
        let mut both = self.measure(pairs(measured));
        both.retain(|both| {
            let is_part = |part: &&ChangedRun| part.change.is_part_of(&both.change);
            measured
                .iter()
                .filter(is_part)
                .all(|part| both.is_better(part))
        });
        both
    }

    /// Runs with each of `changes`, but for changes that the graph refuses.
    fn measure(&self, changes: Vec<AgeChange>) -> Vec<ChangedRun> {
        let runs = changes.into_iter().filter_map(|change| {
            let system: Arc<dyn System> = self.program.with(&change.with).ok()?.system;
            let mut config = self.config.clone();
            config.setup.extend(change.knobs.iter().cloned());
            Some((change, (system, config)))
        });
        let (changes, runs): (Vec<AgeChange>, Vec<_>) = runs.unzip();
        let bar = ProgressLine::for_runs(runs.len(), false, self.args.json);
        let threads = self.args.threads.unwrap_or_else(all_cores);
        let summaries = run_all(&runs, &self.interrupt, threads, || bar.advance());
        changes
            .into_iter()
            .zip(summaries)
            .filter_map(|(change, summary)| self.measured(change, summary?))
            .collect()
    }
}

/// The share of a score below which a change helps.
const HELPS: f64 = 0.99;

/// A run with a change, or without any.
pub struct ChangedRun {
    pub change: AgeChange,
    pub summary: Summary,
    pub score: Score,
    /// The share of the time within its limit, if any.
    pub within: Option<f64>,
    /// The same in words.
    pub within_text: Option<String>,
}

/// What is to become less.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Score {
    /// An age over run time (ns).
    Age { mean_ns: i64, p99_ns: i64 },
    /// Skipped periods of all nodes, of the due ones, and the mean lateness of their ticks.
    Overruns {
        skipped: u64,
        due: u64,
        lateness: Duration,
    },
}

impl Score {
    /// Creates the skipped periods in a run.
    pub fn overruns(summary: &Summary) -> Self {
        let nodes = || summary.nodes.iter();
        let skipped = nodes()
            .map(|node| node.overruns)
            .fold(0, u64::saturating_add);
        let ticks = nodes()
            .filter(|node| node.triggers.is_empty())
            .map(|node| node.ticks)
            .fold(0, u64::saturating_add);
        let late: Duration = nodes().map(|node| node.lateness.sum()).sum();
        let count = nodes().map(|node| node.lateness.count()).sum::<u64>();
        let count = u32::try_from(count).unwrap_or(u32::MAX).max(1);
        Self::Overruns {
            skipped,
            due: ticks.saturating_add(skipped),
            lateness: late / count,
        }
    }

    /// Returns what the best run has least of: first the score itself, then what it costs.
    pub fn rank(self) -> [u64; 2] {
        match self {
            Self::Age { mean_ns, .. } => [mean_ns.max(0).unsigned_abs(), 0],
            Self::Overruns {
                skipped, lateness, ..
            } => [skipped, lateness.as_nanos() as u64],
        }
    }
}

impl ChangedRun {
    /// Returns whether its score is clearly smaller than in the `other` run.
    pub fn is_better(&self, other: &Self) -> bool {
        let [mine, others] = [self, other].map(|run| run.score.rank()[0]);
        mine < others && mine as f64 <= HELPS * others as f64
    }
}
