//! Shared helpers for tests of runs in several processes.

use std::{
    net::TcpListener,
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicU16, Ordering},
    },
};

use ratelab::Time;
use ratelab_study::{
    experiment::{Config, Experiment},
    system::System,
};
use ratelab_wire::{Bridge, SessionEnd, Settings};

/// An address whose port is free: one below those of outgoing connections, which another test
/// may take at any time.
pub fn address() -> String {
    static NEXT: AtomicU16 = AtomicU16::new(0);
    let process = (std::process::id() % u32::from(PORTS)) as u16;
    loop {
        let number = NEXT.fetch_add(1, Ordering::Relaxed) % PORTS;
        let port = FIRST_PORT + (process + number) % PORTS;
        if TcpListener::bind(("127.0.0.1", port)).is_ok() {
            return format!("tcp/127.0.0.1:{port}");
        }
    }
}

/// The ports to look at.
const FIRST_PORT: u16 = 20_000;
const PORTS: u16 = 12_000;

/// The settings of an end, with the zenoh configuration `file`.
pub fn settings(end: SessionEnd, file: Option<&Path>) -> Settings {
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
    part_for(2.0, system, nodes, settings, ros)
}

/// The part of a run of so many `seconds`.
pub fn part_for(
    seconds: f64,
    system: Arc<dyn System>,
    nodes: &[&str],
    settings: &Settings,
    ros: Option<u32>,
) -> (Experiment, Bridge) {
    let here: Vec<String> = nodes.iter().map(|&node| node.to_owned()).collect();
    let config = Config {
        end: Time::from_secs_f64(seconds).expect("seconds"),
        ..Config::default()
    };
    let part = Experiment::part(system, &config, &here).expect("a part");
    let bridge = Bridge::start(settings, &part, &here, ros).expect("connected");
    (part, bridge)
}
