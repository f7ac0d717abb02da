//! The cart-pole on the types of this crate, byte for byte as in the lab.

use std::sync::Arc;

use build_it::cartpole::{Settings, run};
use ratelab::{
    cartpole::{CartPole, STATE},
    experiment::{Config, Experiment},
    runtime::Time,
    system::System,
};

/// The same run in the lab, as it is written by `ratelab run --csv`.
fn in_the_lab(settings: &Settings) -> String {
    let (hz, depth) = (settings.control_hz, settings.depth);
    let setup = format!("control-hz {hz}, queue-depth {depth}");
    let config = Config {
        seed: settings.seed,
        end: Time::from_secs_f64(settings.seconds as f64).expect("a time"),
        ..CartPole::config(&setup).expect("knobs")
    };
    let system = Arc::new(CartPole::default());
    let table = system.table().expect("a table");
    let experiment = Experiment::new(system, &config).expect("a run");
    let tap = experiment.taps().rows(STATE, 10_000).expect(STATE);
    experiment.run().expect("it ran");
    let mut rows = tap.rows();
    tap.take(&mut rows);
    let mut text = format!("{}\n", table.header);
    for (head, state) in rows.iter() {
        text += &(table.row)(head.at, state);
        text.push('\n');
    }
    text
}

#[test]
fn the_cart_pole_runs_on_them_as_in_the_lab_to_the_byte() {
    for (seed, control_hz, depth) in [
        (0, 50, 1),
        (1, 25, 1),
        (2, 10, 3),
        (0, 5, 1),
        (0, 5, 100),
        (3, 7, 1),
        (4, 30, 2),
        (5, 120, 1),
    ] {
        let settings = Settings {
            seed,
            control_hz,
            depth,
            seconds: 10,
        };
        let (own, lab) = (run(&settings).expect("a plant"), in_the_lab(&settings));
        let mut lines = own.lines().zip(lab.lines());
        let differs = lines.find(|(own, lab)| own != lab);
        assert_eq!(differs, None, "{settings:?}: the first row that differs");
        assert!(own == lab, "{settings:?}: one of them is shorter");
    }
}
