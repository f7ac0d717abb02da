//! A plant's own names for knobs, which are options of the command too.

use ratelab::KnobKind::{Depth, Parameter, Rate, Send, Takes};
use ratelab_policy::chunk::aliases as chunks;
use ratelab_system::{Alias, graph_file::PLANT_POLICIES};

use crate::disturbance::DISTURB;
use crate::nodes::{ACTION, ACTUATOR, NOISE, OBS, POLICY, SENSOR};

/// The names of its knobs, in the order of the help.
pub(crate) const ALIASES: &[Alias] = &[
    Alias {
        name: "control-hz",
        knobs: &[(Rate, POLICY)],
        default: "50",
        choices: &[],
        help: "How often the policy decides",
    },
    Alias {
        name: "sensor-hz",
        knobs: &[(Rate, SENSOR)],
        default: "50",
        choices: &[],
        help: "How often the sensor publishes",
    },
    Alias {
        name: "actuator-hz",
        knobs: &[(Rate, ACTUATOR)],
        default: "50",
        choices: &[],
        help: "How often the actuator applies the newest controls",
    },
    Alias {
        name: "queue-depth",
        knobs: &[(Depth, OBS), (Depth, ACTION)],
        default: "1",
        choices: &[],
        help: "How many messages /obs and /action keep",
    },
    Alias {
        name: "policy",
        knobs: &[(Send, POLICY)],
        default: PLANT_POLICIES[0],
        choices: &PLANT_POLICIES,
        help: "The policy: lqr, made from the model; hold, the controls of the pose; zero; or a file",
    },
    Alias {
        name: "think-ms",
        knobs: &[(Takes, POLICY)],
        default: "none",
        choices: &[],
        help: "The time that the policy takes to decide (ms): 30, 60..110, lognormal:30,90, recorded:FILE, file:CSV or drawn:CSV",
    },
    Alias {
        name: "chunk",
        knobs: &[(Parameter, "policy chunk")],
        default: "none",
        choices: &[],
        help: "The number of actions in an answer of the policy, each for a period of the rate in the file",
    },
    chunks::PLAN,
    chunks::EXPECT_DELAY,
    chunks::PLAY,
    chunks::MERGE,
    chunks::REFILL,
    Alias {
        name: NOISE,
        knobs: &[(Parameter, "sensor noise")],
        default: "0",
        choices: &[],
        help: "Standard deviation of what is added to each coordinate and speed of a reading (m, rad, m/s, rad/s)",
    },
    Alias {
        name: DISTURB,
        knobs: &[(Parameter, "actuator disturb")],
        default: "0",
        choices: &[],
        help: "A joint with the standard deviation of a random push on it (N, N m), new every 20 ms",
    },
];
