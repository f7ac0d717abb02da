//! Faults as lists of smallest parts, and how long the parts of delays, hangs and shifts are.

use std::time::Duration;

use ratelab::{Knob, Time, TimedKnob, Topology};
use ratelab_system::Setup;

use super::{Budget, HuntError, MOST_PARTS};

/// The smallest part of a fault. A longer delay or hang is the same part several times in
/// a list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum FaultPart {
    /// The message with this number is lost.
    Lost(u64),
    /// The message with this number is delivered one part of a delay later.
    Late(u64),
    /// The next tick from this run time on takes one part of a hang per such part in the list.
    Hang(Time),
    /// The node that may be shifted is due one part of a shift later.
    Shift,
}

/// Returns the number of parts of a length of `unit` in `duration`.
fn parts(duration: Duration, unit: Duration) -> usize {
    let parts = duration.as_nanos() / unit.as_nanos();
    usize::try_from(parts).unwrap_or(usize::MAX)
}

impl Budget {
    /// Returns the number of parts of each kind: lost and late messages, those of a hang and of a
    /// shift.
    pub(super) fn counts(&self) -> [usize; 4] {
        let [delay, hang, shift] = self.lengths().map(|(length, part, _)| parts(length, part));
        [self.lose, delay, hang, shift]
    }

    /// Returns what is allowed of a delay, a hang and a shift, with the length of a part and its
    /// name.
    fn lengths(&self) -> [(Duration, Duration, &'static str); 3] {
        let longest = |of: &Option<(String, Duration)>| {
            of.as_ref().map_or(Duration::ZERO, |(_, longest)| *longest)
        };
        [
            (self.delay, self.parts.delay, "delay"),
            (longest(&self.hang), self.parts.hang, "hang"),
            (longest(&self.shift), self.parts.shift, "shift"),
        ]
    }

    /// Returns whether `list` is within it.
    pub(super) fn allows(&self, list: &[FaultPart]) -> bool {
        let kinds: [fn(&FaultPart) -> bool; 4] = [
            |part| matches!(part, FaultPart::Lost(_)),
            |part| matches!(part, FaultPart::Late(_)),
            |part| matches!(part, FaultPart::Hang(_)),
            |part| matches!(part, FaultPart::Shift),
        ];
        kinds
            .iter()
            .zip(self.counts())
            .all(|(kind, most)| list.iter().filter(|part| kind(part)).count() <= most)
    }

    /// Refuses an empty budget, and one with too many parts or less than a part.
    pub(super) fn check(&self) -> Result<(), HuntError> {
        let lengths = self.lengths();
        if self.lose == 0 && lengths.iter().all(|(length, ..)| length.is_zero()) {
            return Err(HuntError::NoBudget);
        }
        if self.counts().iter().any(|count| *count > MOST_PARTS) {
            return Err(HuntError::TooMuch);
        }
        let short = lengths
            .into_iter()
            .find(|(length, part, _)| !length.is_zero() && length < part);
        short.map_or(Ok(()), |(length, part, what)| {
            Err(HuntError::TooLittle { what, length, part })
        })
    }

    /// Returns the knobs for the faults of `list`.
    pub(super) fn knobs(&self, list: &[FaultPart]) -> Vec<TimedKnob> {
        let mut list = list.to_vec();
        list.sort_unstable();
        let same = list.chunk_by(|one, next| one == next);
        let knobs = same.map(|same| self.knob(same[0], same.len() as u32));
        let mut knobs: Vec<_> = knobs.collect();
        knobs.sort_by_key(|timed| timed.at);
        knobs
    }

    fn knob(&self, part: FaultPart, times: u32) -> TimedKnob {
        let (topic, delay) = (self.topic.clone(), self.parts.delay * times);
        let (at, knob) = match part {
            FaultPart::Lost(seq) => (Time::ZERO, Knob::Lose { topic, seq }),
            FaultPart::Late(seq) => (Time::ZERO, Knob::Postpone { topic, seq, delay }),
            FaultPart::Hang(at) => {
                let node = self.hang.as_ref().map(|(node, _)| node.clone());
                let (node, cost) = (node.unwrap_or_default(), self.parts.hang * times);
                (at, Knob::Hang { node, cost })
            }
            FaultPart::Shift => {
                let node = self.shift.as_ref().map(|(node, _)| node.clone());
                let offset = self.offset + self.parts.shift * times;
                let node = node.unwrap_or_default();
                (Time::ZERO, Knob::Offset { node, offset })
            }
        };
        TimedKnob { at, knob }
    }
}

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

#[cfg(test)]
mod tests {
    use ratelab::{Graph, Tick};

    use super::*;

    fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    fn of(node: &str, longest: Duration) -> Option<(String, Duration)> {
        Some((node.to_owned(), longest))
    }

    fn budget() -> Budget {
        Budget {
            topic: "/image".to_owned(),
            lose: 2,
            delay: ms(25),
            hang: of("control", ms(30)),
            shift: of("camera", ms(5)),
            ..Budget::default()
        }
    }

    #[test]
    fn a_budget_has_as_many_whole_parts_as_fit_and_allows_no_more() {
        assert_eq!(budget().counts(), [2, 2, 3, 5]);
        let (lost, late) = (FaultPart::Lost(4), FaultPart::Late(4));
        for (list, allowed) in [
            (vec![], true),
            (vec![lost, FaultPart::Lost(5), late, late], true),
            (vec![lost; 3], false),
            (vec![late; 3], false),
            (vec![FaultPart::Hang(Time::ZERO); 4], false),
            (vec![FaultPart::Shift; 5], true),
            (vec![FaultPart::Shift; 6], false),
        ] {
            assert_eq!(budget().allows(&list), allowed, "{list:?}");
        }
    }

    #[test]
    fn a_budget_of_nothing_of_less_than_a_part_and_of_too_much_is_refused() {
        for (budget, expected) in [
            (budget(), None),
            (Budget::default(), Some("no faults to try")),
            (
                Budget {
                    lose: MOST_PARTS + 1,
                    ..budget()
                },
                Some("a budget has 1000 messages at most"),
            ),
            (
                Budget {
                    delay: ms(9),
                    ..budget()
                },
                Some("a delay of 9 ms is less than the smallest one that is tried: allow 10 ms"),
            ),
            (
                Budget {
                    shift: of("camera", Duration::from_micros(900)),
                    ..budget()
                },
                Some("a shift of 0.9 ms is less than the smallest one"),
            ),
        ] {
            let found = budget.check().err().map(|error| error.to_string());
            let as_expected = match (&found, expected) {
                (None, None) => true,
                (Some(found), Some(expected)) => found.contains(expected),
                _ => false,
            };
            assert!(as_expected, "{found:?}, not {expected:?}");
        }
    }

    #[test]
    fn equal_parts_are_one_fault_of_their_length_together() {
        let list = [
            FaultPart::Late(3),
            FaultPart::Lost(1),
            FaultPart::Late(3),
            FaultPart::Shift,
            FaultPart::Hang(Time::from_nanos(7_000_000)),
        ];
        let knobs: Vec<String> = budget()
            .knobs(&list)
            .iter()
            .map(|timed| format!("{} {}", timed.at, timed.knob))
            .collect();
        assert_eq!(
            knobs,
            [
                "0.000 s lose /image 1",
                "0.000 s postpone /image 3 20",
                "0.000 s offset camera 1",
                "0.007 s hang control 10",
            ]
        );
    }

    #[test]
    fn parts_follow_the_periods_of_the_graph_and_grow_where_there_would_be_too_many() {
        let mut graph = Graph::new();
        let image = graph.topic("/image");
        graph
            .node("camera", 100.0, 0, |wiring| {
                let image = wiring.publisher(&image);
                move |tick: &mut Tick| tick.publish(&image, 0.0)
            })
            .expect("a node");
        graph
            .node("control", 1_000.0, 1, |_| |_: &mut Tick| {})
            .expect("a node");
        let fitted = |delay| {
            let budget = Budget { delay, ..budget() };
            budget.fitted(&graph.topology(), &Setup::default()).parts
        };
        // Half a period of 10 ms and of 1 ms, a tenth of 10 ms.
        let expected = PartLengths {
            delay: ms(5),
            hang: Duration::from_micros(500),
            shift: ms(1),
        };
        assert_eq!(fitted(ms(25)), expected);
        assert_eq!(fitted(Duration::from_secs(8)).delay, ms(10));
    }
}
