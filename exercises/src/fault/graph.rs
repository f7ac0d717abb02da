//! The graph with a fault, drawn from the learner's number: each of its settings is a suspect.

use std::collections::BTreeMap;

use ratelab_cart_pole::CartPole;
use ratelab_experiment::Config;

use crate::framework::{Failure, SplitMix, own_world};

/// A setting that may be the fault: its knob, with `{}` where its number goes, the least and
/// the greatest number of a fault, and what it then did. The time of a crash stands before it.
type Suspect = (&'static str, [f64; 2], &'static str);

/// All suspects. The question names them in this order.
pub const SUSPECTS: [Suspect; 12] = [
    ("rate sensor {}", [3.5, 4.5], "The sensor looks too seldom."),
    (
        "takes sensor {}",
        [122.0, 139.0],
        "The sensor's ticks take so long that most of its periods are overruns.",
    ),
    (
        "{} crash sensor",
        [1.0, 4.0],
        "The sensor crashed, and its last reading was used again and again.",
    ),
    (
        "rate policy {}",
        [3.5, 4.5],
        "The policy decides too seldom.",
    ),
    (
        "takes policy {}",
        [102.0, 139.0],
        "The policy's ticks take so long that most of its periods are overruns.",
    ),
    (
        "{} crash policy",
        [1.0, 4.0],
        "The policy crashed, and its last action was held.",
    ),
    (
        "rate actuator {}",
        [3.5, 4.5],
        "The actuator applies too few of the actions.",
    ),
    (
        "link /obs delay:{}",
        [122.0, 160.0],
        "Readings are under way on /obs for too long.",
    ),
    (
        "link /obs loss:{}",
        [0.94, 0.96],
        "The link of /obs loses most of the readings.",
    ),
    (
        "read /obs oldest",
        [52.0, 54.0],
        "The queue of /obs is read from its old end, by a policy a little slower than the sensor.",
    ),
    (
        "link /action delay:{}",
        [122.0, 160.0],
        "Actions are under way on /action for too long.",
    ),
    (
        "link /action loss:{}",
        [0.94, 0.96],
        "The link of /action loses most of the actions.",
    ),
];

/// Something that looks odd and does no harm: a knob and its number. One of the first three
/// and one of the others is in each graph.
const ODDITIES: [(&str, f64); 5] = [
    ("takes policy {}", 4.0),
    ("rate sensor {}", 60.0),
    ("link /action delay:{}", 3.0),
    ("link /obs loss:{}", 0.06),
    ("link /action loss:{}", 0.05),
];

/// The rate of all nodes without a fault (Hz).
const USUAL_HZ: f64 = 50.0;

/// Depth of the queues: deep enough for one that is read from its old end.
const DEPTH: u32 = 40;

/// The settings of the graph. Settings that differ from the default are the fault, or
/// harmless.
#[derive(Clone, Debug)]
pub struct FaultyGraph {
    /// The place of the fault among the suspects.
    pub fault: usize,
    seed: u64,
    /// The number of each suspect; zero where it does nothing.
    settings: [f64; SUSPECTS.len()],
}

/// Returns the place of the suspect with this knob.
fn place(of: &str) -> usize {
    let known = SUSPECTS.iter().position(|(knob, ..)| *knob == of);
    known.unwrap_or_default()
}

/// Returns the number of a suspect that does nothing.
fn usual((knob, ..): &Suspect) -> f64 {
    if knob.starts_with("rate") {
        USUAL_HZ
    } else {
        0.0
    }
}

impl FaultyGraph {
    /// Creates the graph of the learner's number `seed`.
    pub fn drawn(seed: u64) -> Self {
        let chance = &mut SplitMix::new(seed, u64::from_le_bytes(*b"a fault "), 0);
        let fault = chance.below(SUSPECTS.len());
        let mut settings = SUSPECTS.each_ref().map(usual);
        for (knob, number) in [ODDITIES[chance.below(3)], ODDITIES[3 + chance.below(2)]] {
            settings[place(knob)] = number;
        }
        let (knob, [from, to], _) = SUSPECTS[fault];
        let drawn = (chance.within(from, to) * 100.0).round() / 100.0;
        settings[fault] = drawn;
        if knob == "read /obs oldest" {
            // Nothing but the queue makes the readings fewer.
            settings[place("link /obs loss:{}")] = 0.0;
            settings[place("rate sensor {}")] = drawn;
        }
        Self {
            fault,
            seed,
            settings,
        }
    }

    /// This graph with what the suspect at `place` does mended. A rate above the usual one is
    /// no fault.
    pub fn mended(&self, place: usize) -> Self {
        let mut graph = self.clone();
        let usual = usual(&SUSPECTS[place]);
        graph.settings[place] = if usual > 0.0 {
            usual.max(self.settings[place])
        } else {
            usual
        };
        graph
    }

    /// Returns a run of ten seconds in the world that does not wait.
    pub fn config(&self) -> Result<Config, Failure> {
        let mut config = own_world(&format!("queue-depth {DEPTH}"))?;
        // The parts of a link stand in one knob.
        let mut knobs = BTreeMap::<&str, Vec<String>>::new();
        let turned = SUSPECTS.iter().zip(self.settings);
        for ((knob, ..), number) in turned.filter(|(_, number)| *number > 0.0) {
            match knob.rsplit_once(' ') {
                Some((name, value)) if !knob.starts_with("{}") => {
                    knobs
                        .entry(name)
                        .or_default()
                        .push(value.replace("{}", &number.to_string()));
                }
                _ => {
                    let crash = knob.replace("{}", &number.to_string());
                    config.knobs.extend(CartPole::KNOBS.parse_timed(&crash)?);
                }
            }
        }
        for (knob, values) in knobs {
            let knob = format!("{knob} {}", values.join(","));
            config.setup.extend(CartPole::KNOBS.parse(&knob)?);
        }
        config.seed = self.seed;
        Ok(config)
    }
}
