//! Causes of age, and the sweep of each.

use std::{error::Error, sync::Arc};

use ratelab_cart_pole::CartPole;
use ratelab_experiment::{
    Config,
    sweep::{Sweep, SweepAxis},
};
use ratelab_system::WorldKind;

/// A cause of age: a name, fixed knobs, and knobs with their values.
pub struct Cause {
    /// The name.
    pub name: &'static str,
    /// Fixed knobs, with commas in between.
    pub fixed: &'static str,
    /// Knobs, each with a list of values.
    pub axes: &'static [(&'static str, &'static str)],
}

/// Shares of messages that are lost.
const LOSSES: &str = "0.3 0.5 0.6 0.65 0.7 0.75 0.8 0.83 0.86 0.9 0.92 0.94";

/// All measured causes.
pub const CAUSES: [Cause; 10] = [
    Cause {
        name: "control rate and delay of `/action`",
        fixed: "",
        axes: &[
            ("rate policy", "100 50 25 20 12.5 10"),
            (
                "link /action",
                "none delay:20 delay:40 delay:60 delay:80 delay:100 delay:120 delay:150",
            ),
        ],
    },
    Cause {
        name: "sensor rate",
        fixed: "",
        axes: &[("rate sensor", "2.5 3 3.5 4 5 6 7 8 9 10 12.5 25")],
    },
    Cause {
        name: "what the policy takes",
        fixed: "",
        axes: &[("takes policy", "none 20 30 40 50 60 70 80 100 120 140 160")],
    },
    Cause {
        name: "offset of the policy, at 8 Hz",
        fixed: "rate sensor 8, rate policy 8",
        axes: &[("offset policy", "0 10 20 30 40 50 60 70 80 90 100 120")],
    },
    Cause {
        name: "queue, read from its old end",
        fixed: "read /obs oldest, rate policy 49",
        axes: &[("depth /obs", "1 2 3 4 5 6 7 8 9 10 12 14")],
    },
    Cause {
        name: "loss on `/action`, held",
        fixed: "",
        axes: &[("link /action loss:{}", LOSSES)],
    },
    Cause {
        name: "loss on `/obs`",
        fixed: "",
        axes: &[("link /obs loss:{}", LOSSES)],
    },
    Cause {
        name: "loss, sent again after 20 ms",
        fixed: "",
        axes: &[(
            "link /action loss:{},reliable:20",
            "0.2 0.3 0.4 0.5 0.55 0.6 0.65 0.7",
        )],
    },
    Cause {
        name: "random delay, in order",
        fixed: "",
        axes: &[(
            "link /action delay:{},in-order",
            "0..40 0..80 0..100 0..120 0..140 0..160 0..200 0..250",
        )],
    },
    Cause {
        name: "random delay, overtaking",
        fixed: "",
        axes: &[(
            "link /action delay:{}",
            "0..40 0..100 0..200 0..300 0..400 0..600 0..800 0..1000",
        )],
    },
];

/// Ten seconds in a world that does not wait, with an actuator fast enough to add no age.
pub fn base(policy: &str) -> Result<Config, Box<dyn Error>> {
    let config = CartPole::config(&format!("policy {policy}, rate actuator 500"))?;
    Ok(Config {
        world: WorldKind::OWN,
        ..config
    })
}

/// Returns the runs in which `cause` makes actions old, each with `seeds` seeds.
pub fn sweep(
    system: &Arc<CartPole>,
    base: &Config,
    cause: &Cause,
    seeds: u64,
) -> Result<Sweep, Box<dyn Error>> {
    let mut base = base.clone();
    for knob in cause.fixed.split(", ").filter(|knob| !knob.is_empty()) {
        base.setup.extend(CartPole::KNOBS.parse(knob)?);
    }
    let axes = cause.axes.iter().map(|(knob, values)| {
        SweepAxis::from_texts(CartPole::KNOBS, knob, values.split(' ').map(str::to_owned))
    });
    Ok(Sweep {
        axes: axes.collect::<Result<_, _>>()?,
        seeds: (0..seeds).collect(),
        ..Sweep::new(system.clone(), base)
    })
}
