//! An age over a stretch of run time, as the sum of its parts.

use std::{collections::BTreeMap, mem};

use ratelab::{Time, TimeSpan};

use super::{
    Lineage,
    parts::{AgeStage, nanos},
    push::PushInForce,
};

/// An age over run time. It counts in whole nanoseconds, so that its parts sum to it.
#[derive(Clone, Debug, Default)]
pub struct AgeOverTime {
    /// Twice the integral of each part (ns²), in the order of their first occurrence.
    sums: Vec<(AgeStage, i128)>,
    /// Over this time (ns).
    time: i128,
    /// How many stretches of growing age begin at an age (µs), less those that end at it.
    teeth: BTreeMap<i64, i64>,
}

impl AgeOverTime {
    /// Adds that of `push`, in force from `begin` to `end`.
    fn add(&mut self, push: &PushInForce, begin: Time, end: Time) {
        let end = end.max(begin);
        let fixed = push.applied();
        let time = i128::from(nanos(end.since(begin)));
        self.sum(AgeStage::Before, 2 * time, fixed.before_ns);
        for part in &fixed.parts {
            self.sum(part.stage, 2 * time, nanos(part.took));
        }
        let growing = push.growing().into_iter();
        for (stage, from, to) in growing.filter(|(_, from, _)| *from < end) {
            // It grows from `from` to `to`, and stays as it is after that.
            let grows = [begin, end].map(|at| at.clamp(from, to));
            let [first, last] = grows.map(|at| nanos(at.since(from)));
            let stays = nanos(end.since(begin.max(to)));
            self.sum(
                stage,
                i128::from(nanos(grows[1].since(grows[0]))),
                first.saturating_add(last),
            );
            self.sum(stage, 2 * i128::from(stays), last);
        }
        self.time += time;
        let applied = fixed.sum_ns();
        let age = |at: Time| (applied + nanos(at.since(push.since))).div_euclid(1_000);
        *self.teeth.entry(age(begin)).or_default() += 1;
        *self.teeth.entry(age(end)).or_default() -= 1;
    }

    /// Adds the area of a part that was so old for so long.
    fn sum(&mut self, stage: AgeStage, long: i128, age: i64) {
        let area = long.saturating_mul(i128::from(age));
        if area == 0 {
            return;
        }
        match self.sums.iter_mut().find(|(known, _)| *known == stage) {
            // The times of an altered recording may be any.
            Some((_, sum)) => *sum = sum.saturating_add(area),
            None => self.sums.push((stage, area)),
        }
    }

    /// Returns its mean (ns); `None` if no time has passed.
    pub fn mean_ns(&self) -> Option<i64> {
        let twice = self
            .sums
            .iter()
            .fold(0, |all: i128, (_, sum)| all.saturating_add(*sum));
        Some(self.share(twice)).filter(|_| self.time > 0)
    }

    /// Returns a sum over the time, rounded.
    fn share(&self, twice: i128) -> i64 {
        let time = self.time.max(1);
        i64::try_from(twice.saturating_add(time).div_euclid(2 * time)).unwrap_or(i64::MAX)
    }

    /// Returns the mean of each part (ns), in the order from the sensing to now: they sum to the
    /// mean of the age.
    pub fn parts(&self) -> Vec<(AgeStage, i64)> {
        let (mut sum, mut until) = (0_i128, 0);
        let parts = self.sums.iter().map(|(stage, twice)| {
            sum = sum.saturating_add(*twice);
            let before = mem::replace(&mut until, self.share(sum));
            (*stage, until - before)
        });
        parts.filter(|(_, ns)| *ns != 0).collect()
    }

    /// Returns the age that it does not exceed for this share of the time (ns), to the microsecond;
    /// `None` if no time has passed.
    pub fn quantile(&self, share: f64) -> Option<i64> {
        let ages = self.teeth.keys().zip(self.teeth.keys().skip(1));
        let mut teeth = 0;
        let steps = self.teeth.values().zip(ages).map(|(more, (from, to))| {
            teeth += more;
            (*from as f64, (to - from) as f64, teeth as f64)
        });
        let steps: Vec<(f64, f64, f64)> = steps.collect();
        let all: f64 = steps.iter().map(|(_, long, teeth)| long * teeth).sum();
        let mut rest = all * share.clamp(0.0, 1.0);
        for (from, long, teeth) in steps {
            if teeth > 0.0 && rest <= long * teeth {
                return Some(((from + rest / teeth) * 1e3).round() as i64);
            }
            rest -= long * teeth;
        }
        let (oldest, _) = self.teeth.last_key_value()?;
        Some(oldest.saturating_mul(1_000)).filter(|_| self.time > 0)
    }

    /// Adds the push age of a node over a stretch of run time, as far as its pushes are known.
    pub fn extend(&mut self, lineage: &Lineage, node: usize, span: TimeSpan) {
        for (push, end) in lineage.pushes_within(node, span) {
            self.add(&push, push.since.max(span.from), end);
        }
    }
}

/// Returns the mean of each part of the push age of a node over a stretch of run time (ns), in the
/// order from the sensing to now; empty without known pushes.
pub fn mean_parts(lineage: &Lineage, node: usize, span: TimeSpan) -> Vec<(AgeStage, f64)> {
    let mut ages = AgeOverTime::default();
    ages.extend(lineage, node, span);
    ages.parts()
        .into_iter()
        .filter(|(_, ns)| *ns > 0)
        .map(|(stage, ns)| (stage, ns as f64))
        .collect()
}
