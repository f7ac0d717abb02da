//! One law, measured: the mean push age decides whether the pole stays up, for any cause
//! of the age. Prints the tables of `docs/age.md`, from thousands of runs, in minutes.

mod causes;

use std::{error::Error, ops::ControlFlow, sync::Arc, time::Instant};

use ratelab_cart_pole::CartPole;
use ratelab_experiment::sweep::{ByAge, CellResult, all_cores};
use ratelab_system::System;

use causes::{CAUSES, base, sweep};

const POLICIES: [&str; 4] = [
    "scripted",
    "lqr",
    "policies/prompt.safetensors",
    "policies/patient.safetensors",
];

/// Number of seeds per configuration.
const SEEDS: u64 = 6;

/// The runs of one policy, by cause.
struct Measured {
    policy: &'static str,
    grows_s: Option<f64>,
    causes: Vec<Vec<CellResult>>,
}

impl Measured {
    fn run(system: &Arc<CartPole>, policy: &'static str) -> Result<Self, Box<dyn Error>> {
        let base = base(policy)?;
        let grows = system.judge().age_limits(&base.setup).grows;
        let causes = CAUSES.iter().map(|cause| {
            let sweep = sweep(system, &base, cause, SEEDS)?;
            let swept = sweep.run(all_cores(), |_, _| ControlFlow::Continue(()))?;
            Ok::<_, Box<dyn Error>>(swept.finished().map(|(_, result)| result.clone()).collect())
        });
        Ok(Self {
            policy,
            grows_s: grows.map(|age| age.as_secs_f64()),
            causes: causes.collect::<Result<_, _>>()?,
        })
    }

    fn all(&self) -> ByAge {
        ByAge::new(self.causes.iter().flatten())
    }

    fn name(&self) -> &str {
        let file = self.policy.rsplit('/').next().unwrap_or(self.policy);
        file.split('.').next().unwrap_or(file)
    }
}

fn ms(seconds: Option<f64>) -> String {
    seconds.map_or("-".to_owned(), |seconds| format!("{:.0}", seconds * 1e3))
}

/// Minimum distance of a run from the limit for a certain verdict (s).
const NEAR_S: f64 = 0.01;

/// Returns the number of runs held within a range of ages, and number of all runs there.
fn held(by_age: &ByAge, from_s: f64, to_s: f64) -> String {
    let runs = by_age.runs();
    let (held, fell): (Vec<_>, Vec<_>) = runs
        .filter(|(age, _)| (from_s..to_s).contains(age))
        .partition(|(_, held)| *held);
    format!("{} of {}", held.len(), held.len() + fell.len())
}

/// The two limits of each policy (ms), and the separation of all runs by the second one.
fn limits(measured: &[Measured]) {
    println!(
        "| policy | deviations grow from | it falls from | stand, more than 10 ms below | within \
         10 ms | more than 10 ms above | on the wrong side |"
    );
    println!("|---|---|---|---|---|---|---|");
    for policy in measured {
        let by_age = policy.all();
        let Some(falls) = by_age.split() else {
            continue;
        };
        let [below, above] = [falls.at_s - NEAR_S, falls.at_s + NEAR_S];
        println!(
            "| {} | {} | {} | {} | {} | {} | {} of {} |",
            policy.name(),
            ms(policy.grows_s),
            ms(Some(falls.at_s)),
            held(&by_age, 0.0, below),
            held(&by_age, below, above),
            held(&by_age, above, f64::INFINITY),
            falls.misjudged,
            by_age.len(),
        );
    }
}

/// For each cause the limit that its runs have alone (ms).
fn causes(measured: &[Measured]) {
    let names: Vec<_> = measured.iter().map(Measured::name).collect();
    println!("| what makes it old | {} |", names.join(" | "));
    println!("|---|{}", "---|".repeat(names.len()));
    for (place, cause) in CAUSES.iter().enumerate() {
        let cells = measured.iter().map(|policy| {
            let own = ByAge::new(&policy.causes[place]).split();
            ms(own.map(|split| split.at_s))
        });
        println!(
            "| {} | {} |",
            cause.name,
            cells.collect::<Vec<_>>().join(" | ")
        );
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let (system, began) = (Arc::new(CartPole::default()), Instant::now());
    let measured: Vec<Measured> = POLICIES
        .iter()
        .map(|policy| Measured::run(&system, policy))
        .collect::<Result<_, _>>()?;
    limits(&measured);
    println!();
    causes(&measured);
    let runs: usize = measured.iter().map(|policy| policy.all().len()).sum();
    let seconds = began.elapsed().as_secs_f64();
    eprintln!(
        "{runs} runs in {seconds:.0} s: {:.0} runs/s",
        runs as f64 / seconds
    );
    Ok(())
}
