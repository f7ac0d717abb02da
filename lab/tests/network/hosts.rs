//! A run on several machines, as network namespaces of this one.

use std::{
    process::{Command, Stdio},
    sync::atomic::{AtomicU32, Ordering},
};

use crate::{
    part::{Ended, Part, ROS_POLICY, python},
    support::RATELAB,
};

/// Where the first machine listens.
const ADDRESS: &str = "tcp/10.77.0.1:7447";

/// Two machines on a cable, as network namespaces; removed when dropped.
struct Cable([String; 2]);

impl Cable {
    /// The cable, or the reason why there is none.
    fn new() -> Result<Self, &'static str> {
        static CABLES: AtomicU32 = AtomicU32::new(0);
        let (id, number) = (std::process::id(), CABLES.fetch_add(1, Ordering::Relaxed));
        let cable = Self(["a", "b"].map(|side| format!("rl-{id}-{number}-{side}")));
        let [a, b] = &cable.0;
        let made = [
            format!("netns add {a}"),
            format!("netns add {b}"),
            format!("link add cable netns {a} type veth peer name cable netns {b}"),
            format!("-n {a} addr add 10.77.0.1/24 dev cable"),
            format!("-n {b} addr add 10.77.0.2/24 dev cable"),
            format!("-n {a} link set lo up"),
            format!("-n {a} link set cable up"),
            format!("-n {b} link set cable up"),
        ];
        let made = made.iter().all(|args| ip(args));
        let why = "no network namespaces: they need ip, and the rights of root";
        made.then_some(cable).ok_or(why)
    }

    /// Starts a process on machine `side`.
    fn start(&self, side: usize, line: &str) -> Part {
        Part::start_command(self.inside(side, RATELAB), line)
    }

    /// Starts `program` there.
    fn inside(&self, side: usize, program: &str) -> Command {
        let mut inside = Command::new("ip");
        inside.args(["netns", "exec", &self.0[side], program]);
        inside
    }

    fn set(&self, state: &str) {
        assert!(ip(&format!("-n {} link set cable {state}", self.0[0])));
    }
}

impl Drop for Cable {
    fn drop(&mut self) {
        for name in &self.0 {
            ip(&format!("netns del {name}"));
        }
    }
}

/// Whether `ip` with these arguments succeeds.
fn ip(args: &str) -> bool {
    let mut ip = Command::new("ip");
    let done = ip.args(args.split(' ')).stderr(Stdio::null()).status();
    done.is_ok_and(|status| status.success())
}

#[test]
fn two_machines_meet_again_after_their_cable_was_cut() {
    let cable = match Cable::new() {
        Ok(cable) => cable,
        Err(why) => return eprintln!("skipped: {why}"),
    };
    let mut plant = cable.start(0, &format!("plant --listen {ADDRESS} --insecure --again"));
    let _policy = cable.start(1, &format!("policy --connect {ADDRESS}"));
    plant.wait_for("the run begins");
    cable.set("down");
    plant.wait_for("waiting for policy");
    cable.set("up");
    plant.wait_for("policy: here");
    let printed = plant.interrupted();
    let (cut, next) = printed.split_once("STOPPED").expect("a second run");
    assert!(cut.contains("policy: silent for 100 ms"), "{printed}");
    assert!(next.contains("0 refused"), "{printed}");
}

#[test]
fn clocks_that_differ_by_a_day_make_no_age_wrong() {
    let cable = match Cable::new() {
        Ok(cable) => cable,
        Err(why) => return eprintln!("skipped: {why}"),
    };
    let shifted = || {
        let mut shifted = cable.inside(1, "unshare");
        shifted.args(["-T", "--monotonic", "86400", "--fork", "--kill-child"]);
        shifted
    };
    let there_are = shifted().arg("true").status();
    if !there_are.is_ok_and(|status| status.success()) {
        return eprintln!("skipped: no time namespaces");
    }
    let mut ratelab = shifted();
    ratelab.arg(RATELAB);
    let _policy = Part::start_command(ratelab, &format!("policy --connect {ADDRESS}"));
    let plant = format!("plant --listen {ADDRESS} --insecure --duration-s 2 --again");
    cable.start(0, &plant).balanced();
}

/// A router of zenoh that passes nothing between peers, as that of rmw_zenoh.
const ROUTER: &str = r#"
import sys, time, zenoh
config = zenoh.Config()
config.insert_json5("mode", '"router"')
config.insert_json5("listen/endpoints", f'["{sys.argv[1]}"]')
config.insert_json5("scouting/multicast/enabled", "false")
config.insert_json5("scouting/delay", "0")
config.insert_json5("routing/router/peers_failover_brokering", "false")
session = zenoh.open(config)
print("open", flush=True)
while True:
    time.sleep(1)
"#;

#[test]
fn a_router_on_another_machine_passes_messages_to_a_process_that_connects() {
    let (cable, python) = match (Cable::new(), python()) {
        (Ok(cable), Ok(python)) => (cable, python),
        (Err(why), _) | (_, Err(why)) => return eprintln!("skipped: {why}"),
    };
    let python = python.to_str().expect("UTF-8");
    let start = |args: &[&str]| Ended::start(cable.inside(0, python).args(args));
    let _router = start(&["-c", ROUTER, ADDRESS]);
    let _policy = start(&[ROS_POLICY, ADDRESS, "7"]);
    let plant = format!("plant --connect {ADDRESS} --ros --domain 7 --duration-s 3 --again");
    cable.start(1, &plant).balanced();
}
