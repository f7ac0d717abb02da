//! The closed loop with constant delays, over one period, as one matrix.

use std::collections::VecDeque;

use nalgebra::DMatrix;
use ratelab::Hz;

use crate::{
    cascade::{COMMAND, INNER_OBS},
    linear::LinearRobot,
    nodes::ACTION,
};

/// What may be late, by its topic: the commands of the policy, the readings of an inner loop, actions.
pub(crate) const LATE: [&str; 3] = [COMMAND, INNER_OBS, ACTION];

/// The longest period of two loops that is looked at (steps of physics).
const LONGEST: u64 = 100_000;

/// The rates of the policy, and of an inner loop.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LoopRates {
    pub(crate) policy: Hz,
    pub(crate) inner: Option<Hz>,
}

/// When the loops of a robot decide, and how late their data are, in steps of physics.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LoopTimes {
    /// From one decision of the policy to the next.
    pub(crate) policy: u64,
    /// From one decision of the inner loop to the next; of a loop alone that is the policy's.
    inner: u64,
    /// From one tick of both to the next.
    all: u64,
    /// The same (s).
    pub(crate) all_s: f64,
    /// The delay of each of [`LATE`].
    pub(crate) late: [u64; 3],
}

impl LoopTimes {
    /// Returns the times of a loop alone without a delay, which decides at `hz`, every `steps`.
    pub(crate) fn alone(hz: Hz, steps: u64) -> Self {
        Self {
            policy: steps,
            inner: steps,
            all: steps,
            all_s: hz.period().as_secs_f64(),
            late: [0; 3],
        }
    }

    /// Returns the times with an inner loop that decides every `inner` steps; `None` for loops that
    /// tick together too rarely.
    pub(crate) fn around(self, inner: u64) -> Option<Self> {
        let all = (1..=LONGEST / self.policy)
            .map(|times| times * self.policy)
            .find(|all| all % inner == 0)?;
        Some(Self {
            inner,
            all,
            all_s: self.all_s * (all / self.policy) as f64,
            ..self
        })
    }

    /// Returns how often data of each kind begin.
    fn periods(self) -> [u64; 3] {
        [self.policy, self.inner, self.inner]
    }

    /// Returns how many of the newest data of a kind are too new to be there in a step.
    fn too_new(self, step: u64, kind: usize) -> usize {
        let [step, period, late] = [step, self.periods()[kind], self.late[kind]].map(|n| n as i64);
        (step.div_euclid(period) - (step - late).div_euclid(period)) as usize
    }

    /// Returns how many data of each kind a period has from the periods before.
    fn kept(self) -> [usize; 3] {
        let pairs = [0, 1, 2].map(|kind| (self.late[kind], self.periods()[kind]));
        pairs.map(|(late, period)| late.div_ceil(period) as usize)
    }
}

/// The linear feedback of a robot, split between two loops or in one.
pub(crate) struct LoopGains {
    /// The gains of the policy in front of an inner loop.
    pub(crate) outer: Option<DMatrix<f64>>,
    /// The gains of the inner loop, or of the only one.
    pub(crate) inner: DMatrix<f64>,
}

impl LoopGains {
    /// Returns the motion of deviations over one period: of the state, then of the data on their way.
    pub(crate) fn closed(&self, robot: &LinearRobot, times: LoopTimes) -> DMatrix<f64> {
        let (states, controls) = (robot.a.nrows(), robot.b.ncols());
        let mut kept = times.kept();
        if self.outer.is_none() {
            kept[0] = 0;
        }
        let size = states + kept.iter().sum::<usize>() * controls;
        let all = DMatrix::identity(size, size);
        let mut state: DMatrix<f64> = all.rows(0, states).into_owned();
        let mut row = states;
        let mut ways = kept.map(|count| {
            let first = row;
            row += count * controls;
            (0..count)
                .map(|index| all.rows(first + index * controls, controls).into_owned())
                .collect::<VecDeque<_>>()
        });
        for step in 0..times.all {
            if let Some(gains) = self.outer.as_ref().filter(|_| step % times.policy == 0) {
                ways[0].push_front(-(gains * &state));
                ways[0].truncate(kept[0] + 1);
            }
            if step % times.inner == 0 {
                ways[1].push_front(-(&self.inner * &state));
                let own = ways[1][times.too_new(step, 1)].clone();
                let command = ways[0].get(times.too_new(step, 0));
                ways[2].push_front(command.map_or(own.clone(), |command| command + &own));
                ways[1].truncate(kept[1]);
                ways[2].truncate(kept[2] + 1);
            }
            let action = &ways[2][times.too_new(step, 2)];
            state = &robot.a * state + &robot.b * action;
        }
        let mut closed = DMatrix::zeros(size, size);
        closed.rows_mut(0, states).copy_from(&state);
        let on_their_way = ways
            .iter()
            .zip(kept)
            .flat_map(|(way, count)| way.iter().take(count));
        for (index, data) in on_their_way.enumerate() {
            let first = states + index * controls;
            closed.rows_mut(first, controls).copy_from(data);
        }
        closed
    }
}
