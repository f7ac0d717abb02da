//! The cart-pole's own names for knobs, which are options of the command too.

use ratelab::KnobKind;
use ratelab_system::Alias;
use strum::VariantNames;

use super::{
    ACTION, ACTUATOR, DISTURB, OBS, OBSERVE, POLICY, SENSOR,
    chunk::{PlanKind, PlayKind},
    policy::PolicyKind,
};

/// The names, in the order of the help.
pub(crate) const ALIASES: &[Alias] = &[
    Alias {
        name: "control-hz",
        knobs: &[(KnobKind::Rate, POLICY)],
        default: "50",
        choices: &[],
        help: "How often the policy decides",
    },
    Alias {
        name: "sensor-hz",
        knobs: &[(KnobKind::Rate, SENSOR)],
        default: "50",
        choices: &[],
        help: "How often the sensor publishes",
    },
    Alias {
        name: "queue-depth",
        knobs: &[(KnobKind::Depth, OBS), (KnobKind::Depth, ACTION)],
        default: "1",
        choices: &[],
        help: "How many messages /obs and /action keep",
    },
    Alias {
        name: "policy",
        knobs: &[(KnobKind::Send, POLICY)],
        default: "scripted",
        choices: PolicyKind::VARIANTS,
        help: "The policy: scripted, lqr, zero, random, a file of weights (.pt, .safetensors, .onnx), or a program",
    },
    Alias {
        name: "think-ms",
        knobs: &[(KnobKind::Takes, POLICY)],
        default: "none",
        choices: &[],
        help: "The time that the policy takes to decide (ms): 30, 60..110, lognormal:30,90, recorded:FILE, file:CSV or drawn:CSV",
    },
    Alias {
        name: "on-stale",
        knobs: &[(KnobKind::Send, ACTUATOR)],
        default: "hold",
        choices: &["hold", "zero:20", "zero:50", "zero:100"],
        help: "What the actuator does with a stale action: hold it, or zero:MS, no push beyond that age",
    },
    Alias {
        name: OBSERVE,
        knobs: &[(KnobKind::Parameter, "policy observe")],
        default: "x v cos sin spin",
        choices: &["x v theta spin"],
        help: "What a policy in a file sees: x, v, cos, sin, theta, spin, numbers; theta*2 with a factor",
    },
    Alias {
        name: "chunk",
        knobs: &[(KnobKind::Parameter, "policy chunk")],
        default: "none",
        choices: &[],
        help: "The number of actions in an answer of the policy, 20 ms each",
    },
    Alias {
        name: "plan",
        knobs: &[(KnobKind::Parameter, "policy plan")],
        default: "rollout",
        choices: PlanKind::VARIANTS,
        help: "What a chunk is planned by: hold the action, a rollout of the model, or one with the actions that are committed",
    },
    Alias {
        name: "expect-delay",
        knobs: &[(KnobKind::Parameter, "policy expect-delay")],
        default: "last",
        choices: &["last", "max"],
        help: "The delay of its answer that the policy plans for (ms): 120, last, max, or last+20",
    },
    Alias {
        name: "model",
        knobs: &[(KnobKind::Parameter, "policy model")],
        default: "length:1",
        choices: &[],
        help: "The policy's model of the plant: length:F, with a pole F times as long",
    },
    Alias {
        name: "play",
        knobs: &[(KnobKind::Parameter, "player play")],
        default: "time",
        choices: PlayKind::VARIANTS,
        help: "Which action of a chunk is played: by the time since the reading, by that since its arrival, or by the number of actions executed since",
    },
    Alias {
        name: "merge",
        knobs: &[(KnobKind::Parameter, "player merge")],
        default: "newest",
        choices: &["newest", "blend:0.7", "ensemble:0.01"],
        help: "What is played where chunks overlap: the newest, blend:W or ensemble:M",
    },
    Alias {
        name: "refill",
        knobs: &[(KnobKind::Parameter, "player refill")],
        default: "none",
        choices: &[],
        help: "The policy ticks on request: when this share of a chunk is left (0 to 1)",
    },
    Alias {
        name: DISTURB,
        knobs: &[(KnobKind::Parameter, "actuator disturb")],
        default: "0",
        choices: &[],
        help: "Standard deviation of a random force on the cart (N)",
    },
];
