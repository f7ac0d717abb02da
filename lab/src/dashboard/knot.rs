//! Ticks that overlap, as far as their operations are done.

use ratelab::{Time, Topology};
use ratelab_replay::Overlap;

/// The thread that supervises the nodes.
const SUPERVISOR: &str = "supervisor";

/// The operations of ticks that overlap, in order, and the position among them.
#[derive(Clone, Debug, PartialEq)]
pub struct KnotView {
    /// Run time at which the first of the ticks began.
    pub from: Time,
    /// The names of the nodes that take part.
    pub lanes: Vec<String>,
    /// The operations: the lane, and the topic or shared value with its turn.
    pub operations: Vec<(usize, String)>,
    /// Number of operations done.
    pub done: usize,
}

impl KnotView {
    /// The first `done` operations of `knot` in a graph of this `topology`.
    pub fn of(knot: &Overlap, topology: &Topology, done: usize) -> Self {
        let mut nodes: Vec<_> = knot.operations.iter().map(|of| of.node).collect();
        nodes.sort_unstable();
        nodes.dedup();
        let name = |node: &Option<usize>| {
            let node = node.and_then(|node| topology.nodes.get(node));
            node.map_or(SUPERVISOR.to_owned(), |node| node.name.clone())
        };
        let operations = knot.operations.iter().map(|of| {
            let lane = nodes.partition_point(|node| *node < of.node);
            (lane, format!("{}, turn {}", of.takes, of.turn))
        });
        Self {
            from: knot.from,
            operations: operations.collect(),
            lanes: nodes.iter().map(name).collect(),
            done,
        }
    }

    /// The last operation that is done, in a sentence.
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

/// The operation after the one at `here`, a knot and a number of operations, or before it;
/// without one, the first of the knot that goes on at run time `at` or comes after it, or the
/// last of the knot begun there or before.
pub fn neighbour(
    knots: &[Overlap],
    here: Option<(usize, usize)>,
    at: Time,
    later: bool,
) -> Option<(usize, usize)> {
    let last = |knot: usize| Some((knot, knots.get(knot)?.operations.len()));
    let over = || knots.partition_point(|knot| knot.to <= at);
    let begun = || knots.partition_point(|knot| knot.from <= at);
    match (here, later) {
        (Some((knot, done)), true) if last(knot)?.1 > done => Some((knot, done + 1)),
        (Some((knot, done)), false) if done > 1 => Some((knot, done - 1)),
        (Some((knot, _)), true) => last(knot + 1).map(|(knot, _)| (knot, 1)),
        (None, true) => last(over()).map(|(knot, _)| (knot, 1)),
        (Some((knot, _)), false) => last(knot.checked_sub(1)?),
        (None, false) => last(begun().checked_sub(1)?),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ratelab_replay::OverlapOperation;

    #[test]
    fn operations_follow_each_other_within_and_between_knots() {
        let knot = |from: u64, operations: usize| Overlap {
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
        let knots = [knot(10, 2), knot(30, 3)];
        let mut here = None;
        let mut forwards = Vec::new();
        while let Some(next) = neighbour(&knots, here, Time::ZERO, true) {
            here = Some(next);
            forwards.push(next);
        }
        assert_eq!(forwards, [(0, 1), (0, 2), (1, 1), (1, 2), (1, 3)]);
        let mut backwards = forwards.split_off(4);
        while let Some(next) = neighbour(&knots, here, Time::ZERO, false) {
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
            assert_eq!(neighbour(&knots, None, at, later), found, "{at} {later}");
        }
    }
}
