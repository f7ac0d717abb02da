//! The newest plan of a run, and ticks that overlap in it.

use std::{collections::VecDeque, time::Duration};

use ratelab::{Time, Topology};
use ratelab_metrics::Rows;
use ratelab_re_execution::Overlap;
use ratelab_recording::{Execution, Held};
use ratelab_system::{ActionPlan, PlanBars, Planning};

use ratelab_experiment::millis::mean;

use crate::{error::KeyError, frame::PlanData};

/// Plans, actions and ages kept: 40 s of actions at 50 Hz.
const KEPT: usize = 2_000;

/// What is kept of plans between frames.
#[derive(Default)]
pub struct Plans {
    /// The plans from the one before the newest on, each with its number.
    plans: VecDeque<(u64, ActionPlan)>,
    /// Number of the newest plan that was taken, and run time of that.
    newest: Option<(u64, Time)>,
    /// The last expected delay with an error of an action's period or more, and the real one.
    missed: Option<[Duration; 2]>,
    /// Number of the one taken before.
    before: Option<u64>,
    /// Run time and action, the newest last.
    played: VecDeque<(Time, f64)>,
    /// Run time and predicted part of the age of an action, the newest last.
    predicted: VecDeque<(Time, Duration)>,
    /// The plans as bars.
    pub bars: PlanBars,
    stalls: u64,
    /// Run time of the last one.
    stalled: Option<Time>,
}

impl Plans {
    /// Adds the messages on `topic`, if it is one of these.
    pub fn remember(&mut self, planning: &Planning, topic: &str, rows: &Rows) {
        for (head, row) in rows.iter() {
            if topic == planning.plans {
                let plan = (planning.plan)(head, row);
                if let Some(plan) = &plan {
                    self.bars.plan(head.seq, plan);
                }
                keep(&mut self.plans, plan.map(|plan| (head.seq, plan)));
            } else if topic == planning.played {
                keep(&mut self.played, Some((head.at, (planning.action)(row))));
            } else if let Some(step) = (planning.step)(row).filter(|_| topic == planning.steps) {
                self.bars.step(head.at, &step);
                self.stalls += u64::from(step.stalls);
                self.stalled = step.stalls.then_some(head.at).or(self.stalled);
                let predicted = step.predicted.map(|predicted| (head.at, predicted));
                keep(&mut self.predicted, predicted);
                if step.took {
                    self.take(step.newest, head.at);
                }
            }
        }
        self.bars.keep(KEPT);
    }

    fn take(&mut self, number: u64, at: Time) {
        self.before = self.newest.map(|(newest, _)| newest);
        self.newest = Some((number, at));
        if let Some(plan) = self.plan(number) {
            let delay = at.since(plan.made);
            let missed = plan.expected.abs_diff(delay) >= plan.period;
            self.missed = missed.then_some([plan.expected, delay]).or(self.missed);
        }
        if let Some(before) = self.before {
            self.plans.retain(|(known, _)| *known >= before);
        }
    }

    fn plan(&self, number: u64) -> Option<&ActionPlan> {
        let mut plans = self.plans.iter();
        plans
            .find(|(known, _)| *known == number)
            .map(|(_, plan)| plan)
    }

    /// Returns the newest plan at run time `now`; `None` before the first.
    pub fn at(&self, planning: &Planning, now: Time) -> Option<PlanData> {
        let (number, taken) = self.newest?;
        let newest = self.plan(number)?;
        let before = self.before.and_then(|number| self.plan(number));
        let place = newest.place(now)?;
        let around = (0..newest.actions.len()).map(|at| {
            let begins = newest.begins + newest.period * at as u32;
            if at <= place {
                self.played_until(begins + newest.period)
            } else {
                before?.action(begins)
            }
        });
        Some(PlanData {
            kind: newest.kind,
            most: planning.most,
            around: around.collect(),
            now: place,
            taken: newest.place(taken).unwrap_or(0),
            left: newest.ends().since(now),
            stalls: self.stalls,
            stalled: self.stalled,
            needed: before
                .and_then(|before| before.place(taken))
                .unwrap_or(0)
                .max(place)
                + 1,
            delay: taken.since(newest.made),
            missed: self.missed,
            actions: newest.actions.clone(),
        })
    }

    /// Returns the last action that was played before run time `end`.
    fn played_until(&self, end: Time) -> Option<f64> {
        let after = self.played.partition_point(|(at, _)| *at < end);
        let (_, action) = self.played.get(after.checked_sub(1)?)?;
        Some(*action)
    }

    /// Returns the mean predicted part of the ages of the actions played in a stretch of run time.
    pub fn predicted(&self, (from, to): (Time, Time)) -> Option<Duration> {
        let within = |at: Time| from < at && at <= to;
        let recent = self.predicted.iter().filter(|(at, _)| within(*at));
        mean(recent.map(|(_, part)| *part))
    }
}

/// Adds `new` to `kept`, whose oldest ones are dropped.
fn keep<T>(kept: &mut VecDeque<T>, new: Option<T>) {
    kept.extend(new);
    if kept.len() > KEPT {
        kept.pop_front();
    }
}

/// The thread that supervises the nodes.
const SUPERVISOR: &str = "supervisor";

/// The operations of ticks that overlap, in order, and the position among them.
#[derive(Clone, Debug, PartialEq)]
pub struct OverlapView {
    /// Run time at which the first of the ticks began.
    pub from: Time,
    /// The names of the nodes that take part.
    pub lanes: Vec<String>,
    /// The operations: the lane, and the topic or shared value with its turn.
    pub operations: Vec<(usize, String)>,
    /// Number of operations done.
    pub done: usize,
}

impl OverlapView {
    /// Creates the first `done` operations of `ticks` that overlap, in a graph of this `topology`.
    pub fn new(ticks: &Overlap, topology: &Topology, done: usize) -> Self {
        let mut nodes: Vec<_> = ticks.operations.iter().map(|of| of.node).collect();
        nodes.sort_unstable();
        nodes.dedup();
        let name = |node: &Option<usize>| {
            let known = node.and_then(|node| topology.nodes.get(node));
            known.map_or(SUPERVISOR.to_owned(), |node| node.name.clone())
        };
        let operations = ticks.operations.iter().map(|of| {
            let lane = nodes.partition_point(|node| *node < of.node);
            (lane, format!("{}, turn {}", of.takes, of.turn))
        });
        Self {
            from: ticks.from,
            operations: operations.collect(),
            lanes: nodes.iter().map(name).collect(),
            done,
        }
    }

    /// Returns the last operation that is done, in a sentence.
    pub fn sentence(&self) -> String {
        let (done, all) = (self.done, self.operations.len());
        let last = done
            .checked_sub(1)
            .and_then(|last| self.operations.get(last));
        let what = last.map(|(lane, what)| format!("{} locks {what}", self.lanes[*lane]));
        let (from, what) = (self.from.as_secs_f64(), what.unwrap_or_default());
        format!("{from:.6} s: operation {done} of {all}: {what}")
    }
}

/// Returns the operation after the one at `here`, a number in `overlaps` and a number of
/// operations, or before it; without one, the first of the ticks that go on at run time `at` or
/// come after it, or the last of the ticks begun there or before.
pub fn neighbour(
    overlaps: &[Overlap],
    here: Option<(usize, usize)>,
    at: Time,
    later: bool,
) -> Option<(usize, usize)> {
    let last = |number: usize| Some((number, overlaps.get(number)?.operations.len()));
    let over = || overlaps.partition_point(|ticks| ticks.to <= at);
    let begun = || overlaps.partition_point(|ticks| ticks.from <= at);
    match (here, later) {
        (Some((number, done)), true) if last(number)?.1 > done => Some((number, done + 1)),
        (Some((number, done)), false) if done > 1 => Some((number, done - 1)),
        (Some((number, _)), true) => last(number + 1).map(|(number, _)| (number, 1)),
        (None, true) => last(over()).map(|(number, _)| (number, 1)),
        (Some((number, _)), false) => last(number.checked_sub(1)?),
        (None, false) => last(begun().checked_sub(1)?),
    }
}

/// A run that is held within ticks that overlap.
pub struct HeldOverlap {
    /// The run.
    pub run: Held,
    /// Which of the run's overlaps it is in, or will be, and the number of operations to be done.
    pub place: (usize, usize),
    /// Number of operations done; `None` until it is there.
    pub done: Option<usize>,
}

impl HeldOverlap {
    /// Begins to execute a run again up to `place`; `None` if none of its ticks overlap.
    pub fn begin(execution: Execution, place: (usize, usize)) -> Option<Self> {
        let run = execution.hold(place.0, place.1)?;
        let done = None;
        Some(Self { run, place, done })
    }

    /// Goes on to `place` if that is a later operation of the same ticks; returns whether it
    /// is.
    pub fn goes_on_to(&mut self, place: (usize, usize)) -> bool {
        let later = place.0 == self.place.0 && place.1 > self.place.1;
        if later {
            self.run.allow(place.1);
            self.place = place;
        }
        later
    }

    /// Follows the run on its way to its place; returns whether it has come there since the
    /// last call, or else how far it is.
    pub fn follow(&mut self) -> Result<bool, KeyError> {
        let Some(done) = self.run.done() else {
            return Err(KeyError::Executing(self.run.observer().now()));
        };
        // Locks within each other are done at once.
        let new = self.done.replace(done) != Some(done);
        if new {
            self.place.1 = done;
        }
        Ok(new)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ratelab_re_execution::OverlapOperation;

    #[test]
    fn operations_follow_each_other_within_and_between_overlaps() {
        let ticks = |from: u64, operations: usize| Overlap {
            from: Time::from_nanos(from),
            to: Time::from_nanos(from + 5),
            operations: vec![
                OverlapOperation {
                    node: None,
                    at: Time::ZERO,
                    takes: "/obs".into(),
                    turn: 0,
                };
                operations
            ],
        };
        let overlaps = [ticks(10, 2), ticks(30, 3)];
        let mut here = None;
        let mut forwards = Vec::new();
        while let Some(next) = neighbour(&overlaps, here, Time::ZERO, true) {
            here = Some(next);
            forwards.push(next);
        }
        assert_eq!(forwards, [(0, 1), (0, 2), (1, 1), (1, 2), (1, 3)]);
        let mut backwards = forwards.split_off(4);
        while let Some(next) = neighbour(&overlaps, here, Time::ZERO, false) {
            here = Some(next);
            backwards.push(next);
        }
        assert_eq!(backwards, [(1, 3), (1, 2), (1, 1), (0, 2), (0, 1)]);
        for (at, later, found) in [
            (9, true, Some((0, 1))),
            (10, true, Some((0, 1))),
            (14, true, Some((0, 1))),
            (15, true, Some((1, 1))),
            (35, true, None),
            (9, false, None),
            (10, false, Some((0, 2))),
            (29, false, Some((0, 2))),
        ] {
            let at = Time::from_nanos(at);
            assert_eq!(neighbour(&overlaps, None, at, later), found, "{at} {later}");
        }
    }
}
