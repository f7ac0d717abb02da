//! The ages in a summary, with their parts, and how they differ at other phases of the nodes.

use std::{collections::BTreeMap, ops::ControlFlow};

use ratelab::{ClockKind, Interrupt, millis};
use ratelab_experiment::{
    AgeShare, Experiment, RunAge,
    sweep::{Sweep, all_cores},
};
use serde::Serialize;

use super::rounded;
use crate::error::Error;

/// The share of an age below which a part has no line of its own.
const SMALL: f64 = 0.01;

/// Returns the name and text of each line: an age, if it `is_new`, then its parts, the largest
/// first.
pub fn lines(ages: &[RunAge], is_new: impl Fn(&RunAge) -> bool) -> Vec<(&'static str, String)> {
    let lines = |age| {
        let title = is_new(age).then(|| ("age of", in_a_line(age)));
        title.into_iter().chain(parts(age))
    };
    ages.iter().flat_map(lines).collect()
}

fn in_a_line(age: &RunAge) -> String {
    let [mean, p99] = [age.mean_ns, age.p99_ns].map(ms);
    if let Some(measured) = age.apart_from_ns {
        let measured = ms(measured);
        return format!(
            "{}: {measured} ms mean; its parts sum to {mean} ms, so they are left out: a defect of ratelab",
            title(age)
        );
    }
    let ahead = if age.has_shares() {
        ""
    } else {
        ": a clock is ahead, and the push age counts below zero as zero"
    };
    format!("{}: {mean} ms mean (p99 {p99} ms){ahead}", title(age))
}

/// Returns the mean of an age and what it does not exceed for 99 % of the time (s).
pub fn mean_and_p99_s(age: &RunAge) -> [f64; 2] {
    [age.mean_ns, age.p99_ns].map(|ns| ns as f64 / 1e9)
}

fn parts(age: &RunAge) -> Vec<(&'static str, String)> {
    let has_shares = age.has_shares();
    let share = |ns: i64| ns as f64 / age.mean_ns.max(1) as f64;
    let is_large = |part: &&AgeShare| !has_shares || share(part.ns) >= SMALL;
    let (large, small): (Vec<&AgeShare>, Vec<&AgeShare>) = age.parts.iter().partition(is_large);
    let rest = small.iter().map(|part| part.ns).sum::<i64>();
    let parts = large.into_iter().map(|part| (part.ns, words(part)));
    let rest = (rest != 0).then(|| (rest, "in other parts".to_owned()));
    let lines = parts.chain(rest).map(|(ns, words)| {
        let percent = if has_shares {
            format!("{:>3.0} %", share(ns) * 1e2)
        } else {
            String::new()
        };
        ("", format!("{:>7} ms {percent:5}  {words}", ms(ns)))
    });
    lines.collect()
}

/// Returns what is old, and where.
pub fn title(age: &RunAge) -> String {
    format!("{} at {}{}", age.name(), age.node, data_of(age))
}

/// Whose data they are, to follow the name of the age; empty where only one node began any.
pub fn data_of(age: &RunAge) -> String {
    let source = age.source.as_ref();
    source.map_or_else(String::new, |source| format!(", data of {source}"))
}

fn words(part: &AgeShare) -> String {
    let words = format!("{} {}", part.stage.title(), part.owner);
    words.trim_end().to_owned()
}

/// Returns an age in milliseconds, to the nanosecond.
pub fn in_ms(ns: i64) -> f64 {
    ns as f64 / 1e6
}

fn ms(ns: i64) -> String {
    millis::text(ns as f64 / 1e6)
}

/// An age for programs, in the unit of all ages and in whole nanoseconds, in which parts sum to
/// their age. The keys in nanoseconds go with a later version.
#[derive(Serialize)]
pub struct AgeFigures<'a> {
    of: &'a str,
    at: &'a str,
    mean_ms: f64,
    mean_ns: i64,
    p99_ms: f64,
    p99_ns: i64,
    parts: Vec<PartFigures<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    source: Option<&'a str>,
}

/// A part of an age.
#[derive(Serialize)]
struct PartFigures<'a> {
    kind: &'static str,
    of: &'a str,
    ms: f64,
    ns: i64,
}

/// Returns the ages whose parts sum to them, for programs.
pub fn figures(ages: &[RunAge]) -> Vec<AgeFigures<'_>> {
    let summed = ages.iter().filter(|age| age.apart_from_ns.is_none());
    summed.map(AgeFigures::from).collect()
}

impl<'a> From<&'a RunAge> for AgeFigures<'a> {
    fn from(age: &'a RunAge) -> Self {
        let part = |part: &'a AgeShare| PartFigures {
            kind: part.stage.key(),
            of: &part.owner,
            ms: in_ms(part.ns),
            ns: part.ns,
        };
        Self {
            of: age.name(),
            at: &age.node,
            mean_ms: in_ms(age.mean_ns),
            mean_ns: age.mean_ns,
            p99_ms: in_ms(age.p99_ns),
            p99_ns: age.p99_ns,
            parts: age.parts.iter().map(part).collect(),
            source: age.source.as_deref(),
        }
    }
}

/// The verdict on a run without data in a chain that has no limit.
const NO_DATA: &str = "no_data";

/// What the runs at other phases came to.
pub struct PhaseSpread {
    seed: u64,
    runs: usize,
    /// The number of runs that were asked for.
    asked: usize,
    /// The mean push ages (ms), in ascending order.
    ages: Vec<f64>,
    /// The number of runs with each verdict.
    verdicts: BTreeMap<String, usize>,
    /// The knobs of the worst run: a lost one, or else the oldest.
    worst: Vec<String>,
}

/// Returns `count` runs of `experiment`, each at other phases.
///
/// # Errors
/// [`Error::BadInput`] for a run on the real clock, where phases are as they come.
pub fn phase_sweep(experiment: &Experiment, count: usize) -> Result<Sweep, Error> {
    let config = experiment.config().clone();
    if config.clock == ClockKind::Real {
        let why = "--phases shifts nodes in virtual time: add --clock virtual";
        return Err(Error::BadInput(why.to_owned()));
    }
    Ok(Sweep {
        axes: vec![experiment.phases(count)],
        ..Sweep::new(experiment.system().clone(), config)
    })
}

impl PhaseSpread {
    /// Runs `sweep` on all cores, until `interrupt` is asked for.
    ///
    /// # Errors
    /// [`Error::Sweep`] if a run failed.
    pub fn measure(sweep: &Sweep, interrupt: &Interrupt) -> Result<Self, Error> {
        let swept = sweep.run_until(interrupt, all_cores(), |_, _| ControlFlow::Continue(()))?;
        let (mut ages, mut verdicts) = (Vec::new(), BTreeMap::new());
        let mut worst = (false, f64::NEG_INFINITY, Vec::new());
        for (cell, result) in swept.finished() {
            let age = result.push_age.map(|age| age.run_s * 1e3);
            let name = match result.without_data {
                Some(_) if !result.verdict.is_lost() => NO_DATA,
                _ => result.verdict.name(),
            };
            *verdicts.entry(name.to_owned()).or_default() += 1;
            ages.extend(age);
            let (lost, age) = (result.is_lost(), age.unwrap_or(0.0));
            if (lost, age) > (worst.0, worst.1) {
                let knobs = cell.values.iter().flat_map(|value| &value.knobs);
                worst = (lost, age, knobs.map(ToString::to_string).collect());
            }
        }
        ages.sort_by(f64::total_cmp);
        Ok(Self {
            seed: sweep.base.seed,
            runs: verdicts.values().sum(),
            asked: sweep.cells()?,
            ages,
            verdicts,
            worst: worst.2,
        })
    }

    /// Least, median and greatest of the mean push ages (ms); `None` without a push.
    fn spread(&self) -> Option<[f64; 3]> {
        let ages = &self.ages;
        Some([*ages.first()?, ages[ages.len() / 2], *ages.last()?])
    }

    /// Returns an error if a stop was asked for before the last run.
    pub fn if_stopped(&self) -> Result<(), Error> {
        Error::if_stopped(self.runs, self.asked, "runs at other phases")
    }

    /// Returns lines for people.
    pub fn lines(&self) -> Vec<(&'static str, String)> {
        let mut text = format!("{} by seed {}", self.runs, self.seed);
        if let Some([least, median, greatest]) = self.spread() {
            let [least, median, greatest] = [least, median, greatest].map(millis::text);
            text += &format!(": mean push age {least} to {greatest} ms, median {median} ms");
        }
        for (name, count) in &self.verdicts {
            text += &format!("; {} {count}", name.replace('_', " "));
        }
        let mut lines = vec![("phases", text), ("worst", self.worst.join(" | "))];
        lines.retain(|(_, text)| !text.is_empty());
        lines
    }

    /// Returns the spread, for programs.
    pub fn figures(&self) -> PhaseFigures<'_> {
        let ages = self.spread().map(|ages| ages.map(rounded));
        PhaseFigures {
            runs: self.runs,
            mean_push_age_ms: ages.map(|[min, median, max]| SpreadFigures { min, median, max }),
            verdicts: &self.verdicts,
            worst: &self.worst,
        }
    }
}

/// The spread over phases, for programs.
#[derive(Serialize)]
pub struct PhaseFigures<'a> {
    runs: usize,
    mean_push_age_ms: Option<SpreadFigures>,
    verdicts: &'a BTreeMap<String, usize>,
    worst: &'a [String],
}

#[derive(Serialize)]
struct SpreadFigures {
    min: f64,
    median: f64,
    max: f64,
}
