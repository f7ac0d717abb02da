//! Connections by TLS, with the certificates and the configurations of the manual.
#![cfg(feature = "tls")]

mod support;

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
    sync::Arc,
    thread,
};

use ratelab_cart_pole::CartPole;
use ratelab_study::experiment::Experiment;
use ratelab_wire::{Bridge, SessionEnd, Settings};
use support::{address, settings};
use zenoh::Wait;

const MANUAL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/network");

/// Makes the certificates in `folder` by the script of the manual; `false` without openssl.
fn certificates(folder: &Path) -> bool {
    let openssl = Command::new("openssl").arg("version").output();
    if !openssl.is_ok_and(|output| output.status.success()) {
        return false;
    }
    let mut script = Command::new("sh");
    let script = script.arg(format!("{MANUAL}/certificates.sh"));
    let made = script.arg("127.0.0.1").current_dir(folder).status();
    assert!(made.is_ok_and(|status| status.success()));
    true
}

/// The configuration `name` of the manual, with the certificates in `folder` and without the
/// lines that begin with one of `left_out`.
fn of_manual(folder: &Path, name: &str, left_out: &[&str]) -> PathBuf {
    let text = fs::read_to_string(format!("{MANUAL}/{name}")).expect("in the manual");
    let lines = text.lines();
    let is_left_out = |line: &&str| left_out.iter().any(|begin| line.trim().starts_with(begin));
    let lines = lines.filter(|line| !is_left_out(line));
    let text = lines.collect::<Vec<_>>().join("\n");
    let text = [
        "ours.pem",
        "robot.pem",
        "robot.key",
        "policy.pem",
        "policy.key",
    ]
    .iter()
    .fold(text, |text, file| {
        text.replace(file, &folder.join(file).display().to_string())
    });
    let path = folder.join(format!("{}-{name}", left_out.len()));
    fs::write(&path, text).expect("written");
    path
}

/// A part of the cart-pole.
fn part(nodes: &[&str], end: SessionEnd, file: &Path) -> (Experiment, Bridge) {
    support::part(
        Arc::new(CartPole::default()),
        nodes,
        &settings(end, Some(file)),
        None,
    )
}

/// Whether an end with these settings connects within a moment.
fn connects(settings: &Settings) -> bool {
    let mut connection = settings.config().expect("settings");
    let once = connection.insert_json5("connect/timeout_ms", "500");
    once.expect("a setting of zenoh");
    zenoh::open(connection).wait().is_ok()
}

#[test]
fn only_who_has_a_certificate_takes_part() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    if !certificates(folder) {
        return eprintln!("skipped: no openssl");
    }
    let address = address().replace("tcp/", "tls/");
    let connect = || SessionEnd::Connect(vec![address.clone()]);
    let robot = of_manual(folder, "robot-tls.json5", &[]);
    let listen = SessionEnd::Listen(vec![address.clone()]);
    let (plant, there) = part(&["sensor", "actuator"], listen, &robot);
    let known = of_manual(folder, "policy-tls.json5", &[]);
    let unknown = of_manual(folder, "policy-tls.json5", &["connect_", "enable_mtls"]);
    assert!(
        !connects(&settings(connect(), Some(&unknown))),
        "without a certificate"
    );
    let in_the_clear = SessionEnd::Connect(vec![address.replace("tls/", "tcp/")]);
    assert!(!connects(&settings(in_the_clear, None)), "in the clear");
    let (policy, here) = part(&["policy"], connect(), &known);
    while there.others().is_empty() || here.others().is_empty() {
        thread::yield_now();
    }
    let policy = thread::spawn(|| policy.run().expect("a run"));
    let summary = plant.run().expect("a run");
    policy.join().expect("a thread");
    assert_eq!(summary.verdict.name(), "balanced");
    assert_eq!(there.inlets()[0].refused.hostile(), 0);
    assert!(summary.topic("/action").published > 50);
}
