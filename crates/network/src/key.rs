//! Names on the wire.
//!
//! | key | what |
//! |---|---|
//! | `ratelab/1/SYSTEM/data/NODE/TOPIC` | messages of a topic, from one of its publishers |
//! | `ratelab/1/SYSTEM/process/ID` | presence of a process, as a liveliness token |
//! | `ratelab/1/SYSTEM/process/ID/clock` | query: its clock, for the offset |
//! | `ratelab/1/SYSTEM/process/ID/info` | query: what runs there |
//! | `ratelab/1/SYSTEM/process/ID/command` | query: a command for its nodes |
//! | `ratelab/1/SYSTEM/process/ID/telemetry` | what happened there, for dashboards |

/// The keys of one system.
#[derive(Clone, Debug)]
pub struct Keys {
    root: String,
}

/// What can be asked of a process, and what it sends: the last part of a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Of(&'static str);

impl Of {
    /// Its clock.
    pub const CLOCK: Self = Self("clock");
    /// What runs there.
    pub const INFO: Self = Self("info");
    /// A command for it.
    pub const COMMAND: Self = Self("command");
    /// What happened there.
    pub const TELEMETRY: Self = Self("telemetry");
}

impl Keys {
    /// Creates the keys of the system called `system`.
    pub fn new(system: &str) -> Self {
        let root = format!("ratelab/1/{}", chunk(system));
        Self { root }
    }

    /// Returns the key of the messages of `node` on `topic`.
    pub fn data(&self, node: &str, topic: &str) -> String {
        let parts: Vec<String> = topic
            .split('/')
            .filter(|part| !part.is_empty())
            .map(chunk)
            .collect();
        format!("{}/data/{}/{}", self.root, chunk(node), parts.join("/"))
    }

    /// Returns the key of the presence of a process.
    pub fn process(&self, incarnation: u64) -> String {
        format!("{}/process/{incarnation:016x}", self.root)
    }

    /// Returns the keys of all presences.
    pub fn processes(&self) -> String {
        format!("{}/process/*", self.root)
    }

    /// The keys of the presences of all systems.
    pub const ALL: &str = "ratelab/1/*/process/*";

    /// Returns the name of the system that a presence is of, as in the key, unless it is ours.
    pub fn other_system<'a>(&self, presence: &'a str) -> Option<&'a str> {
        let (root, _) = presence.split_once("/process/")?;
        let name = root.strip_prefix("ratelab/1/")?;
        (root != self.root).then_some(name)
    }

    /// Returns the key of one thing of a process.
    pub fn endpoint(&self, incarnation: u64, of: Of) -> String {
        format!("{}/{}", self.process(incarnation), of.0)
    }

    /// Returns the keys of one thing of all processes.
    pub fn all_endpoints(&self, of: Of) -> String {
        format!("{}/{}", self.processes(), of.0)
    }

    /// Returns the process that a key is of.
    pub fn incarnation(&self, key: &str) -> Option<u64> {
        let of = key.strip_prefix(&self.root)?.strip_prefix("/process/")?;
        let id = of.split('/').next()?;
        u64::from_str_radix(id, 16).ok().filter(|_| id.len() == 16)
    }
}

/// Returns a name as one part of a key: other characters than letters, digits, `_`, `.` and `-` as
/// `%` with two digits for each byte.
fn chunk(name: &str) -> String {
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b"_.-".contains(&byte);
    let parts = name.bytes().map(|byte| {
        if is_plain(byte) {
            char::from(byte).to_string()
        } else {
            format!("%{byte:02x}")
        }
    });
    parts.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_with_any_characters_are_keys() {
        let keys = Keys::new("cart-pole");
        assert_eq!(
            keys.data("policy", "/action"),
            "ratelab/1/cart-pole/data/policy/action"
        );
        assert_eq!(
            Keys::new("a/*$ü").data("n?#", "/x//y z"),
            "ratelab/1/a%2f%2a%24%c3%bc/data/n%3f%23/x/y%20z"
        );
    }

    #[test]
    fn a_process_is_known_by_its_keys() {
        let keys = Keys::new("cart-pole");
        for id in [0, 7, u64::MAX] {
            assert_eq!(keys.incarnation(&keys.process(id)), Some(id));
            assert_eq!(keys.incarnation(&keys.endpoint(id, Of::INFO)), Some(id));
        }
        for key in [
            "",
            "ratelab/1/cart-pole/process/7",
            "ratelab/1/drone/process/0",
        ] {
            assert_eq!(keys.incarnation(key), None, "{key}");
        }
    }
}
