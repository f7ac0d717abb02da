//! The ages in a summary, with their parts.

use ratelab::millis;
use ratelab_experiment::{AgeShare, RunAge};
use serde::Serialize;

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
