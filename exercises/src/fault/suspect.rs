//! The suspects: a node or topic, and what it does.

/// A possible fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Suspect {
    /// The sensor has a low rate.
    SensorSlow,
    /// The sensor's ticks take long.
    SensorThinks,
    /// The sensor crashes.
    SensorCrashed,
    /// The policy has a low rate.
    PolicySlow,
    /// The policy's ticks take long.
    PolicyThinks,
    /// The policy crashes.
    PolicyCrashed,
    /// The actuator has a low rate.
    ActuatorSlow,
    /// Readings are long under way.
    ObsDelays,
    /// Readings are lost.
    ObsLoses,
    /// Readings wait in a queue that is read from its old end.
    ObsQueues,
    /// Actions are long under way.
    ActionDelays,
    /// Actions are lost.
    ActionLoses,
}

/// All suspects, with their names and what they are accused of.
const ALL: [(Suspect, &str, &str); 12] = [
    (
        Suspect::SensorSlow,
        "sensor slow",
        "The sensor looks too seldom.",
    ),
    (
        Suspect::SensorThinks,
        "sensor thinks",
        "The sensor's ticks take so long that most of its periods are overruns.",
    ),
    (
        Suspect::SensorCrashed,
        "sensor crashed",
        "The sensor crashed, and its last reading was used again and again.",
    ),
    (
        Suspect::PolicySlow,
        "policy slow",
        "The policy decides too seldom.",
    ),
    (
        Suspect::PolicyThinks,
        "policy thinks",
        "The policy's ticks take so long that most of its periods are overruns.",
    ),
    (
        Suspect::PolicyCrashed,
        "policy crashed",
        "The policy crashed, and its last action was held.",
    ),
    (
        Suspect::ActuatorSlow,
        "actuator slow",
        "The actuator applies too few of the actions.",
    ),
    (
        Suspect::ObsDelays,
        "/obs delays",
        "Readings are under way on /obs for too long.",
    ),
    (
        Suspect::ObsLoses,
        "/obs loses",
        "The link of /obs loses most of the readings.",
    ),
    (
        Suspect::ObsQueues,
        "/obs queues",
        "The queue of /obs is read from its old end, by a policy a little slower than the sensor.",
    ),
    (
        Suspect::ActionDelays,
        "/action delays",
        "Actions are under way on /action for too long.",
    ),
    (
        Suspect::ActionLoses,
        "/action loses",
        "The link of /action loses most of the actions.",
    ),
];

/// All suspects.
pub const SUSPECTS: [Suspect; ALL.len()] = {
    let mut suspects = [Suspect::SensorSlow; ALL.len()];
    let mut index = 0;
    while index < ALL.len() {
        suspects[index] = ALL[index].0;
        index += 1;
    }
    suspects
};

/// Their names, in the same order.
pub const NAMES: [&str; ALL.len()] = {
    let mut names = [""; ALL.len()];
    let mut index = 0;
    while index < ALL.len() {
        names[index] = ALL[index].1;
        index += 1;
    }
    names
};

impl Suspect {
    /// What it did, as a sentence.
    pub fn sentence(self) -> &'static str {
        let mut all = ALL.into_iter();
        let found = all.find(|(suspect, ..)| *suspect == self);
        found.map_or("", |(_, _, sentence)| sentence)
    }
}
