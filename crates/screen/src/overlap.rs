//! Ticks of a run that overlap, and the run held within such ticks.

use ratelab::{Time, Topology};
use ratelab_re_execution::Overlap;
use ratelab_recording::{Execution, Held};

use crate::error::KeyError;

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
            node.and_then(|node| topology.nodes.get(node))
                .map_or(SUPERVISOR.to_owned(), |node| node.name.clone())
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
        let what = done
            .checked_sub(1)
            .and_then(|last| self.operations.get(last))
            .map(|(lane, what)| format!("{} locks {what}", self.lanes[*lane]));
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
