//! The measured mean push age at which policies lose the pole.

use std::time::Duration;

use ratelab::Hz;

use super::{
    plant::actuator_hz,
    policy::{PolicyKind, PolicySpec},
};

/// Mean push ages: below the first the pole stands, above the second it falls, whatever makes the
/// pushes old. Between them it stands if the age is constant, and may fall if it jitters.
pub type AgeBand = [Duration; 2];

/// The bands of the table in `docs/age.md`, measured with some hundred configurations of constant
/// delays, links with jitter, costs with a spread and slow nodes.
///
/// Files are identified by the digest of their content: `policies/prompt.safetensors` and
/// `policies/patient.safetensors`.
const OF_FILES: [(&str, AgeBand); 2] = [
    (
        "9223e0aeb8e8da498392bfa9c0d35d98c8ce6ed62c7b210ab676d7197712ac01",
        band(50, 70),
    ),
    (
        "87ee20fe581fed3383caa34acac933f1f633743008f332a6de2e49e839daf287",
        band(96, 106),
    ),
];

/// The band of `scripted`.
const OF_SCRIPTED: AgeBand = band(74, 90);

/// The band of `lqr` at 50 Hz; its gains are different at other rates.
const OF_LQR: AgeBand = band(84, 90);

const fn band(from: u64, to: u64) -> AgeBand {
    [Duration::from_millis(from), Duration::from_millis(to)]
}

/// The band of mean push ages in which `policy` may lose the pole, with the initial control
/// rate `control`; `None` where it was not measured.
pub fn falls(policy: &PolicySpec, control: Hz) -> Option<AgeBand> {
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
    use std::sync::Arc;

    use ratelab_study::{
        experiment::{Config, Experiment},
        system::WorldKind,
    };

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

    /// Seed 0, with knobs, the range of the mean push age (ms), and whether it stands.
    #[test]
    fn in_the_band_a_constant_age_stands_and_one_that_jitters_may_fall() {
        let [from, to] = OF_SCRIPTED.map(|age| age.as_secs_f64() * 1e3);
        for (link, ages, stands) in [
            ("delay:80", to..=to + 0.1, true),
            ("delay:40..100", from..=to, false),
            ("delay:84", to + 0.1..=to + 20.1, false),
        ] {
            let setup = format!("link /action {link}");
            let config = crate::CartPole::config(&setup).expect("knobs");
            let config = Config {
                world: WorldKind::OWN,
                ..config
            };
            let run = Experiment::new(Arc::new(crate::CartPole::default()), &config);
            let summary = run.expect("a graph").run().expect("no fault");
            let age = summary.push_age().expect("pushes").late_s * 1e3;
            assert!(ages.contains(&age), "{link}: {age}");
            assert_eq!(!summary.verdict.is_lost(), stands, "{link}");
        }
    }

    #[test]
    fn the_bands_are_those_of_the_page() {
        let page = include_str!("../../../docs/age.md");
        let files = OF_FILES.map(|(_, limit)| limit);
        let bands = [OF_SCRIPTED, OF_LQR].into_iter().chain(files);
        for (name, [from, to]) in ["scripted", "lqr", "prompt", "patient"].iter().zip(bands) {
            let (from, to) = (from.as_millis(), to.as_millis());
            assert!(from <= to, "{name}");
            let row = format!("| {name} | {from} to {to} |");
            assert!(page.contains(&row), "{row}");
        }
    }
}
