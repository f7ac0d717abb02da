//! Prints a run of the cart-pole on the types of this crate: `cargo run -p build-it -- HZ`.

use std::{env, process::ExitCode};

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
    match run(&settings) {
        Ok(rows) => {
            print!("{rows}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
