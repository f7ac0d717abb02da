//! The newest plan of a run.

use std::{collections::VecDeque, time::Duration};

use ratelab::{Time, TimeSpan};
use ratelab_experiment::millis::mean;
use ratelab_metrics::Rows;
use ratelab_system::{ActionPlan, PlanBars, Planning};

use crate::frame::PlanData;

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
                let plan = (planning.plan)(planning, head, row);
                if let Some(plan) = &plan {
                    self.bars.plan(head.seq, plan);
                }
                keep(&mut self.plans, plan.map(|plan| (head.seq, plan)));
            } else if topic == planning.played {
                keep(&mut self.played, Some((head.at, (planning.action)(row))));
            } else if let Some(step) =
                (planning.step)(planning, row).filter(|_| topic == planning.steps)
            {
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
        self.plans
            .iter()
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
    pub fn predicted(&self, span: TimeSpan) -> Option<Duration> {
        let within = |at: Time| span.from < at && at <= span.to;
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
