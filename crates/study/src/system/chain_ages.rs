//! Data ages along chains, over time.
//!
//! The age of a chain is run time now minus the run time at which the data behind its newest
//! output began. It grows with time and drops with a fresher output, so all figures here are
//! over run time, from the first output of the chain on.

use std::time::Duration;

use ratelab::Time;
use ratelab_account::Fields;

/// Maximum number of chains of a graph.
pub(crate) const MOST_CHAINS: usize = 16;

/// Names of the numbers of a chain in a message on [`CHAINS`](super::CHAINS).
const OF_CHAIN: [&str; 6] = [
    "age before (ms)",
    "age after (ms)",
    "mean age (ms)",
    "greatest age (ms)",
    "within limit (ms)",
    "measured (ms)",
];

/// The names of all numbers for these chains.
pub(crate) fn chain_fields<'n>(names: impl Iterator<Item = &'n str>) -> Vec<String> {
    let of_chains = names.flat_map(|name| OF_CHAIN.map(|field| format!("{name} {field}")));
    ["at (ms)".to_owned()]
        .into_iter()
        .chain(of_chains)
        .collect()
}

/// The numbers of a message on a topic of a graph file.
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
    /// Run times at which the data in force began, of the first output, and up to which the
    /// sums below go.
    origin: Option<Time>,
    first: Time,
    until: Time,
    /// The time within the limit.
    within: Duration,
    greatest: Duration,
    /// Twice the integral of the age (ns²), as a whole number.
    twice_area: u128,
}

impl ChainAge {
    fn advance(&mut self, now: Time) {
        let Some(origin) = self.origin else { return };
        let [from, to] = [self.until, now.max(self.until)].map(|at| at.since(origin));
        self.twice_area += to.as_nanos().pow(2) - from.as_nanos().pow(2);
        let within = self.limit.map_or(to, |limit| limit.clamp(from, to)) - from;
        self.within += within;
        self.greatest = self.greatest.max(to);
        self.until = now.max(self.until);
    }

    fn age(&self, now: Time) -> f64 {
        self.origin.map_or(f64::NAN, |origin| ms(now.since(origin)))
    }

    fn output(&mut self, now: Time, origin: Time) {
        if self.origin.is_none() {
            (self.first, self.until) = (now, now);
        }
        self.origin = Some(origin);
        self.greatest = self.greatest.max(now.since(origin));
    }

    fn measured(&self) -> Duration {
        self.until.since(self.first)
    }

    fn mean(&self) -> f64 {
        self.twice_area as f64 / 2.0 / self.measured().as_nanos() as f64 / 1e6
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
                chain.output(now, origin);
            }
        }
        let mut row = vec![ms(now.since(Time::ZERO))];
        for (chain, before) in self.0.iter().zip(before) {
            let greatest = chain.origin.map_or(f64::NAN, |_| ms(chain.greatest));
            let [within, measured] = [chain.within, chain.measured()].map(ms);
            let mean = chain.mean();
            row.extend([before, chain.age(now), mean, greatest, within, measured]);
        }
        Numbers(row)
    }
}

fn ms(duration: Duration) -> f64 {
    duration.as_nanos() as f64 / 1e6
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
    /// The figures of chain number `chain` up to run time `at`, from the newest `row`: until
    /// then its age has grown. `None` without an output.
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
        let figures = Self {
            mean: (area + since * (after + since / 2.0)) / total,
            greatest: greatest.max(after + since),
            share: (within + since - late) / total,
        };
        (!after.is_nan()).then_some(figures)
    }
}

/// The age of chain number `CHAIN` in a message on [`CHAINS`](super::CHAINS), just before its
/// output (ms): the peaks of the age.
fn peak<const CHAIN: usize>(row: &[f64]) -> f64 {
    let at = |field: usize| row.get(1 + OF_CHAIN.len() * CHAIN + field).copied();
    let before = at(0).filter(|age| !age.is_nan());
    before.or(at(1)).unwrap_or(f64::NAN)
}

/// The peaks of each possible chain.
pub(crate) const PEAKS: [fn(&[f64]) -> f64; MOST_CHAINS] = [
    peak::<0>, peak::<1>, peak::<2>, peak::<3>, peak::<4>, peak::<5>, peak::<6>, peak::<7>,
    peak::<8>, peak::<9>, peak::<10>, peak::<11>, peak::<12>, peak::<13>, peak::<14>, peak::<15>,
];

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ms: u64) -> Time {
        Time::from_nanos(ms * 1_000_000)
    }

    #[test]
    fn ages_are_over_time_from_the_first_output_to_the_end_also_after_the_last_one() {
        let limit = Some(Duration::from_millis(100));
        let mut ages = ChainAges::new([limit].into_iter());
        let none = ages.row(at(10), [(0, None)]);
        assert_eq!(ChainFigures::at(&none.0, 0, limit, at(10)), None);
        // 50 to 150 ms old for 100 ms, 50 of them within the limit,
        ages.row(at(60), [(0, Some(at(10)))]);
        // then 20 to 120 ms old for 100 ms, 80 of them within it.
        let last = ages.row(at(160), [(0, Some(at(140)))]).0;
        assert_eq!(last[1..3], [150.0, 20.0]);
        let at_once = ChainFigures::at(&last, 0, limit, at(160)).expect("an output");
        assert_eq!(
            (at_once.mean, at_once.greatest, at_once.share),
            (100.0, 150.0, 0.5)
        );
        let later = ChainFigures::at(&last, 0, limit, at(260)).expect("an output");
        assert_eq!(
            (later.mean, later.greatest, later.share),
            (85.0, 150.0, 0.65)
        );
    }
}
