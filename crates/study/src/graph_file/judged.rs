//! A chain with its limit: its verdicts, its figures, its line in a report.

use ratelab::Time;

use super::{
    ChainSpec, Limit,
    chain::ChainFigures,
    leaked::{leaked, leaked_kind, leaked_list},
};
use crate::system::VerdictKind;

/// A chain, with its verdicts.
pub(super) struct Judged {
    pub(super) name: &'static str,
    /// Its nodes, in the direction of the data.
    pub(super) nodes: &'static [&'static str],
    pub(super) limit: Option<Limit>,
    pub(super) missed: &'static VerdictKind,
    pub(super) silent: &'static VerdictKind,
    /// Names of its figures.
    pub(super) figures: &'static [&'static str],
}

/// A figure of a chain: name, unit and value.
pub(super) type Figure = (&'static str, &'static str, fn(ChainFigures) -> f64);

/// The figures of a chain at the end of a run.
pub(super) const FIGURES: [Figure; 3] = [
    ("mean_age", "ms", |figures| figures.mean),
    ("greatest_age", "ms", |figures| figures.greatest),
    ("within", "", |figures| figures.share),
];

/// A name for programs: `see_to_act` of `see-to-act`.
pub(super) fn key(name: &str) -> String {
    let plain = |c: char| if c.is_alphanumeric() { c } else { '_' };
    name.chars().map(plain).collect()
}

impl ChainSpec {
    /// Its limit in words.
    pub(super) fn within(&self) -> Option<String> {
        let Limit { age, share } = self.limit?;
        let ms = age.as_secs_f64() * 1e3;
        Some(match share >= 1.0 {
            true => format!("{} at most {ms} ms old", self.name),
            false => format!(
                "{} at most {ms} ms old for {} of the time",
                self.name,
                percent(share)
            ),
        })
    }
}

/// A share in percent, without trailing zeros.
fn percent(share: f64) -> String {
    format!("{} %", (share * 1e6).round() / 1e4)
}

impl Judged {
    /// The node at its end.
    pub(super) fn last(&self) -> &'static str {
        self.nodes.last().copied().unwrap_or_default()
    }

    pub(super) fn of(chain: &ChainSpec) -> Self {
        let (name, key) = (&chain.name, key(&chain.name));
        let missed = chain
            .limit
            .map_or_else(String::new, |Limit { age, share }| {
                let ms = age.as_secs_f64() * 1e3;
                match share >= 1.0 {
                    true => format!("MISSED ({name} older than {ms} ms at times)"),
                    false => {
                        let rest = percent(1.0 - share);
                        format!(
                            "MISSED ({name} older than {ms} ms for more than {rest} of the time)"
                        )
                    }
                }
            });
        let silent = format!("MISSED (no data came through {name})");
        Self {
            name: leaked(name),
            nodes: leaked_list(chain.nodes()),
            limit: chain.limit,
            missed: leaked_kind(&format!("missed_{key}"), true, &missed),
            silent: leaked_kind(&format!("silent_{key}"), true, &silent),
            figures: leaked_list(FIGURES.map(|(name, ..)| format!("{key}_{name}"))),
        }
    }

    pub(super) fn figures_at(&self, index: usize, at: Time, row: &[f64]) -> Option<ChainFigures> {
        let limit = self.limit.map(|limit| limit.age);
        ChainFigures::at(row, index, limit, at)
    }

    /// The verdict on it up to run time `at`, unless its limit is kept. Data may still come
    /// if the run is not `over`.
    pub(super) fn missed(
        &self,
        index: usize,
        at: Time,
        row: Option<&[f64]>,
        over: bool,
    ) -> Option<&'static VerdictKind> {
        let limit = self.limit?;
        match row.and_then(|row| self.figures_at(index, at, row)) {
            None => over.then_some(self.silent),
            Some(figures) => (figures.share < limit.share).then_some(self.missed),
        }
    }

    /// Its figures, or the first of its nodes among those that were `idle`.
    pub(super) fn line(&self, index: usize, at: Time, row: &[f64], idle: &[&str]) -> String {
        let name = self.name;
        let Some(figures) = self.figures_at(index, at, row) else {
            let stops = self.nodes.iter().find(|node| idle.contains(node));
            let stops = stops.map(|node| format!(": {node} never ticked"));
            return format!("{name} no data{}", stops.unwrap_or_default());
        };
        let ages = format!(
            "{name} data age mean {:.1} ms, greatest {:.1} ms",
            figures.mean, figures.greatest
        );
        let Some(Limit { age, share }) = self.limit else {
            return ages;
        };
        let (ms, wanted) = (age.as_secs_f64() * 1e3, percent(share));
        let kept = (figures.share * 1e4).floor() / 1e2;
        format!("{ages}, {kept:.2} % of the time within {ms} ms ({wanted} wanted)")
    }
}
