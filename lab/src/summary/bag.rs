//! The ages of a run beside those of the bag that its graph was made of.

use std::collections::BTreeMap;

use ratelab::millis;
use ratelab_experiment::Summary;
use ratelab_system::{BagAges, DataChain, System};
use serde::Serialize;

use super::{
    Digits,
    ages::mean_and_p99_s,
    readings::{OtherReadings, ReadAge},
};

/// How far other readings of the bag may be (percent) for a prediction to be sure.
const SURE_PERCENT: f64 = 2.0;

/// A chain with its ages in the bag and in the run (ms).
struct ComparedChain<'a> {
    chain: &'a DataChain,
    bag: &'a BagAges,
    /// The mean in the run, if data came through.
    mean: Option<f64>,
    p99: Option<f64>,
    /// What other readings of the bag come to, if the graph was changed.
    readings: Option<&'a [ReadAge]>,
    /// A node of which the change says what the bag does not.
    doubted: Option<&'a str>,
}

impl ComparedChain<'_> {
    /// Returns why the mean may be another one, if it may.
    fn unsure(&self) -> Option<String> {
        let (unsure, open) = (&self.bag.unsure, &self.bag.open);
        let Some(readings) = self.readings else {
            return unsure.clone().or_else(|| open.clone());
        };
        let doubt =
            |node| format!("what {node} costs is not known: it may be a timer or triggered");
        let doubted = || self.doubted.map(doubt);
        let Some(mean) = self.mean.filter(|_| unsure.is_none()) else {
            return unsure.clone();
        };
        let far = |age: &&ReadAge| change(age.mean_ms, mean).abs() > SURE_PERCENT;
        let others: Vec<String> = readings
            .iter()
            .filter(far)
            .map(|age| format!("{} ms if {}", millis::text(age.mean_ms), age.what))
            .collect();
        if others.is_empty() {
            return doubted();
        }
        Some(others.join(", "))
    }

    /// Returns the mean over the phases that nodes at a new rate may have; `None` if it hardly depends
    /// on them.
    fn over_phases(&self) -> Option<f64> {
        let mean = self.mean?;
        let readings = self.readings?.iter().filter(|age| age.is_phase);
        let others: Vec<f64> = readings.map(|age| age.mean_ms).collect();
        let is_far = |other: &f64| change(*other, mean).abs() > SURE_PERCENT;
        let sum = others.iter().sum::<f64>() + mean;
        let depends = others.iter().any(is_far);
        depends.then(|| sum / (others.len() + 1) as f64)
    }

    /// Returns how sure the mean is.
    fn sure(&self) -> String {
        match (self.unsure(), self.readings) {
            (Some(why), None) => format!("unsure if changed: {why}"),
            (None, None) => "sure if changed".to_owned(),
            (Some(why), Some(_)) => format!("unsure: {why}"),
            (None, Some(readings)) => format!(
                "sure: other readings of the bag ({}) differ by less than {SURE_PERCENT} %",
                readings.len()
            ),
        }
    }
}

/// Returns the chains with ages of a bag.
fn compared<'a>(
    system: &'a dyn System,
    summary: &'a Summary,
    readings: Option<&'a OtherReadings>,
) -> impl Iterator<Item = ComparedChain<'a>> {
    let chains = system.about().chains.iter();
    chains.filter_map(move |chain| {
        let age = summary
            .ages
            .iter()
            .find(|age| age.chain.as_deref() == Some(chain.name()));
        Some(ComparedChain {
            chain,
            bag: chain.bag.as_ref()?,
            mean: chain.mean_ms(summary.sim_time, &summary.chains),
            p99: age.map(|age| mean_and_p99_s(age)[1] * 1e3),
            readings: readings.map(|readings| readings.of(chain)),
            doubted: readings.and_then(|readings| readings.doubted(chain)),
        })
    })
}

/// Returns how much more `here` is than in the `bag` (percent).
fn change(here: f64, bag: f64) -> f64 {
    (here - bag) / bag * 1e2
}

/// Returns a line for each chain with ages of a bag.
pub fn lines(
    system: &dyn System,
    summary: &Summary,
    readings: Option<&OtherReadings>,
) -> Vec<(&'static str, String)> {
    let line = |of: ComparedChain<'_>| {
        let figure = |name: &str, here: Option<f64>, bag: Option<f64>| {
            let (here, bag) = (here?, bag?);
            let [ms, of_bag] = [here, bag].map(millis::text);
            let change = change(here, bag);
            Some(format!(
                "{name} {ms} ms, in the bag {of_bag} ms ({change:+.1} %)"
            ))
        };
        let figures = [
            figure("mean", of.mean, Some(of.bag.mean_ms)),
            figure("p99", of.p99, of.bag.p99_ms),
        ];
        let over_phases = of.over_phases().map(millis::text);
        let over_phases = over_phases.map(|ms| format!("mean over phases {ms} ms"));
        let figures = figures.into_iter().chain([over_phases]);
        let figures: Vec<String> = figures.flatten().collect();
        let sure = of.sure();
        let figures = if figures.is_empty() {
            "no data here".to_owned()
        } else {
            figures.join("; ")
        };
        ("bag", format!("{} {figures}; {sure}", of.chain.name()))
    };
    compared(system, summary, readings).map(line).collect()
}

/// Returns the same for programs; `None` without a bag.
pub fn figures(
    digits: Digits,
    system: &dyn System,
    summary: &Summary,
    readings: Option<&OtherReadings>,
) -> Option<BTreeMap<String, BagFigures>> {
    let chains = compared(system, summary, readings).map(|of| {
        let BagAges {
            mean_ms, p99_ms, ..
        } = of.bag;
        let unsure = of.unsure();
        let rounded = |value: Option<f64>| value.map(|value| digits.round(value));
        let mean_change = of.mean.map(|mean| change(mean, *mean_ms));
        let p99_change = of.p99.zip(*p99_ms).map(|(here, bag)| change(here, bag));
        let other = |age: &ReadAge| (age.what.clone(), digits.round(age.mean_ms));
        let figures = BagFigures {
            mean_change_percent: rounded(mean_change),
            mean_ms: *mean_ms,
            over_phases_mean_ms: of.over_phases().map(|mean| digits.round(mean)),
            p99_change_percent: rounded(p99_change),
            p99_ms: *p99_ms,
            readings_mean_ms: of
                .readings
                .map(|readings| readings.iter().map(other).collect()),
            sure: unsure.is_none(),
            unsure,
        };
        (of.chain.name().to_owned(), figures)
    });
    let chains: BTreeMap<_, _> = chains.collect();
    (!chains.is_empty()).then_some(chains)
}

/// The age of a chain in the bag and in the run, for programs.
#[derive(Serialize)]
pub struct BagFigures {
    mean_change_percent: Option<f64>,
    mean_ms: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    over_phases_mean_ms: Option<f64>,
    p99_change_percent: Option<f64>,
    p99_ms: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    readings_mean_ms: Option<BTreeMap<String, f64>>,
    sure: bool,
    unsure: Option<String>,
}
