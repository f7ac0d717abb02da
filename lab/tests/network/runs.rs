//! A run in several processes, from outside: `node` and `up`.

use std::{net::TcpListener, process::Command};

use crate::{
    part::{Ended, Part, ROS_POLICY, address::address, python},
    support::{Folder, Said, terminal::Lab},
};

/// The process of the plant, which listens.
fn plant(address: &str, options: &str) -> Part {
    Part::start(&format!("plant --listen {address} {options}"))
}

fn policy(address: &str, options: &str) -> Part {
    Part::start(&format!("policy --connect {address} {options}"))
}

/// A dashboard that looks on.
fn attached(address: &str, options: &str) -> Lab {
    Lab::open(&format!("lab --attach {address} {options}"), 24, 80)
}

#[test]
fn plant_and_policy_balance_in_two_processes_and_nothing_is_lost() {
    let address = address();
    let policy = policy(&address, "");
    plant(&address, "--duration-s 2").balanced();
    policy.signal("-INT");
}

#[test]
fn a_killed_policy_is_missed_and_the_next_run_has_another() {
    let address = address();
    let mut plant = plant(&address, "--duration-s 2 --again");
    let first = policy(&address, "");
    plant.wait_for("the run begins");
    first.signal("-KILL");
    plant.wait_for("waiting for policy");
    let _second = policy(&address, "");
    let printed = plant.printed();
    let (lost, next) = printed.split_once("BALANCED").expect("a second run");
    assert!(lost.contains("FELL"), "{printed}");
    assert!(lost.contains("policy: silent for 100 ms"), "{printed}");
    assert!(next.contains("0 lost on the way"), "{printed}");
}

#[test]
fn a_policy_that_hangs_is_connected_and_missed() {
    let address = address();
    let mut plant = plant(&address, "");
    let policy = policy(&address, "");
    plant.wait_for("the run begins");
    policy.signal("-STOP");
    let printed = Said(plant.printed());
    printed.has("FELL").has("policy: silent for 100 ms");
}

#[test]
fn parts_that_share_the_plant_or_are_open_to_the_network_are_refused() {
    Folder::new().plays(
        "2 ratelab node sensor policy => run them in one process, as plant
         2 ratelab node polic => there is no node \"polic\"
         2 ratelab node plant --listen tcp/0.0.0.0:0 => --insecure
         2 ratelab node plant --listen nonsense => nonsense
         2 ratelab node plant --clock virtual => the wall's time
         2 ratelab node policy --zenoh-config /nowhere => /nowhere",
    );
}

/// The last line of a process that connects and is refused.
fn refused(line: &str, code: i32) -> Said {
    let output = Folder::new().does(line);
    let printed = Said::of(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{line}: {printed:?}");
    let last = printed.lines().last();
    let error = last.and_then(|line| line.strip_prefix("error: "));
    Said(
        error
            .unwrap_or_else(|| panic!("{line}: {printed:?}"))
            .to_owned(),
    )
}

#[test]
fn a_second_process_for_a_part_is_refused_at_itself_and_changes_nothing() {
    let (folder, address) = (Folder::new(), address());
    let mut plant = plant(&address, "");
    let record = format!("--record '{}'", folder.path("seen.rrd").display());
    let mut lab = attached(&address, &record);
    lab.wait_for("no state yet");
    let policy = policy(&address, "");
    plant.wait_for("the run begins");
    lab.wait_for("50.0/s");
    for (part, of) in [
        ("policy", "policy runs"),
        ("plant", "sensor and actuator run"),
    ] {
        let refused = refused(&format!("node {part} --connect {address}"), 1);
        refused.has(&format!("{of} already, in process "));
    }
    lab.type_keys("q");
    let left = Said(lab.close().1.screen().contents());
    plant.interrupted();
    drop(policy);
    left.has("seen.rrd").lacks("seen-2");
    let info = folder.says("info seen.rrd");
    let processes = info.matches("process   policy in process ");
    assert_eq!(processes.count(), 1, "{info:?}");
}

#[test]
fn parts_that_are_set_up_differently_do_not_begin() {
    let address = address();
    let mut plant = plant(&address, "");
    plant.wait_for("listening");
    let rates = "\"rate policy 50\" there, \"rate policy 20\" here";
    for (options, why) in [
        ("--control-hz 20", rates),
        ("--policy lqr", "\"send policy lqr\" here"),
        ("--world own", "a world of its own"),
        (
            "--knob 'link /obs delay:20'",
            "\"link /obs delay:20\" only here",
        ),
    ] {
        let refused = refused(&format!("node policy --connect {address} {options}"), 2);
        refused.has(why).has("start both with the same options");
    }
    // The plant still waits for one that fits.
    let _policy = policy(&address, "--policy scripted");
    plant.wait_for("the run begins");
}

#[test]
fn an_address_in_use_is_an_error() {
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = taken.local_addr().expect("bound");
    let output = Folder::new().does(&format!("node plant --listen tcp/{address}"));
    assert_eq!(output.status.code(), Some(1));
    Said::of(&output.stderr).has(&format!("cannot listen on tcp/{address}"));
}

#[test]
fn up_runs_all_parts_and_leaves_none_behind() {
    let printed = Folder::new().says("up --port 0 --duration-s 1");
    printed.has("BALANCED").has("policy");
}

#[test]
fn a_policy_that_is_gone_is_the_cause_of_the_age() {
    let address = address();
    let mut plant = plant(&address, "");
    let mut lab = attached(&address, "");
    lab.wait_for("no state yet");
    let policy = policy(&address, "");
    plant.wait_for("the run begins");
    lab.wait_for("50.0/s");
    drop(policy);
    lab.wait_for("policy: gone. Process ");
    lab.type_keys("q");
    lab.close();
}

#[test]
fn a_policy_of_ros_messages_in_python_balances_the_pole() {
    let python = match python() {
        Ok(python) => python,
        Err(why) => return eprintln!("skipped: {why}"),
    };
    let address = address();
    let plant = plant(&address, "--ros --domain 7 --duration-s 3");
    let _client = Ended::start(Command::new(python).args([ROS_POLICY, &address, "7"]));
    plant.balanced();
}

#[test]
fn an_attached_dashboard_and_each_process_record_what_they_see() {
    let (folder, address) = (Folder::new(), address());
    let record = |name: &str| format!("--record '{}'", folder.path(name).display());
    let mut plant = plant(&address, "--duration-s 4");
    let mut lab = attached(&address, &record("seen.rrd"));
    lab.wait_for("no state yet");
    let policy = policy(&address, &record("own.rrd"));
    plant.wait_for("the run begins");
    lab.wait_for("BALANCED so far");
    plant.printed();
    policy.interrupted();
    lab.wait_for("waiting for all nodes");
    Said(lab.quit("q")).has("recorded ");
    folder
        .says("info seen.rrd")
        .has("process   sensor and actuator in process ")
        .has("process   policy in process ")
        .has("verdict   BALANCED")
        .has("latency   sense→act");
    let own = folder.says("info own.rrd");
    own.has("process   policy in process ");
    let unlogged = "as a dashboard saw it, without the log of any thread";
    let written = "the network wrote to /obs between the reads of its nodes";
    for (file, why) in [("seen.rrd", unlogged), ("own.rrd", written)] {
        let (refused, _) = folder.fails(&format!("verify {file}"), 1);
        refused.has(why);
    }
}

#[test]
fn a_plant_that_stands_still_or_is_killed_is_told_from_a_policy_that_is_silent() {
    let address = address();
    let mut plant = plant(&address, "--on-stale hold");
    let mut lab = attached(&address, "");
    lab.wait_for("WAITING: the run has yet to begin");
    lab.wait_for("waiting for policy");
    let mut policy = policy(&address, "--on-stale hold");
    plant.wait_for("the run begins");
    lab.wait_for("BALANCED so far");
    plant.signal("-STOP");
    lab.wait_for("UNKNOWN: nothing is heard of the run since");
    policy.wait_for("sensor: silent for 100 ms");
    plant.signal("-CONT");
    plant.wait_for("sensor: its process stood still for");
    lab.wait_for("BALANCED so far");
    plant.signal("-KILL");
    lab.wait_for("sensor and actuator: gone, through which all others are heard.");
    lab.type_keys("q");
    lab.close();
}

#[test]
fn a_connection_that_fails_is_a_line_with_its_reason_and_ends_when_told() {
    let example = "expected one such as tcp/127.0.0.1:7447";
    for (address, code, why) in [
        ("tcp/127.0.0.1:1", 1, "Connection refused"),
        ("tcp/no.such.host.invalid:7447", 1, "cannot connect to"),
        ("127.0.0.1:7447", 2, example),
        ("nonsense/1:1", 2, "is no address"),
    ] {
        let line = format!("node policy --connect {address} --wait-s 0.2");
        let output = Folder::new().does(&line);
        let printed = Said::of(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{address}: {printed:?}");
        let notes = printed.has(why).matches("note: cannot");
        assert!(notes.count() <= 1, "{address}: {printed:?}");
    }
}

#[test]
fn up_passes_its_graph_to_all_parts() {
    let folder = Folder::with(&["graphs/camera-pole.toml"]);
    for line in ["camera-pole.toml up", "up camera-pole.toml"] {
        let printed = folder.says(&format!("{line} --port 0 --duration-s 0.5"));
        printed.has("detector").has("verdict");
    }
}
