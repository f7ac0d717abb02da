//! The time of one decision, for several policies.

use std::hint::black_box;

use ratelab::Hz;
use ratelab_cart_pole::{
    CONTROL_HZ, Observation,
    policy::{Policy, PolicyContext, PolicySpec, Scripted},
};

use super::{
    paired::{Nanos, paired, time},
    table::Table,
};

const ROUNDS: usize = 200;

/// Decisions per round.
const DECISIONS: usize = 1_000;

/// Networks with hidden layers 32 and 64 wide.
const NETWORKS: [(&str, &str); 2] = [
    ("network, 32 wide", "policies/patient.safetensors"),
    (
        "network, 64 wide",
        "tests/fixtures/policies/actor.safetensors",
    ),
];

/// Fills in the rows about single decisions.
pub fn measure(table: &mut Table) {
    table.heading("One decision, beside the scripted policy's");
    let mut scripted = Scripted;
    let lqr: PolicySpec = "lqr".parse().expect("a policy");
    let rows = [("lqr", lqr)]
        .into_iter()
        .chain(NETWORKS.map(|(what, file)| {
            let path = format!("{}/../../{file}", env!("CARGO_MANIFEST_DIR"));
            (what, path.parse().expect("a policy"))
        }));
    for (what, spec) in rows {
        let loaded = spec.load().expect(what);
        let context = PolicyContext {
            seed: 0,
            control_hz: Hz::new(CONTROL_HZ).expect("a rate"),
            chunk: None,
        };
        let mut policy = loaded.policy(context).expect(what);
        let work = paired(ROUNDS, || decide(&mut *policy), || decide(&mut scripted));
        table.row(what, &work, None);
    }
}

/// Time of one decision.
fn decide(policy: &mut dyn Policy) -> Nanos {
    let total = time(|| {
        for number in 0..DECISIONS {
            let lean = 0.2 * number as f32 / DECISIONS as f32;
            black_box(policy.act(black_box(&Observation {
                cart_position: lean,
                cart_velocity: -lean,
                cos_theta: lean.cos(),
                sin_theta: lean.sin(),
                pole_velocity: 0.1,
            })));
        }
    });
    total / DECISIONS as f64
}
