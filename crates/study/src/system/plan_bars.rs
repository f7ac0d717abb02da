//! Plans as bars over run time, and which part of each was played.

use std::collections::{BTreeMap, VecDeque};

use ratelab::Time;
use ratelab_account::Rows;

use super::{ActionPlan, Planning, PlayStep};

/// Adds up which plan was played when.
#[derive(Debug, Default)]
pub struct PlanBars {
    /// Number, begin and end of each plan.
    plans: VecDeque<(u64, [Time; 2])>,
    /// The stretches in which it was the newest while an action was played, by number.
    played: BTreeMap<u64, Vec<[Time; 2]>>,
    /// Number of the plan that is being played.
    playing: Option<u64>,
}

/// A plan over run time.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanBar {
    /// Its number on the topic of plans, counted from zero.
    pub number: u64,
    /// From the moment that its first action is meant for to the end of its last one, without
    /// gaps: what was played of it, and what was not.
    pub parts: Vec<BarPart>,
}

/// A stretch of a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BarPart {
    /// Its begin.
    pub from: Time,
    /// Its end.
    pub to: Time,
    /// Whether this plan was played then: it was the newest, and the node had an action.
    pub played: bool,
}

impl BarPart {
    /// The word for a part that was played.
    pub const PLAYED: &str = "played";
    /// The word for any other part.
    pub const PLANNED: &str = "planned";

    /// What it is, in a word.
    pub fn word(&self) -> &'static str {
        match self.played {
            true => Self::PLAYED,
            false => Self::PLANNED,
        }
    }
}

impl PlanBars {
    /// The bars of a run whose messages are in `rows`, by name of their topic.
    pub fn of<'r>(planning: &Planning, rows: impl Fn(&str) -> Option<&'r Rows>) -> Self {
        let mut bars = Self::default();
        let messages = |topic| rows(topic).into_iter().flat_map(Rows::iter);
        for (head, row) in messages(planning.plans) {
            if let Some(plan) = (planning.plan)(head, row) {
                bars.plan(head.seq, &plan);
            }
        }
        for (head, row) in messages(planning.steps) {
            if let Some(step) = (planning.step)(row) {
                bars.step(head.at, &step);
            }
        }
        bars
    }

    /// Adds the plan with this number.
    pub fn plan(&mut self, number: u64, plan: &ActionPlan) {
        self.plans.push_back((number, [plan.begins, plan.ends()]));
    }

    /// Adds what was done with plans at run time `at`.
    pub fn step(&mut self, at: Time, step: &PlayStep) {
        if step.stalls {
            self.playing = None;
        }
        if step.predicted.is_none() {
            return;
        }
        let until = at + step.period;
        let playing = self.playing.replace(step.newest);
        let last = playing.and_then(|number| self.played.get_mut(&number)?.last_mut());
        match last {
            // A tick may be late.
            Some([_, end]) if playing == Some(step.newest) && at <= *end + step.period => {
                *end = until;
                return;
            }
            Some([_, end]) => *end = at.min(*end),
            None => {}
        }
        let stretches = self.played.entry(step.newest).or_default();
        stretches.push([at, until]);
    }

    /// Forgets the oldest plans, so that at most so many are left.
    pub fn keep(&mut self, most: usize) {
        let old = self.plans.len().saturating_sub(most);
        self.plans.drain(..old);
        if let Some((oldest, _)) = self.plans.front().filter(|_| old > 0) {
            self.played = self.played.split_off(oldest);
        }
    }

    /// The bars in the order of their plans, in as many lanes as it takes: in none of them two
    /// touch.
    pub fn lanes(&self) -> Vec<Vec<PlanBar>> {
        let mut lanes: Vec<Vec<PlanBar>> = Vec::new();
        for (number, stretch) in &self.plans {
            let played = self.played.get(number).map_or(&[][..], Vec::as_slice);
            let parts = parts(*stretch, played);
            let Some(first) = parts.first() else {
                continue;
            };
            let is_over = |bar: &PlanBar| bar.parts.last().is_none_or(|last| last.to < first.from);
            let free = lanes
                .iter()
                .position(|lane| lane.last().is_none_or(is_over));
            let bar = PlanBar {
                number: *number,
                parts,
            };
            match free {
                Some(lane) => lanes[lane].push(bar),
                None => lanes.push(vec![bar]),
            }
        }
        lanes
    }
}

/// The parts of a plan, of which these stretches were played; they may go on after its end.
fn parts([begins, ends]: [Time; 2], played: &[[Time; 2]]) -> Vec<BarPart> {
    let mut parts = Vec::new();
    let mut at = begins;
    let mut add = |to: Time, played| {
        if to > at {
            parts.push(BarPart {
                from: at,
                to,
                played,
            });
            at = to;
        }
    };
    for [from, to] in played {
        add(*from, false);
        add(*to, true);
    }
    add(ends, false);
    parts
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    const PERIOD: Duration = Duration::from_millis(20);

    fn ms(ms: u64) -> Time {
        Time::from_nanos(ms * 1_000_000)
    }

    /// Bars of plans of four actions that begin at these times (ms), played as in `steps`: run
    /// time (ms), newest plan, and whether there was an action.
    fn bars(begins: &[u64], steps: &[(u64, u64, bool)]) -> String {
        let mut bars = PlanBars::default();
        for (number, begins) in (0..).zip(begins) {
            let plan = ActionPlan {
                kind: "rollout",
                made: ms(*begins),
                expected: PERIOD,
                begins: ms(*begins),
                period: PERIOD,
                actions: [0.0; 4].into(),
            };
            bars.plan(number, &plan);
        }
        for (at, newest, plays) in steps {
            let step = PlayStep {
                newest: *newest,
                took: false,
                stalls: !plays,
                period: PERIOD,
                predicted: plays.then_some(Duration::ZERO),
            };
            bars.step(ms(*at), &step);
        }
        let part = |part: &BarPart| {
            let sign = if part.played { '=' } else { '-' };
            format!("{sign}{}", part.to.as_nanos() / 1_000_000)
        };
        let drawn = |(lane, bar): (usize, &PlanBar)| {
            let parts: String = bar.parts.iter().map(part).collect();
            let from = bar.parts[0].from.as_nanos() / 1_000_000;
            (bar.number, format!("{lane}:{from}{parts}"))
        };
        let lanes = bars.lanes();
        let lanes = lanes.iter().enumerate();
        let bars = lanes.flat_map(|(lane, bars)| bars.iter().map(move |bar| (lane, bar)));
        let by_number: BTreeMap<u64, String> = bars.map(drawn).collect();
        by_number.into_values().collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn a_bar_has_what_was_played_and_shares_its_lane_with_none_that_touches_it() {
        for (begins, steps, drawn) in [
            (&[0][..], &[][..], "0:0-80"),
            // Taken after a while, until the next one was taken.
            (
                &[0, 40],
                &[(20, 0, true), (40, 0, true), (60, 1, true), (80, 1, true)],
                "0:0-20=60-80 1:40-60=100-120",
            ),
            // A late tick is no gap, a stall is one.
            (
                &[0],
                &[(0, 0, true), (25, 0, true), (45, 0, false), (65, 0, true)],
                "0:0=45-65=85",
            ),
            // The next one is taken within the action, and what is free at last is a lane again.
            (
                &[0, 60, 80, 90],
                &[(0, 0, true), (10, 1, true), (80, 2, true)],
                "0:0=10-80 1:60-140 2:80=100-160 0:90-170",
            ),
            // Played for longer than meant: the lane is free after that.
            (
                &[0, 80],
                &[(40, 0, true), (60, 0, true), (80, 0, true), (100, 1, true)],
                "0:0-40=100 1:80-100=120-160",
            ),
        ] {
            assert_eq!(bars(begins, steps), drawn);
        }
    }
}
