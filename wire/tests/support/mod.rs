//! Shared helpers for tests of runs in several processes.

use std::{net::TcpListener, path::Path, sync::Arc};

use ratelab::{
    experiment::{Config, Experiment},
    runtime::Time,
    system::System,
};
use ratelab_wire::{Bridge, End, Settings};

/// A port that is free, as an address.
pub fn address() -> String {
    let free = TcpListener::bind("127.0.0.1:0").and_then(|free| free.local_addr());
    format!("tcp/{}", free.expect("a free port"))
}

/// The settings of an end, with the zenoh configuration `file`.
pub fn settings(end: End, file: Option<&Path>) -> Settings {
    Settings {
        end,
        insecure: false,
        file: file.map(Path::to_owned),
        wait: None,
        notice: |_| (),
    }
}

/// The part of a run of two seconds that has these `nodes`; with `ros` also in that domain.
pub fn part(
    system: Arc<dyn System>,
    nodes: &[&str],
    settings: &Settings,
    ros: Option<u32>,
) -> (Experiment, Bridge) {
    let here: Vec<String> = nodes.iter().map(|&node| node.to_owned()).collect();
    let config = Config {
        end: Time::from_secs_f64(2.0).expect("seconds"),
        ..Config::default()
    };
    let part = Experiment::part(system, &config, &here).expect("a part");
    let bridge = Bridge::start(settings, &part, &here, ros).expect("connected");
    (part, bridge)
}
