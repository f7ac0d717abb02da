//! The graph with a fault, drawn from the learner's number.

use ratelab_cart_pole::{CartPole, POLICY, SENSOR};
use ratelab_study::experiment::Config;

use super::suspect::{SUSPECTS, Suspect};
use crate::framework::{Failure, SplitMix, own_world};

/// Delay (ms) and loss of a link.
#[derive(Clone, Copy, Debug, Default)]
struct LinkParts {
    delay_ms: f64,
    loss: f64,
}

/// The settings of the graph. Those that differ from the default are the fault, or
/// harmless.
#[derive(Clone, Debug)]
pub struct FaultyGraph {
    /// The fault.
    pub fault: Suspect,
    seed: u64,
    sensor_hz: f64,
    policy_hz: f64,
    actuator_hz: f64,
    sensor_takes_ms: f64,
    policy_takes_ms: f64,
    obs: LinkParts,
    action: LinkParts,
    oldest: bool,
    /// A node that crashes, and when (s).
    crash: Option<(&'static str, f64)>,
}

/// The rate of all nodes without a fault (Hz).
const USUAL_HZ: f64 = 50.0;

/// Depth of the queues: deep enough for one that is read from its old end.
const DEPTH: u32 = 40;

impl FaultyGraph {
    /// The graph of the learner's number `seed`.
    pub fn drawn(seed: u64) -> Self {
        let chance = &mut SplitMix::new(seed, u64::from_le_bytes(*b"a fault "), 0);
        let mut graph = Self {
            fault: SUSPECTS[chance.below(SUSPECTS.len())],
            seed,
            sensor_hz: USUAL_HZ,
            policy_hz: USUAL_HZ,
            actuator_hz: USUAL_HZ,
            sensor_takes_ms: 0.0,
            policy_takes_ms: 0.0,
            obs: LinkParts::default(),
            action: LinkParts::default(),
            oldest: false,
            crash: None,
        };
        graph.add_oddity(chance.below(3));
        graph.add_oddity(3 + chance.below(2));
        graph.add_fault(chance);
        graph
    }

    /// Something that looks odd and does no harm.
    fn add_oddity(&mut self, number: usize) {
        match number {
            0 => self.policy_takes_ms = 4.0,
            1 => self.sensor_hz = 60.0,
            2 => self.action.delay_ms = 3.0,
            3 => self.obs.loss = 0.06,
            _ => self.action.loss = 0.05,
        }
    }

    fn add_fault(&mut self, chance: &mut SplitMix) {
        let mut drawn = |from, to| (chance.within(from, to) * 100.0).round() / 100.0;
        match self.fault {
            Suspect::SensorSlow => self.sensor_hz = drawn(3.5, 4.5),
            Suspect::SensorThinks => self.sensor_takes_ms = drawn(122.0, 139.0),
            Suspect::SensorCrashed => self.crash = Some((SENSOR, drawn(1.0, 4.0))),
            Suspect::PolicySlow => self.policy_hz = drawn(3.5, 4.5),
            Suspect::PolicyThinks => self.policy_takes_ms = drawn(102.0, 139.0),
            Suspect::PolicyCrashed => self.crash = Some((POLICY, drawn(1.0, 4.0))),
            Suspect::ActuatorSlow => self.actuator_hz = drawn(3.5, 4.5),
            Suspect::ObsDelays => self.obs.delay_ms = drawn(122.0, 160.0),
            Suspect::ObsLoses => self.obs.loss = drawn(0.94, 0.96),
            Suspect::ObsQueues => {
                self.oldest = true;
                self.obs.loss = 0.0;
                self.sensor_hz = drawn(52.0, 54.0);
            }
            Suspect::ActionDelays => self.action.delay_ms = drawn(122.0, 160.0),
            Suspect::ActionLoses => self.action.loss = drawn(0.94, 0.96),
        }
    }

    /// This graph with what `suspect` does mended.
    pub fn mended(&self, suspect: Suspect) -> Self {
        let mut graph = self.clone();
        let crashed = |node| self.crash.filter(|(name, _)| *name != node);
        match suspect {
            Suspect::SensorSlow => graph.sensor_hz = self.sensor_hz.max(USUAL_HZ),
            Suspect::SensorThinks => graph.sensor_takes_ms = 0.0,
            Suspect::SensorCrashed => graph.crash = crashed(SENSOR),
            Suspect::PolicySlow => graph.policy_hz = USUAL_HZ,
            Suspect::PolicyThinks => graph.policy_takes_ms = 0.0,
            Suspect::PolicyCrashed => graph.crash = crashed(POLICY),
            Suspect::ActuatorSlow => graph.actuator_hz = USUAL_HZ,
            Suspect::ObsDelays => graph.obs.delay_ms = 0.0,
            Suspect::ObsLoses => graph.obs.loss = 0.0,
            Suspect::ObsQueues => graph.oldest = false,
            Suspect::ActionDelays => graph.action.delay_ms = 0.0,
            Suspect::ActionLoses => graph.action.loss = 0.0,
        }
        graph
    }

    /// A run of ten seconds in the world that does not wait.
    pub fn config(&self) -> Result<Config, Failure> {
        let mut knobs = format!(
            "rate sensor {}, rate policy {}, rate actuator {}, queue-depth {DEPTH}",
            self.sensor_hz, self.policy_hz, self.actuator_hz
        );
        for (node, takes_ms) in [
            (SENSOR, self.sensor_takes_ms),
            (POLICY, self.policy_takes_ms),
        ] {
            if takes_ms > 0.0 {
                knobs += &format!(", takes {node} {takes_ms}");
            }
        }
        if self.oldest {
            knobs += ", read /obs oldest";
        }
        let mut config = own_world(&knobs)?;
        for (topic, parts) in [("/obs", self.obs), ("/action", self.action)] {
            if let Some(link) = parts.link(topic) {
                config.setup.extend(CartPole::KNOBS.parse(&link)?);
            }
        }
        if let Some((node, at)) = self.crash {
            config.knobs = CartPole::KNOBS.parse_timed(&format!("{at} crash {node}"))?;
        }
        config.seed = self.seed;
        Ok(config)
    }
}

impl LinkParts {
    /// The knob of this link on `topic`; `None` for a perfect one.
    fn link(self, topic: &str) -> Option<String> {
        let delay = (self.delay_ms > 0.0).then(|| format!("delay:{}", self.delay_ms));
        let loss = (self.loss > 0.0).then(|| format!("loss:{}", self.loss));
        let parts: Vec<String> = delay.into_iter().chain(loss).collect();
        (!parts.is_empty()).then(|| format!("link {topic} {}", parts.join(",")))
    }
}
