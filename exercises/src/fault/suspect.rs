//! The suspects: a node or topic, and what it does.

/// A possible fault. The question names them in this order.
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

/// All suspects.
pub const SUSPECTS: [Suspect; 12] = [
    Suspect::SensorSlow,
    Suspect::SensorThinks,
    Suspect::SensorCrashed,
    Suspect::PolicySlow,
    Suspect::PolicyThinks,
    Suspect::PolicyCrashed,
    Suspect::ActuatorSlow,
    Suspect::ObsDelays,
    Suspect::ObsLoses,
    Suspect::ObsQueues,
    Suspect::ActionDelays,
    Suspect::ActionLoses,
];

impl Suspect {
    /// What it did, as a sentence.
    pub fn sentence(self) -> &'static str {
        match self {
            Self::SensorSlow => "The sensor looks too seldom.",
            Self::SensorThinks => {
                "The sensor's ticks take so long that most of its periods are overruns."
            }
            Self::SensorCrashed => {
                "The sensor crashed, and its last reading was used again and again."
            }
            Self::PolicySlow => "The policy decides too seldom.",
            Self::PolicyThinks => {
                "The policy's ticks take so long that most of its periods are overruns."
            }
            Self::PolicyCrashed => "The policy crashed, and its last action was held.",
            Self::ActuatorSlow => "The actuator applies too few of the actions.",
            Self::ObsDelays => "Readings are under way on /obs for too long.",
            Self::ObsLoses => "The link of /obs loses most of the readings.",
            Self::ObsQueues => {
                "The queue of /obs is read from its old end, by a policy a little slower than the sensor."
            }
            Self::ActionDelays => "Actions are under way on /action for too long.",
            Self::ActionLoses => "The link of /action loses most of the actions.",
        }
    }
}
