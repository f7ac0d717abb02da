//! Libraries whose state dictionaries are known by the names in them.

use crate::policy::way_out::ProgramKind;

/// A library, by a part of a name that only its policies have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Library {
    sign: &'static str,
    /// What its state dictionary is, for messages.
    pub(super) what: &'static str,
    /// The kind of program that runs its policies.
    pub(super) program: ProgramKind,
}

const LIBRARIES: [Library; 6] = [
    stable_baselines("mlp_extractor."),
    stable_baselines("actor.latent_pi."),
    stable_baselines("q_net.q_net."),
    stable_baselines("actor.mu.0."),
    Library {
        sign: "net_container.",
        what: "a policy of skrl",
        program: ProgramKind::Module,
    },
    Library {
        sign: "a2c_network.",
        what: "a policy of rl_games",
        program: ProgramKind::Module,
    },
];

const fn stable_baselines(sign: &'static str) -> Library {
    Library {
        sign,
        what: "a policy of Stable-Baselines3 (save the model with model.save)",
        program: ProgramKind::Sb3,
    }
}

impl Library {
    /// Detects the library that wrote these `names`, if it is known.
    pub(super) fn detect<'n>(mut names: impl Iterator<Item = &'n str>) -> Option<Self> {
        let sign = |name: &str| LIBRARIES.iter().find(|known| name.starts_with(known.sign));
        names.find_map(sign).copied()
    }
}
