//! Names for the knobs of chunks, which are options of the command too.

use ratelab::KnobKind;
use ratelab_system::Alias;
use strum::VariantNames;

use super::{PlanKind, PlayKind};

/// What a chunk is planned by.
pub const PLAN: Alias = Alias {
    name: "plan",
    knobs: &[(KnobKind::Parameter, "policy plan")],
    default: "rollout",
    choices: PlanKind::VARIANTS,
    help: "What a chunk is planned by: hold the action, a rollout of the model, or one with the actions that are committed",
};

/// The delay that a policy plans for.
pub const EXPECT_DELAY: Alias = Alias {
    name: "expect-delay",
    knobs: &[(KnobKind::Parameter, "policy expect-delay")],
    default: "last",
    choices: &["last", "max"],
    help: "The delay of its answer that the policy plans for (ms): 120, last, max, or last+20",
};

/// Which action of a chunk is played.
pub const PLAY: Alias = Alias {
    name: "play",
    knobs: &[(KnobKind::Parameter, "player play")],
    default: "time",
    choices: PlayKind::VARIANTS,
    help: "Which action of a chunk is played: by the time since the reading, by that since its arrival, or by the number of actions executed since",
};

/// What is played where chunks overlap.
pub const MERGE: Alias = Alias {
    name: "merge",
    knobs: &[(KnobKind::Parameter, "player merge")],
    default: "newest",
    choices: &["newest", "blend:0.7", "ensemble:0.01"],
    help: "What is played where chunks overlap: the newest, blend:W or ensemble:M",
};

/// When the policy is asked for the next chunk.
pub const REFILL: Alias = Alias {
    name: "refill",
    knobs: &[(KnobKind::Parameter, "player refill")],
    default: "none",
    choices: &[],
    help: "The policy ticks on request: when this share of a chunk is left (0 to 1)",
};
