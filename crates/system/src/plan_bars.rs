//! Plans as bars over run time, and which part of each was played.

use std::collections::{BTreeMap, VecDeque};

use ratelab::Time;
use ratelab_metrics::Rows;

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

    /// Returns what it is, in a word.
    pub fn word(&self) -> &'static str {
        if self.played {
            Self::PLAYED
        } else {
            Self::PLANNED
        }
    }
}

impl PlanBars {
    /// Returns the bars of a run whose messages are in `rows`, by name of their topic.
    pub fn of<'r>(planning: &Planning, rows: impl Fn(&str) -> Option<&'r Rows>) -> Self {
        let mut bars = Self::default();
        let messages = |topic| rows(topic).into_iter().flat_map(Rows::iter);
        for (head, row) in messages(planning.plans) {
            if let Some(plan) = (planning.plan)(planning, head, row) {
                bars.plan(head.seq, &plan);
            }
        }
        for (head, row) in messages(planning.steps) {
            if let Some(step) = (planning.step)(planning, row) {
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

    /// Returns the bars in the order of their plans, in as many lanes as it takes: in none of them
    /// two touch.
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

/// Returns the parts of a plan, of which these stretches were played; they may go on after its end.
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
