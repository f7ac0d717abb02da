//! Actions that are planned ahead: as data, and as bars over run time with the part of each that
//! was played.

use std::{
    collections::{BTreeMap, VecDeque},
    sync::Arc,
    time::Duration,
};

use ratelab::{Head, Knob, Time};
use ratelab_metrics::Rows;

/// How the plans of a system are read from its topics. A run may lack some of these.
#[derive(Clone, Copy, Debug)]
pub struct Planning {
    /// Name of the topic of plans.
    pub plans: &'static str,
    /// Reads the plan in a message there; `None` if there is none.
    pub plan: fn(&Self, &Head, &[f64]) -> Option<ActionPlan>,
    /// Name of the topic with the steps of the node that plays them.
    pub steps: &'static str,
    /// Reads the step in a message there; `None` if there is none.
    pub step: fn(&Self, &[f64]) -> Option<PlayStep>,
    /// Name of the topic of the actions that it played.
    pub played: &'static str,
    /// Reads the action in a message there.
    pub action: fn(&[f64]) -> f64,
    /// The greatest action, in either direction.
    pub most: f64,
    /// The numbers of an action, of which plans have the first.
    pub width: usize,
    /// The time that an action is meant for.
    pub period: Duration,
    /// The knob for plans of at least so many actions.
    pub longer: fn(usize) -> Knob,
    /// The knob for plans that expect this delay.
    pub expecting: fn(Duration) -> Knob,
    /// Parameters that may spoil a run, the worst first.
    pub spoilers: &'static [Spoiler],
}

impl Planning {
    /// Returns its topics.
    pub fn topics(&self) -> [&'static str; 3] {
        [self.plans, self.steps, self.played]
    }
}

/// A parameter that may spoil a run, with the value that does not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Spoiler {
    /// Its node.
    pub node: &'static str,
    /// Its name.
    pub name: &'static str,
    /// Its value in a run with plans that sets none.
    pub usual: &'static str,
    /// The value that spoils nothing.
    pub sound: &'static str,
    /// What any other value does, with `{}` for that.
    pub told: &'static str,
}

/// Actions, one after the other.
#[derive(Clone, Debug, PartialEq)]
pub struct ActionPlan {
    /// How it was made, in a word.
    pub kind: &'static str,
    /// Run time at which its making began.
    pub made: Time,
    /// The delay from then on after which it was expected to be there.
    pub expected: Duration,
    /// Run time for which the first action is meant.
    pub begins: Time,
    /// The time that each is meant for; not zero.
    pub period: Duration,
    /// The actions.
    pub actions: Arc<[f64]>,
}

impl ActionPlan {
    /// Returns the run time at which its last action is over.
    pub fn ends(&self) -> Time {
        self.begins + self.period * self.actions.len() as u32
    }

    /// Returns the place of the action that is meant for run time `at`; beyond the last one, how far.
    /// `None` before the first.
    pub fn place(&self, at: Time) -> Option<usize> {
        let since = at.as_nanos().checked_sub(self.begins.as_nanos())?;
        let place = u128::from(since) / self.period.as_nanos().max(1);
        usize::try_from(place).ok()
    }

    /// Returns the action that is meant for run time `at`.
    pub fn action(&self, at: Time) -> Option<f64> {
        self.actions.get(self.place(at)?).copied()
    }
}

/// What the node that plays plans did, at a moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlayStep {
    /// Number of the newest plan that it has, counted from zero on the topic of plans.
    pub newest: u64,
    /// Whether it took that plan now.
    pub took: bool,
    /// Whether it has no action for now.
    pub stalls: bool,
    /// The time that an action is for.
    pub period: Duration,
    /// The part of the age of the action that it played of which the plan knew what would
    /// happen meanwhile; `None` if it played none now.
    pub predicted: Option<Duration>,
}

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

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(ms: u64) -> Time {
        Time::from_nanos(ms * 1_000_000)
    }

    /// Three actions of ten milliseconds each.
    fn plan(begins: u64) -> ActionPlan {
        ActionPlan {
            kind: "chunk",
            made: ms(begins),
            expected: Duration::ZERO,
            begins: ms(begins),
            period: Duration::from_millis(10),
            actions: [1.0, 2.0, 3.0].into(),
        }
    }

    /// A step that plays the plan with this number.
    fn step(newest: u64) -> PlayStep {
        PlayStep {
            newest,
            took: false,
            stalls: false,
            period: Duration::from_millis(10),
            predicted: Some(Duration::ZERO),
        }
    }

    #[test]
    fn an_action_of_a_plan_is_meant_for_its_period() {
        for (at, place, action) in [
            (99, None, None),
            (100, Some(0), Some(1.0)),
            (109, Some(0), Some(1.0)),
            (110, Some(1), Some(2.0)),
            (129, Some(2), Some(3.0)),
            (130, Some(3), None),
        ] {
            let plan = plan(100);
            assert_eq!(
                (plan.place(ms(at)), plan.action(ms(at))),
                (place, action),
                "{at}"
            );
        }
        assert_eq!(plan(100).ends(), ms(130));
    }

    #[test]
    fn a_bar_is_played_until_a_newer_plan_is_and_plans_that_overlap_have_lanes_of_their_own() {
        let mut bars = PlanBars::default();
        bars.plan(0, &plan(0));
        bars.plan(1, &plan(20));
        for (at, number) in [(0, 0), (10, 0), (20, 1), (30, 1)] {
            bars.step(ms(at), &step(number));
        }
        let lanes = bars.lanes();
        let told: Vec<Vec<(u64, u64, bool)>> = lanes
            .iter()
            .flatten()
            .map(|bar| {
                let parts = bar.parts.iter();
                let ends = |part: &BarPart| part.to.as_nanos() / 1_000_000;
                parts
                    .map(|part| (bar.number, ends(part), part.played))
                    .collect()
            })
            .collect();
        let (first, second) = (
            [(0, 20, true), (0, 30, false)],
            [(1, 40, true), (1, 50, false)],
        );
        assert_eq!(told, [first, second]);
        assert_eq!(lanes.len(), 2);
    }
}
