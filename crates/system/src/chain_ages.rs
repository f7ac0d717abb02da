//! Data ages along chains, over time.
//!
//! The age of a chain is run time now minus the run time at which the data behind its newest
//! output began. It grows with time and drops with a fresher output, so all figures here are
//! over run time, from the first output of the chain on.

use std::time::Duration;

use ratelab::{Time, millis::to_millis as ms};
use ratelab_metrics::{Fields, Sawtooth};

/// Maximum number of chains of a graph.
pub const MAX_CHAINS: usize = 64;

/// Names of the numbers of a chain in a message on [`CHAINS`](super::CHAINS).
const OF_CHAIN: [&str; 6] = [
    "age before (ms)",
    "age after (ms)",
    "mean age (ms)",
    "greatest age (ms)",
    "within limit (ms)",
    "measured (ms)",
];

/// Returns the names of all numbers for these chains.
pub(crate) fn chain_fields<'n>(names: impl Iterator<Item = &'n str>) -> Vec<String> {
    let of_chains = names.flat_map(|name| OF_CHAIN.map(|field| format!("{name} {field}")));
    ["at (ms)".to_owned()]
        .into_iter()
        .chain(of_chains)
        .collect()
}

/// The end of the name of a number that is a run time (ns), by the clock of the process that
/// published it.
const RUN_TIMES: [&str; 2] = ["origin (ns)", "made (ns)"];

/// Returns whether the number of this name in a message is a run time, in nanoseconds.
pub fn is_run_time(field: &str) -> bool {
    RUN_TIMES.iter().any(|end| field.ends_with(end))
}

/// The numbers of a message on [`CHAINS`](super::CHAINS).
#[derive(Clone, Debug)]
pub(crate) struct Numbers(pub(crate) Vec<f64>);

impl Fields for Numbers {
    /// They differ from topic to topic.
    const FIELDS: &'static [&'static str] = &[];

    fn append_to(&self, row: &mut Vec<f64>) {
        row.extend(&self.0);
    }

    fn from_row(row: &[f64]) -> Option<Self> {
        Some(Self(row.to_vec()))
    }
}

/// The ages of all chains of a run.
#[derive(Debug)]
pub(crate) struct ChainAges(Vec<ChainAge>);

/// The age of a chain.
#[derive(Clone, Debug, Default)]
struct ChainAge {
    limit: Option<Duration>,
    /// `None` before the first output.
    saw: Option<Sawtooth>,
    /// Run time up to which the time within the limit goes.
    until: Time,
    within: Duration,
}

impl ChainAge {
    fn advance(&mut self, now: Time) {
        let Some(saw) = &self.saw else {
            self.until = now;
            return;
        };
        let until = now.max(self.until);
        let [from, to] = [self.until, until].map(|at| saw.age(at));
        self.within += self.limit.map_or(to, |limit| limit.clamp(from, to)) - from;
        self.until = until;
    }

    fn output(&mut self, origin: Time) {
        let next = |saw: Sawtooth| saw.drop_to(self.until, origin);
        self.saw = Some(self.saw.map_or(Sawtooth::new(self.until, origin), next));
    }

    fn age(&self, now: Time) -> f64 {
        self.saw.map_or(f64::NAN, |saw| ms(saw.age(now)))
    }

    fn greatest(&self) -> f64 {
        self.saw
            .map_or(f64::NAN, |saw| ms(saw.greatest(self.until)))
    }

    fn measured(&self) -> Duration {
        self.saw
            .map_or(Duration::ZERO, |saw| self.until.since(saw.first))
    }

    fn mean(&self) -> f64 {
        let twice_area = self.saw.map_or(0, |saw| saw.twice_area(self.until));
        twice_area as f64 / 2.0 / self.measured().as_nanos() as f64 / 1e6
    }
}

impl ChainAges {
    /// Begins to measure chains with these limits.
    pub(crate) fn new(limits: impl Iterator<Item = Option<Duration>>) -> Self {
        let chains = limits.map(|limit| ChainAge {
            limit,
            ..ChainAge::default()
        });
        Self(chains.collect())
    }

    /// Adds the outputs of some chains at run time `now`, each with the run time at which its
    /// data began; returns the figures of all chains.
    pub(crate) fn row(
        &mut self,
        now: Time,
        outputs: impl IntoIterator<Item = (usize, Option<Time>)>,
    ) -> Numbers {
        let before = self.0.iter_mut().map(|chain| {
            chain.advance(now);
            chain.age(now)
        });
        let before: Vec<f64> = before.collect();
        for (index, origin) in outputs {
            if let (Some(chain), Some(origin)) = (self.0.get_mut(index), origin) {
                chain.output(origin);
            }
        }
        let mut row = vec![ms(now.since(Time::ZERO))];
        for (chain, before) in self.0.iter().zip(before) {
            let [within, measured] = [chain.within, chain.measured()].map(ms);
            let mean = chain.mean();
            let (age, greatest) = (chain.age(now), chain.greatest());
            row.extend([before, age, mean, greatest, within, measured]);
        }
        Numbers(row)
    }
}

/// Returns the age of chain number `chain` just after its newest output, from a `row`; `None`
/// before the first.
pub(crate) fn age_of_newest(row: &[f64], chain: usize) -> Option<Duration> {
    let age = row.get(2 + OF_CHAIN.len() * chain)?;
    (!age.is_nan()).then(|| Duration::from_nanos((age * 1e6).round() as u64))
}

/// The figures of a chain up to a run time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ChainFigures {
    /// The mean age (ms).
    pub(crate) mean: f64,
    /// The greatest age (ms).
    pub(crate) greatest: f64,
    /// The share of the time within the limit.
    pub(crate) share: f64,
}

impl ChainFigures {
    /// Returns the figures of chain number `chain` up to run time `at`, from the newest `row`:
    /// until then its age has grown. `None` without an output.
    pub(crate) fn at(row: &[f64], chain: usize, limit: Option<Duration>, at: Time) -> Option<Self> {
        let numbers = row.get(1 + OF_CHAIN.len() * chain..)?;
        let &[_, after, mean, greatest, within, measured, ..] = numbers else {
            return None;
        };
        let since = (ms(at.since(Time::ZERO)) - row[0]).max(0.0);
        let limit = limit.map_or(f64::INFINITY, ms);
        let total = measured + since;
        let area = if measured > 0.0 { mean * measured } else { 0.0 };
        let late = (after + since - limit.max(after)).clamp(0.0, since);
        if total <= 0.0 {
            // The first output comes at the end.
            let figures = Self {
                mean: after,
                greatest: greatest.max(after),
                share: f64::from(after <= limit),
            };
            return (!after.is_nan()).then_some(figures);
        }
        let figures = Self {
            mean: (area + since * (after + since / 2.0)) / total,
            greatest: greatest.max(after + since),
            share: (within + since - late) / total,
        };
        (!after.is_nan()).then_some(figures)
    }
}

/// Returns the age of chain number `chain` in a message on [`CHAINS`](super::CHAINS), just before its
/// output (ms): the peaks of the age.
pub(crate) fn peak(row: &[f64], chain: usize) -> f64 {
    let at = |field: usize| row.get(1 + OF_CHAIN.len() * chain + field).copied();
    at(0)
        .filter(|age| !age.is_nan())
        .or(at(1))
        .unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_first_output_at_the_end_of_the_run_has_its_age_and_no_gaps() {
        let at = Time::from_nanos(1_000_000_000);
        // At 1 s, after an age of 20 ms, of which nothing is measured yet.
        let row = [1_000.0, f64::NAN, 20.0, f64::NAN, 20.0, 0.0, 0.0];
        let limits = [(10, 0.0), (20, 1.0)];
        for (limit, share) in limits {
            let limit = Some(Duration::from_millis(limit));
            let figures = ChainFigures::at(&row, 0, limit, at).expect("figures");
            let expected = ChainFigures {
                mean: 20.0,
                greatest: 20.0,
                share,
            };
            assert_eq!(figures, expected);
        }
    }
}
