//! Figures of a run by their names, for tables of runs.

use std::{collections::HashMap, time::Duration};

use ratelab_experiment::Summary;

/// A figure of a run: its `verdict`, `steps` or `end`, the `ticks`, `overruns` or time `spent` of
/// a node, or of several with commas in between, what a topic `published`, `dropped` or `lost`, or
/// a mean push `age` or `latency` (ms).
pub fn figure(summary: &Summary, name: &str) -> String {
    let (kind, of) = name.split_once(' ').unwrap_or((name, ""));
    if let Some((first, others)) = of.split_once(',') {
        let [first, others] = [first, others].map(|of| figure(summary, &format!("{kind} {of}")));
        return format!("{first},{others}");
    }
    let node = || summary.node(of).unwrap_or_else(|| panic!("no node {of}"));
    let topic = || summary.topic(of).expect(name);
    let all_of = |kinds: &[&str]| {
        let all = kinds
            .iter()
            .map(|kind| figure(summary, &format!("{kind} {of}")));
        all.collect::<Vec<_>>().join(",")
    };
    let ms = |time: Option<Duration>| time.map_or(f64::NAN, |time| time.as_secs_f64() * 1e3);
    match kind {
        "verdict" => summary.verdict.name().to_owned(),
        // As the files in `tests/golden/` call it.
        "ending" => {
            let name = summary.verdict.name().replace("pole_fell", "fell");
            name.replace("cart_left_rail", "left_rail")
        }
        "steps" => summary.steps.to_string(),
        "end" => summary.sim_time.as_secs_f64().to_string(),
        "ticks" => node().ticks.to_string(),
        "overruns" => node().overruns.to_string(),
        "end_ns" => summary.sim_time.as_nanos().to_string(),
        "spent_ns" => node().tick_time.sum().as_nanos().to_string(),
        "spent" => node().tick_time.sum().as_millis().to_string(),
        "published" => topic().published.to_string(),
        "dropped" => topic().dropped().to_string(),
        "lost" => topic().lost.to_string(),
        "overtaken" => topic().overtaken.to_string(),
        "in_flight" => topic().in_flight().to_string(),
        "way" => all_of(&["lost", "overtaken", "in_flight"]),
        "fates" => all_of(&["published", "dropped", "way"]),
        "age" => (summary.push_age().expect("pushes").run_s * 1e3)
            .round()
            .to_string(),
        "latency" if of == "count" => summary.latency.count().to_string(),
        "latency" if of == "sum" => summary.latency.sum().as_nanos().to_string(),
        "latency" if of == "max" => ms(summary.latency.max()).to_string(),
        "latency" => ms(summary.latency.quantile(0.5)).round().to_string(),
        _ => panic!("{name:?} is no figure"),
    }
}

/// Checks figures of a run, such as `ticks policy 3; dropped /obs 2`.
#[track_caller]
pub fn check(case: &str, summary: &Summary, figures: &str) {
    for expected in figures
        .split(';')
        .map(str::trim)
        .filter(|figure| !figure.is_empty())
    {
        let (name, _) = expected.rsplit_once(' ').expect("a value");
        let found = format!("{name} {}", figure(summary, name));
        assert_eq!(found, expected, "{case}: {:?}", summary.verdict);
    }
}

/// Words such as `seed=3`, by what is before their equals sign.
pub type GoldenFields<'a> = HashMap<&'a str, &'a str>;

/// The fields in a line of a file in `tests/golden/`.
pub fn fields(line: &str) -> GoldenFields<'_> {
    let words = line.split_whitespace();
    words.filter_map(|word| word.split_once('=')).collect()
}

/// The blocks of such a file, and of the one that the variable `more` of the environment names.
pub fn golden_blocks(known: &str, more: &str) -> Vec<String> {
    let more = std::env::var_os(more).map(|path| std::fs::read_to_string(path).expect("more runs"));
    let blocks = [known]
        .into_iter()
        .chain(more.as_deref())
        .flat_map(|text| text.trim().split("\n\n"));
    blocks.map(str::to_owned).collect()
}
