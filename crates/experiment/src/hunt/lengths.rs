//! How long the smallest parts of delays, hangs and shifts are.

use std::time::Duration;

use ratelab::Topology;

use super::{Budget, MOST_PARTS};
use ratelab_system::Setup;

/// The longest part of a delay or a hang.
pub const LONGEST_PART: Duration = Duration::from_millis(10);

/// The longest part of a shift.
pub const LONGEST_SHIFT: Duration = Duration::from_millis(1);

/// Lengths of parts (ns), the longest first.
const LENGTHS: [u64; 13] = [
    10_000_000, 5_000_000, 2_000_000, 1_000_000, 500_000, 200_000, 100_000, 50_000, 20_000, 10_000,
    5_000, 2_000, 1_000,
];

/// The lengths of the smallest parts of faults.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PartLengths {
    /// A part of a delay.
    pub delay: Duration,
    /// A part of a hang.
    pub hang: Duration,
    /// A part of a shift.
    pub shift: Duration,
}

impl Default for PartLengths {
    fn default() -> Self {
        Self {
            delay: LONGEST_PART,
            hang: LONGEST_PART,
            shift: LONGEST_SHIFT,
        }
    }
}

impl Budget {
    /// This budget in parts that follow the periods in the graph `topology` with `setup`: delays
    /// and hangs half a period of the publisher or the node at the most, shifts a tenth. They are
    /// longer where a budget would have more than [`MOST_PARTS`] of them.
    #[must_use]
    pub fn fitted(&self, topology: &Topology, setup: &Setup) -> Self {
        let rates = topology.rates(|node| {
            let node = &topology.nodes[node];
            setup.rate(&node.name).unwrap_or(node.hz)
        });
        let period = |node: usize| rates[node].period();
        let of_topic = topology.topic(&self.topic).and_then(|topic| {
            topology.topics[topic]
                .publishers
                .iter()
                .map(|node| period(*node))
                .min()
        });
        let of_node = |of: &Option<(String, Duration)>| {
            of.as_ref()
                .and_then(|(name, longest)| Some((period(topology.node(name)?), *longest)))
        };
        let usual = PartLengths::default();
        let fit = |of: Option<(Duration, Duration)>, share: u32, usual: Duration| {
            of.map_or(usual, |(period, most)| {
                length(period / share, most).min(usual)
            })
        };
        let delay = of_topic.map(|period| (period, self.delay));
        let parts = PartLengths {
            delay: fit(delay, 2, usual.delay),
            hang: fit(of_node(&self.hang), 2, usual.hang),
            shift: fit(of_node(&self.shift), 10, usual.shift),
        };
        Self {
            parts,
            ..self.clone()
        }
    }
}

/// Returns the longest length up to `longest` of which `most` has not more than [`MOST_PARTS`]; a
/// longer one if there is none.
fn length(longest: Duration, most: Duration) -> Duration {
    let lengths = LENGTHS.into_iter().map(Duration::from_nanos);
    let fits = |length: &Duration| most.as_nanos() <= length.as_nanos() * MOST_PARTS as u128;
    let enough = lengths.filter(fits);
    let shortest = enough.clone().next_back();
    let found = enough.into_iter().find(|length| *length <= longest);
    found.or(shortest).unwrap_or(LONGEST_PART)
}
