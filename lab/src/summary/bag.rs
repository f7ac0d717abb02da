//! The ages of a run beside those of the bag that its graph was made of.

use ratelab::millis;
use ratelab_experiment::Summary;
use ratelab_system::{BagAges, DataChain, System};
use serde_json::{Map, Value, json};

use super::{Digits, ages::mean_and_p99_s};

/// A chain with its ages in the bag and in the run (ms).
struct ComparedChain<'a> {
    chain: &'a DataChain,
    bag: &'a BagAges,
    /// The mean in the run, if data came through.
    mean: Option<f64>,
    p99: Option<f64>,
}

/// Returns the chains with ages of a bag.
fn compared<'a>(
    system: &'a dyn System,
    summary: &'a Summary,
) -> impl Iterator<Item = ComparedChain<'a>> {
    let chains = system.about().chains.iter();
    chains.filter_map(|chain| {
        let age = summary
            .ages
            .iter()
            .find(|age| age.chain.as_deref() == Some(chain.name()));
        Some(ComparedChain {
            chain,
            bag: chain.bag.as_ref()?,
            mean: chain.mean_ms(summary.sim_time, &summary.chains),
            p99: age.map(|age| mean_and_p99_s(age)[1] * 1e3),
        })
    })
}

/// Returns how much more `here` is than in the `bag` (percent).
fn change(here: f64, bag: f64) -> f64 {
    (here - bag) / bag * 1e2
}

/// Returns a line for each chain with ages of a bag.
pub fn lines(system: &dyn System, summary: &Summary) -> Vec<(&'static str, String)> {
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
        let figures: Vec<String> = figures.into_iter().flatten().collect();
        let sure = match &of.bag.unsure {
            Some(why) => format!("unsure if changed: {why}"),
            None => "sure if changed".to_owned(),
        };
        let figures = if figures.is_empty() {
            "no data here".to_owned()
        } else {
            figures.join("; ")
        };
        ("bag", format!("{} {figures}; {sure}", of.chain.name()))
    };
    compared(system, summary).map(line).collect()
}

/// Returns the same for programs; `None` without a bag.
pub fn json(digits: Digits, system: &dyn System, summary: &Summary) -> Option<Value> {
    let chains = compared(system, summary).map(|of| {
        let BagAges {
            mean_ms,
            p99_ms,
            unsure,
        } = of.bag;
        let rounded = |value: Option<f64>| value.map(|value| digits.round(value));
        let mean_change = of.mean.map(|mean| change(mean, *mean_ms));
        let p99_change = of.p99.zip(*p99_ms).map(|(here, bag)| change(here, bag));
        let figures = json!({
            "mean_change_percent": rounded(mean_change),
            "mean_ms": mean_ms,
            "p99_change_percent": rounded(p99_change),
            "p99_ms": p99_ms,
            "sure": unsure.is_none(),
            "unsure": unsure,
        });
        (of.chain.name().to_owned(), figures)
    });
    let chains: Map<String, Value> = chains.collect();
    (!chains.is_empty()).then(|| chains.into())
}
