//! The cart-pole's own names for knobs, which are options of the command too.

use ratelab::KnobKind;
use ratelab_policy::chunk::aliases as chunks;
use ratelab_system::Alias;
use strum::VariantNames;

use super::{ACTION, ACTUATOR, DISTURB, OBS, OBSERVE, POLICY, SENSOR, policy::PolicyKind};

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
    chunks::PLAN,
    chunks::EXPECT_DELAY,
    Alias {
        name: "model",
        knobs: &[(KnobKind::Parameter, "policy model")],
        default: "length:1",
        choices: &[],
        help: "The policy's model of the plant: length:F, with a pole F times as long",
    },
    chunks::PLAY,
    chunks::MERGE,
    chunks::REFILL,
    Alias {
        name: DISTURB,
        knobs: &[(KnobKind::Parameter, "actuator disturb")],
        default: "0",
        choices: &[],
        help: "Standard deviation of a random force on the cart (N)",
    },
];
