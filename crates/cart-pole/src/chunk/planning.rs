//! What a plan of the cart-pole is, as data.

use ratelab_policy::chunk::planning::{MERGED, PLANNED, PLAYED};
use ratelab_system::{Planning, Spoiler};

use super::{ACTIONS, MODEL};
use crate::{ACTION, ACTUATOR, DISTURB, POLICY};

/// The plans of a policy that answers with chunks.
pub(crate) const PLANNING: Planning = ACTIONS.planning((ACTION, 1.0), SPOILERS);

/// What makes plans wrong, whatever the delay.
const SPOILERS: &[Spoiler] = &[
    MERGED,
    PLANNED,
    PLAYED,
    Spoiler {
        node: POLICY,
        name: MODEL,
        usual: "length:1",
        sound: "length:1",
        told: "the policy predicts wrongly: its model of the plant is {}",
    },
    Spoiler {
        node: ACTUATOR,
        name: DISTURB,
        usual: "0",
        sound: "0",
        told: "the plant is disturbed: at random, by {} N",
    },
];
