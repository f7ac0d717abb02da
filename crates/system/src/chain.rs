//! A chain of nodes and topics, with a limit of its data age: its verdicts, its figures, its
//! line in a report.

use std::time::Duration;

use ratelab::{Time, millis};

use super::{
    Bound, Final, VerdictKind,
    chain_ages::{ChainFigures, age_of_newest},
};

/// Name of the topic with the data ages of the chains.
pub const CHAINS: &str = "/chains";

/// What did nothing in a run.
#[derive(Clone, Debug, Default)]
pub struct Silence<'a> {
    /// The nodes that never ticked.
    pub idle: Vec<&'a str>,
    /// The topics without a message.
    pub unsent: Vec<&'a str>,
    /// The nodes that never ticked because no messages on their topics matched.
    pub unmatched: Vec<Unmatched<'a>>,
}

/// A node for which messages came on each of its topics, but none that match.
#[derive(Clone, Debug)]
pub struct Unmatched<'a> {
    /// Its name.
    pub node: &'a str,
    /// The topics that trigger it.
    pub topics: Vec<&'a str>,
}

impl Silence<'_> {
    /// Returns why this node never ticked, as far as it is known.
    fn why_idle(&self, node: &str) -> String {
        let unmatched = self.unmatched.iter().find(|of| of.node == node);
        unmatched.map_or_else(|| format!("{node} never ticked"), Unmatched::text)
    }
}

impl Unmatched<'_> {
    /// That it never ticked, and why.
    pub fn text(&self) -> String {
        let (node, topics) = (self.node, self.topics.join(" and "));
        format!("{node} never ticked: the header stamps on {topics} never match")
    }
}

/// A chain.
#[derive(Clone, Debug)]
pub struct DataChain {
    pub(crate) name: String,
    /// Its number in the messages on [`CHAINS`].
    number: usize,
    /// Its nodes, in the direction of the data.
    pub nodes: Vec<String>,
    /// The topics on the way to its last node.
    topics: Vec<String>,
    pub(crate) limit: Option<Limit>,
    /// What a bag said of it, to compare.
    pub bag: Option<BagAges>,
    missed: VerdictKind,
    silent: VerdictKind,
}

/// The ages of a chain in the bag that its graph was made of.
#[derive(Clone, Debug, PartialEq)]
pub struct BagAges {
    /// The mean over time (ms).
    pub mean_ms: f64,
    /// What it did not exceed for 99 % of the time (ms).
    pub p99_ms: Option<f64>,
    /// What the bag could not tell, on which other ages of the graph rest.
    pub unsure: Option<String>,
    /// What the bag could not tell, but runs with a change try.
    pub open: Option<String>,
}

/// A limit of the data age of a chain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Limit {
    pub(crate) age: Duration,
    /// Share of the time for which it holds.
    pub(crate) share: f64,
}

impl Limit {
    /// Returns its age (ms).
    pub(crate) fn ms(self) -> f64 {
        millis::to_millis(self.age)
    }

    /// Returns whether it holds for a long enough `share` of the time.
    fn is_kept(self, share: f64) -> bool {
        Bound::AtLeast(self.share).holds(share)
    }

    /// Returns the `share` of the time within it, in hundredths of a percent. It is rounded to the
    /// nearest, except that a share below the wanted one never looks like that.
    fn share_text(self, share: f64) -> String {
        let hundredths = (share * 1e4).round();
        let missed = !self.is_kept(share) && hundredths >= self.share * 1e4;
        let shown = if missed {
            (share * 1e4).floor()
        } else {
            hundredths
        };
        format!("{:.2} %", shown / 1e2)
    }
}

/// A figure of a chain: name, unit and value.
type Figure = (&'static str, &'static str, fn(ChainFigures) -> f64);

/// The figures of a chain at the end of a run.
const FIGURES: [Figure; 3] = [
    ("mean_age", "ms", |figures| figures.mean),
    ("greatest_age", "ms", |figures| figures.greatest),
    ("within", "", |figures| figures.share),
];

/// Returns the name of a figure or a verdict: `see_to_act` of `see-to-act`. Each character that is
/// not alphanumeric becomes `_`, so that two chains keep two names.
pub(crate) fn figure_name(name: &str) -> String {
    let plain = |c: char| if c.is_alphanumeric() { c } else { '_' };
    name.chars().map(plain).collect()
}

/// Returns a share in percent, without trailing zeros.
fn percent(share: f64) -> String {
    format!("{} %", (share * 1e6).round() / 1e4)
}

impl DataChain {
    /// Chain number `number` along `path`, of nodes and topics.
    pub(crate) fn new<'n>(
        name: &str,
        number: usize,
        path: impl Iterator<Item = &'n str>,
        limit: Option<Limit>,
    ) -> Self {
        let key = figure_name(name);
        let (mut topics, nodes): (Vec<&str>, Vec<&str>) = path.partition(|of| of.starts_with('/'));
        topics.truncate(nodes.len().saturating_sub(1));
        let older = limit.map_or_else(String::new, |limit| {
            let (ms, rest) = (limit.ms(), percent(1.0 - limit.share));
            if limit.share >= 1.0 {
                format!("older than {ms} ms at times")
            } else {
                format!("older than {ms} ms for more than {rest} of the time")
            }
        });
        let kind = |kind: &str, text: String| VerdictKind {
            name: format!("{kind}_{key}").into(),
            lost: true,
            text: format!("MISSED ({text})").into(),
        };
        let owned = |names: Vec<&str>| names.into_iter().map(str::to_owned).collect();
        Self {
            name: name.to_owned(),
            number,
            nodes: owned(nodes),
            topics: owned(topics),
            limit,
            bag: None,
            missed: kind("missed", format!("{name} {older}")),
            silent: kind("silent", format!("no data on chain {name}")),
        }
    }

    /// Returns its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the topics on the way to its last node.
    pub fn topics(&self) -> &[String] {
        &self.topics
    }

    /// Returns the node at its end.
    pub fn last(&self) -> &str {
        self.nodes.last().map_or("", String::as_str)
    }

    /// Returns its limit in words.
    pub(crate) fn within(&self) -> Option<String> {
        let limit = self.limit?;
        let most = format!("{} at most {} ms old", self.name, limit.ms());
        Some(if limit.share >= 1.0 {
            most
        } else {
            format!("{most} for {} of the time", percent(limit.share))
        })
    }

    /// Returns the verdicts on it.
    pub(crate) fn verdicts(&self) -> impl Iterator<Item = &VerdictKind> {
        self.limit
            .map(|_| [&self.missed, &self.silent])
            .into_iter()
            .flatten()
    }

    fn figures(&self, at: Time, row: &[f64]) -> Option<ChainFigures> {
        ChainFigures::at(row, self.number, self.limit.map(|limit| limit.age), at)
    }

    /// Returns the verdict on it up to run time `at`, unless its limit is kept. Data may still come
    /// if the run is not `over`. `row` is the newest message on [`CHAINS`].
    pub(super) fn missed(&self, at: Time, row: Option<&[f64]>, over: bool) -> Option<&VerdictKind> {
        let limit = self.limit?;
        match row.and_then(|row| self.figures(at, row)) {
            None => over.then_some(&self.silent),
            Some(figures) => (!limit.is_kept(figures.share)).then_some(&self.missed),
        }
    }

    /// Returns its figures up to run time `at`, from the newest message on [`CHAINS`].
    pub(crate) fn finals(&self, at: Time, row: &[f64]) -> impl Iterator<Item = Final> {
        let (figures, key) = (self.figures(at, row), figure_name(&self.name));
        FIGURES.into_iter().map(move |(name, unit, value)| Final {
            name: format!("{key}_{name}").into(),
            unit: unit.into(),
            value: figures.map_or(f64::NAN, value),
        })
    }

    /// Returns its data age at the output of its last node that a message on [`CHAINS`] is about;
    /// `None` before any data.
    pub fn latency(&self, row: &[f64]) -> Option<Duration> {
        age_of_newest(row, self.number)
    }

    /// Returns its mean age up to run time `at` (ms), from the newest message on [`CHAINS`].
    pub fn mean_ms(&self, at: Time, row: &[f64]) -> Option<f64> {
        Some(self.figures(at, row)?.mean)
    }

    /// Returns the share of the time up to run time `at` for which its limit was kept, from the
    /// newest message on [`CHAINS`]; `None` without a limit or data.
    pub fn within_share(&self, at: Time, row: &[f64]) -> Option<f64> {
        let figures = self.limit.and(self.figures(at, row))?;
        Some(figures.share)
    }

    /// That share in words.
    pub fn within_text(&self, at: Time, row: &[f64]) -> Option<String> {
        let share = self.within_share(at, row)?;
        Some(self.limit?.share_text(share))
    }

    /// Returns what that share lacks, where it is too small; below zero where it is not.
    pub fn excess(&self, at: Time, row: &[f64]) -> Option<f64> {
        Some(self.limit?.share - self.within_share(at, row)?)
    }

    /// Returns whether no data came through it up to run time `at`, and why, as the `silence` of
    /// the run tells; from the newest message on [`CHAINS`].
    pub fn without_data(&self, at: Time, row: &[f64], silence: &Silence<'_>) -> Option<String> {
        if self.figures(at, row).is_some() {
            return None;
        }
        let idle = self
            .nodes
            .iter()
            .find(|node| silence.idle.contains(&&***node));
        let unsent = self
            .nodes
            .iter()
            .zip(&self.topics)
            .find(|(_, topic)| silence.unsent.contains(&&***topic));
        let why = match (idle, unsent) {
            (Some(node), _) => format!(": {}", silence.why_idle(node)),
            (None, Some((node, topic))) => format!(": {node} published nothing on {topic}"),
            (None, None) => String::new(),
        };
        Some(format!("no data{why}"))
    }

    /// Returns its data age up to run time `at` in words, from the newest message on [`CHAINS`] and
    /// the `silence` of the run.
    pub fn line(&self, at: Time, row: &[f64], silence: &Silence<'_>) -> String {
        let name = &self.name;
        let Some(figures) = self.figures(at, row) else {
            let why = self.without_data(at, row, silence);
            return format!("{name}: {}", why.unwrap_or_default());
        };
        let [mean, greatest] = [figures.mean, figures.greatest].map(millis::text);
        let ages = format!("{name}: data age mean {mean} ms, greatest {greatest} ms");
        let Some(limit) = self.limit else {
            return ages;
        };
        let (ms, wanted) = (limit.ms(), percent(limit.share));
        let kept = limit.share_text(figures.share);
        format!("{ages}, {kept} of the time within {ms} ms ({wanted} wanted)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain_ages::ChainAges;

    const PATH: [&str; 4] = ["camera", "/image", "control", "/cmd"];

    fn ms(ms: u64) -> Time {
        Time::from_nanos(ms * 1_000_000)
    }

    fn limit(age: u64, share: f64) -> Limit {
        let age = Duration::from_millis(age);
        Limit { age, share }
    }

    fn chain(limit: Option<Limit>) -> DataChain {
        DataChain::new("see-to-act", 0, PATH.into_iter(), limit)
    }

    /// The message on the topic of chains at 200 ms: the data were fresh at 100 and at 200 ms.
    fn row(limit: Limit) -> Vec<f64> {
        let mut ages = ChainAges::new([Some(limit.age)].into_iter());
        ages.row(ms(100), [(0, Some(ms(100)))]);
        ages.row(ms(200), [(0, Some(ms(200)))]).0
    }

    #[test]
    fn a_limit_is_missed_when_it_holds_for_less_than_its_share_of_the_time() {
        for (age, share, missed) in [
            (100, 1.0, false),
            (50, 1.0, true),
            (50, 0.5, false),
            (50, 0.51, true),
            (0, 0.01, true),
        ] {
            let limit = limit(age, share);
            let (chain, row) = (chain(Some(limit)), row(limit));
            let found = chain.missed(ms(200), Some(&row), true);
            let expected = missed.then_some("missed_see_to_act");
            assert_eq!(found.map(|kind| &*kind.name), expected, "{limit:?}");
        }
    }

    #[test]
    fn a_chain_without_data_is_silent_once_the_run_is_over_and_one_without_a_limit_never_is() {
        let limited = chain(Some(limit(50, 1.0)));
        for (chain, over, expected) in [
            (&limited, true, Some("silent_see_to_act")),
            (&limited, false, None),
            (&chain(None), true, None),
        ] {
            let found = chain.missed(ms(200), None, over);
            assert_eq!(found.map(|kind| &*kind.name), expected, "{over}");
        }
    }

    #[test]
    fn a_share_that_is_too_small_never_looks_like_the_wanted_one() {
        for (wanted, share, text) in [
            (0.99, 0.99, "99.00 %"),
            (0.99, 0.989_999, "98.99 %"),
            (0.99, 0.990_049, "99.00 %"),
            (0.99, 0.5, "50.00 %"),
            (1.0, 0.999_999, "99.99 %"),
            (1.0, 1.0, "100.00 %"),
        ] {
            assert_eq!(
                limit(50, wanted).share_text(share),
                text,
                "{wanted} {share}"
            );
        }
    }

    #[test]
    fn chains_are_named_apart_in_verdicts() {
        for (name, expected) in [("see-to-act", "see_to_act"), ("a.b", "a_b"), ("ä1", "ä1")] {
            assert_eq!(figure_name(name), expected);
        }
    }

    #[test]
    fn the_topics_of_a_chain_lead_to_its_last_node() {
        let chain = chain(None);
        assert_eq!(chain.nodes, ["camera", "control"]);
        assert_eq!(chain.topics(), ["/image"]);
        assert_eq!(chain.last(), "control");
    }
}
