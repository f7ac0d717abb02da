//! The measured mean push age at which policies lose the pole.

use std::time::Duration;

use ratelab::Hz;

use super::{
    plant::actuator_hz,
    policy::{PolicyKind, PolicySpec},
};

/// The limits of the table in `docs/age.md`, which `examples/age/` measures.
///
/// Files are identified by the digest of their content: `policies/prompt.safetensors` and
/// `policies/patient.safetensors`.
const OF_FILES: [(&str, Duration); 2] = [
    (
        "9223e0aeb8e8da498392bfa9c0d35d98c8ce6ed62c7b210ab676d7197712ac01",
        Duration::from_millis(60),
    ),
    (
        "87ee20fe581fed3383caa34acac933f1f633743008f332a6de2e49e839daf287",
        Duration::from_millis(104),
    ),
];

/// The limit of `scripted`.
const OF_SCRIPTED: Duration = Duration::from_millis(90);

/// The limit of `lqr` at 50 Hz; its gains are different at other rates.
const OF_LQR: Duration = Duration::from_millis(103);

/// The mean push age at and above which `policy` loses the pole, with the initial control
/// rate `control`; `None` where it was not measured.
pub fn falls(policy: &PolicySpec, control: Hz) -> Option<Duration> {
    match policy {
        PolicySpec::BuiltIn(PolicyKind::Scripted) => Some(OF_SCRIPTED),
        PolicySpec::BuiltIn(PolicyKind::Lqr) => (control == actuator_hz()).then_some(OF_LQR),
        PolicySpec::BuiltIn(PolicyKind::Zero | PolicyKind::Random) => None,
        PolicySpec::File(_) => {
            let pinned = policy.to_string();
            let mut files = OF_FILES.iter();
            let file = files.find(|(digest, _)| pinned.ends_with(digest));
            file.map(|(_, limit)| *limit)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_of_what_was_measured_and_of_nothing_else() {
        let limit = |policy: &str, hz: f64| {
            let policy = policy.parse().expect("policy");
            falls(&policy, Hz::new(hz).expect("rate"))
        };
        assert_eq!(limit("scripted", 7.0), Some(OF_SCRIPTED));
        assert_eq!(limit("lqr", 50.0), Some(OF_LQR));
        assert_eq!(limit("lqr", 25.0), None);
        assert_eq!(limit("random", 50.0), None);
        assert_eq!(limit("policies/patient.safetensors", 50.0), None);
        for file in ["prompt", "patient"] {
            let path = format!(
                "{}/../../policies/{file}.safetensors",
                env!("CARGO_MANIFEST_DIR")
            );
            let spec: PolicySpec = path.parse().expect("a file");
            let pinned = spec.load().expect("weights").spec().clone();
            assert!(
                falls(&pinned, actuator_hz()).is_some(),
                "{pinned}: not measured"
            );
        }
    }

    /// `examples/age/` writes the page.
    #[test]
    fn the_limits_are_those_of_the_page() {
        let page = include_str!("../../../docs/age.md");
        let files = OF_FILES.map(|(_, limit)| limit);
        let limits = [OF_SCRIPTED, OF_LQR].into_iter().chain(files);
        for (name, limit) in ["scripted", "lqr", "prompt", "patient"].iter().zip(limits) {
            let row = page
                .lines()
                .find(|line| line.starts_with(&format!("| {name} | ")));
            let cells: Vec<&str> = row.expect(name).split('|').map(str::trim).collect();
            let falls = limit.as_millis().to_string();
            assert_eq!(cells[3], falls, "{name}");
        }
    }
}
