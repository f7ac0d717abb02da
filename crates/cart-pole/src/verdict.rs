//! Verdicts of the cart-pole: whether and how it fell.

use std::time::Duration;

use ratelab::Hz;
use ratelab_system::VerdictKind;

use crate::{
    plant::actuator_hz,
    policy::{PolicyKind, PolicySpec},
};

/// The pole was up for the whole run.
pub const BALANCED: VerdictKind = VerdictKind::held("balanced", "BALANCED (pole up the whole run)");
/// The run ended before the first step of the plant.
pub const NEVER_MOVED: VerdictKind =
    VerdictKind::lost("never_moved", "UNDECIDED (the plant never moved)");
/// The pole was up when a command stopped the run.
pub const STOPPED: VerdictKind = VerdictKind::held("stopped", "STOPPED at {at} (pole up so far)");
/// The pole tipped beyond its limit.
pub const POLE_FELL: VerdictKind =
    VerdictKind::lost("pole_fell", "FELL at {at} (pole beyond ±12°)");
/// The cart left the rail with the pole still up.
pub const CART_LEFT_RAIL: VerdictKind = VerdictKind::lost(
    "cart_left_rail",
    "LEFT THE RAIL at {at} (cart beyond ±2.4 m, pole still up)",
);

/// All of them, that of a successful run first.
pub(crate) const ALL: [VerdictKind; 5] =
    [BALANCED, STOPPED, POLE_FELL, CART_LEFT_RAIL, NEVER_MOVED];

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

/// Returns the band of mean push ages in which `policy` may lose the pole, with the initial control
/// rate `control`; `None` where it was not measured.
pub fn falls(policy: &PolicySpec, control: Hz) -> Option<AgeBand> {
    match policy {
        PolicySpec::BuiltIn(PolicyKind::Scripted) => Some(OF_SCRIPTED),
        PolicySpec::BuiltIn(PolicyKind::Lqr) => (control == actuator_hz()).then_some(OF_LQR),
        PolicySpec::BuiltIn(PolicyKind::Zero | PolicyKind::Random) => None,
        PolicySpec::File(_) => {
            let pinned = policy.to_string();
            let file = OF_FILES.iter().find(|(digest, _)| pinned.ends_with(digest));
            file.map(|(_, limit)| *limit)
        }
    }
}
