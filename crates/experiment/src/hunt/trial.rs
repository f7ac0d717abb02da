//! Runs with faults in parallel, with an outcome independent of the threads; and lists of faults
//! that are shrunk by them until every part is necessary.

use std::ops::ControlFlow;

use ratelab_system::Verdict;

use super::{Budget, Hunt, HuntError, Proof, fault::FaultPart};
use crate::{Experiment, Summary, parallel::in_parallel};

/// The reason for the end of a search.
pub(super) enum Halt {
    /// A request to stop.
    Stopped,
    /// A run failed.
    Failed(HuntError),
}

/// Runs with faults.
pub(super) struct Trials<'h> {
    hunt: &'h Hunt,
    budget: &'h Budget,
    stop: &'h (dyn Fn() -> bool + Sync),
    runs: usize,
    /// The lists that were found to lose the run, each with its verdict.
    lost: Vec<(Vec<FaultPart>, Verdict)>,
}

impl<'h> Trials<'h> {
    /// Creates the trials of `hunt`, which end when `stop` returns `true`.
    pub fn new(hunt: &'h Hunt, budget: &'h Budget, stop: &'h (dyn Fn() -> bool + Sync)) -> Self {
        Self {
            hunt,
            budget,
            stop,
            runs: 0,
            lost: Vec::new(),
        }
    }

    /// Returns the number of lists tried. Runs begun in parallel after a list that is enough are not
    /// counted, unless the hunt is stopped: their number depends on the threads.
    pub fn runs(&self) -> usize {
        self.runs
    }

    /// Returns the summary of the run with the faults of `list`; `None` if it was stopped.
    pub fn summary(&self, list: &[FaultPart]) -> Result<Option<Summary>, HuntError> {
        let config = self.hunt.with(&self.budget.knobs(list));
        let experiment = Experiment::from_resolved(self.hunt.system.clone(), config)?;
        Ok(experiment.run_until(&self.hunt.interrupt)?)
    }

    /// Returns the first of the smallest lists within the budget that were found to lose the run,
    /// with its verdict.
    pub fn best(&self) -> Option<&(Vec<FaultPart>, Verdict)> {
        self.lost
            .iter()
            .filter(|(list, _)| self.budget.allows(list))
            .min_by_key(|(list, _)| list.len())
    }

    /// Returns the verdict on a run to its end; `None` if it was stopped.
    fn try_one(&self, list: &[FaultPart]) -> Option<Result<Verdict, HuntError>> {
        if (self.stop)() || self.hunt.interrupt.is_asked() {
            return None;
        }
        let summary = self.summary(list).transpose()?;
        Some(summary.map(|run| run.verdict))
    }

    /// Returns the index of the first of `lists` that loses the run.
    pub fn first_lost(&mut self, lists: &[Vec<FaultPart>]) -> Result<Option<usize>, Halt> {
        let mut first: Option<(usize, Result<Verdict, HuntError>)> = None;
        let mut tried = 0;
        let (threads, trials) = (self.hunt.threads, &*self);
        let run = |index: usize| trials.try_one(&lists[index]);
        // All lists before the first that is enough are run to their end.
        let complete = in_parallel(threads, lists.len(), run, |index, verdict| {
            tried += 1;
            if matches!(&verdict, Ok(verdict) if !verdict.is_lost()) {
                return ControlFlow::Continue(());
            }
            if first.as_ref().is_none_or(|(known, _)| index < *known) {
                first = Some((index, verdict));
            }
            ControlFlow::Break(())
        });
        let index = first.as_ref().map(|(index, _)| *index);
        self.runs += match index {
            _ if !complete => tried,
            Some(index) => index + 1,
            None => lists.len(),
        };
        if let Some((index, verdict)) = first {
            let verdict = verdict.map_err(Halt::Failed)?;
            self.lost.push((lists[index].clone(), verdict));
        }
        if complete {
            Ok(index)
        } else {
            Err(Halt::Stopped)
        }
    }
}

/// Maximum number of smaller lists that are all run.
pub const MOST_SMALLER: usize = 4_096;

/// Shrinks `list`, which loses the run. Each step is stored in `list` before the next begins.
pub(super) fn shrink(list: &mut Vec<FaultPart>, trials: &mut Trials<'_>) -> Result<Proof, Halt> {
    delta_debug(list, trials)?;
    let Some(smaller) = all_smaller(list) else {
        return Ok(Proof::EachPart(list.len()));
    };
    // Ordered by size: all lists smaller than the first have been run.
    if let Some(index) = trials.first_lost(&smaller)? {
        list.clone_from(&smaller[index]);
    }
    Ok(Proof::EverySmaller(
        all_smaller(list).map_or(0, |smaller| smaller.len()),
    ))
}

/// Leaves out ever smaller pieces, until every single part is necessary.
pub(super) fn delta_debug(list: &mut Vec<FaultPart>, trials: &mut Trials<'_>) -> Result<(), Halt> {
    let mut pieces = 2;
    while list.len() > 1 {
        let cuts: Vec<usize> = (0..=pieces).map(|cut| cut * list.len() / pieces).collect();
        let alone = cuts.windows(2).map(|cut| list[cut[0]..cut[1]].to_vec());
        let without = cuts
            .windows(2)
            .map(|cut| [&list[..cut[0]], &list[cut[1]..]].concat());
        let lists: Vec<Vec<FaultPart>> = match pieces {
            2 => alone.collect(), // Each is the complement of the other.
            _ => alone.chain(without).collect(),
        };
        match trials.first_lost(&lists)? {
            Some(index) => {
                list.clone_from(&lists[index]);
                pieces = if index < pieces { 2 } else { pieces - 1 };
            }
            None if pieces >= list.len() => return Ok(()),
            None => pieces *= 2,
        }
        pieces = pieces.min(list.len()).max(2);
    }
    Ok(())
}

/// Returns all sublists of `list` by size, without the empty one and `list` itself; `None` if
/// there are too many.
fn all_smaller(list: &[FaultPart]) -> Option<Vec<Vec<FaultPart>>> {
    let mut sorted = list.to_vec();
    sorted.sort_unstable();
    let mut lists = vec![Vec::new()];
    for same in sorted.chunk_by(|one, next| one == next) {
        if lists.len() * (same.len() + 1) > MOST_SMALLER {
            return None;
        }
        let longer = lists.iter().flat_map(|list| {
            (0..=same.len()).map(move |count| [list.as_slice(), &same[..count]].concat())
        });
        lists = longer.collect();
    }
    lists.retain(|smaller: &Vec<FaultPart>| !smaller.is_empty() && smaller.len() < list.len());
    lists.sort_by_key(Vec::len);
    Some(lists)
}

#[cfg(test)]
mod tests {
    use std::{num::NonZeroUsize, sync::Arc};

    use ratelab::Time;
    use ratelab_system::graph_file::GraphFile;

    use super::*;
    use crate::Config;

    /// A control loop whose data may be 350 ms old: three images in a row must be lost.
    const ROBOT: &str = "
        name = 'robot'
        node.camera = { rate = 10, publishes = ['/image'] }
        node.control = { rate = 10, reads = ['/image'], publishes = ['/cmd'] }
        chain.see = { path = ['camera', '/image', 'control', '/cmd'], age_ms = 350 }
    ";

    fn hunt() -> Hunt {
        let file = GraphFile::parse(ROBOT).expect("a graph");
        let config = Config {
            end: Time::from_nanos(1_500_000_000),
            ..Config::default()
        };
        Hunt {
            threads: NonZeroUsize::MIN,
            ..Hunt::new(Arc::new(file.system(&[]).expect("a system")), config)
        }
    }

    fn budget() -> Budget {
        Budget {
            topic: "/image".to_owned(),
            lose: 9,
            ..Budget::default()
        }
    }

    fn lost(messages: &[u64]) -> Vec<FaultPart> {
        messages.iter().copied().map(FaultPart::Lost).collect()
    }

    #[test]
    fn the_smaller_lists_come_by_size_without_the_empty_one_and_the_whole() {
        let (a, b) = (FaultPart::Lost(1), FaultPart::Late(2));
        let smaller = all_smaller(&[b, a, b]).expect("few");
        assert_eq!(smaller, [vec![b], vec![a], vec![b, b], vec![a, b]]);
        // 2 to the power of 13 are too many.
        assert_eq!(all_smaller(&lost(&Vec::from_iter(0..13))), None);
    }

    #[test]
    fn a_list_shrinks_to_the_parts_that_it_takes() {
        let (hunt, budget) = (hunt(), budget());
        let mut trials = Trials::new(&hunt, &budget, &|| false);
        let mut list = lost(&[1, 3, 4, 5, 6, 9, 11]);
        let proof = shrink(&mut list, &mut trials).ok().expect("no run fails");
        assert_eq!(list.len(), 3, "{list:?}");
        assert_eq!(proof, Proof::EverySmaller(6));
        let adjacent = list.windows(2).all(|pair| match pair {
            [FaultPart::Lost(one), FaultPart::Lost(next)] => next - one == 1,
            _ => false,
        });
        assert!(adjacent, "{list:?}");
    }

    #[test]
    fn the_first_list_that_loses_the_run_counts_and_later_ones_do_not() {
        let (hunt, budget) = (hunt(), budget());
        let mut trials = Trials::new(&hunt, &budget, &|| false);
        let lists = [lost(&[2, 3]), lost(&[2, 3, 4]), lost(&[5, 6, 7, 8])];
        assert_eq!(trials.first_lost(&lists).ok(), Some(Some(1)));
        assert_eq!(trials.runs(), 2);
        assert_eq!(trials.best().map(|(list, _)| list), Some(&lists[1]));
        assert_eq!(trials.first_lost(&lists[..1]).ok(), Some(None));
    }

    #[test]
    fn a_search_that_is_stopped_has_tried_nothing_more() {
        let (hunt, budget) = (hunt(), budget());
        let mut trials = Trials::new(&hunt, &budget, &|| true);
        let stopped = trials.first_lost(&[lost(&[2, 3, 4])]);
        assert!(matches!(stopped, Err(Halt::Stopped)));
        assert_eq!((trials.runs(), trials.best()), (0, None));
    }
}
