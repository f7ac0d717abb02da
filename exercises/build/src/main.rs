//! A run of the cart-pole on the types of this crate: `cargo run -p build-it -- HZ` prints it;
//! with `--features lab` it is played in the dashboard and compared with the lab's own.

use std::{env, error::Error, process::ExitCode};

use build_it::cartpole::{Settings, run};

fn main() -> ExitCode {
    let hz = env::args().nth(1).unwrap_or_else(|| "50".to_owned());
    let Some(control_hz) = hz.parse().ok().filter(|hz| (1..=1_000).contains(hz)) else {
        eprintln!("error: {hz:?} is no rate: expected a whole number from 1 to 1000 (Hz)");
        return ExitCode::from(2);
    };
    let settings = Settings {
        seed: 0,
        control_hz,
        depth: 1,
        seconds: 10,
    };
    show(&settings).unwrap_or_else(|error| {
        eprintln!("error: {error}");
        ExitCode::FAILURE
    })
}

#[cfg(not(feature = "lab"))]
fn show(settings: &Settings) -> Result<ExitCode, Box<dyn Error>> {
    print!("{}", run(settings)?.csv());
    Ok(ExitCode::SUCCESS)
}

#[cfg(feature = "lab")]
fn show(settings: &Settings) -> Result<ExitCode, Box<dyn Error>> {
    let run = run(settings)?;
    let run = ratelab_lab::OtherRun {
        config: settings.config()?,
        topics: run.topics,
        ticks: run.ticks,
        exit: run.exit,
    };
    let system = ratelab_cart_pole::CartPole::default();
    Ok(ratelab_lab::show_other_run(system, run))
}
