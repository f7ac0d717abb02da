//! A run in several processes, from outside: `node` and `up`.

#[path = "support/part.rs"]
mod part;
mod support;
#[path = "support/terminal.rs"]
mod terminal;

use std::{net::TcpListener, process::Command};

use part::{Ended, Part, ROS_POLICY, address, python};
use support::{complaint, folder, path, ratelab, text};
use terminal::Lab;

#[test]
fn plant_and_policy_balance_in_two_processes_and_nothing_is_lost() {
    let address = address();
    let policy = Part::start(&["policy", "--connect", &address]);
    let plant = Part::start(&["plant", "--listen", &address, "--duration-s", "2"]);
    plant.balanced();
    policy.signal("-INT");
}

#[test]
fn a_killed_policy_is_missed_and_the_next_run_has_another() {
    let address = address();
    let policy = ["policy", "--connect", &*address];
    let mut plant = Part::start(&[
        "plant",
        "--listen",
        &address,
        "--duration-s",
        "2",
        "--again",
    ]);
    let first = Part::start(&policy);
    plant.wait_for("the run begins");
    first.signal("-KILL");
    plant.wait_for("waiting for policy");
    let _second = Part::start(&policy);
    let printed = plant.printed();
    let (lost, next) = printed.split_once("BALANCED").expect("a second run");
    assert!(lost.contains("FELL"), "{printed}");
    assert!(lost.contains("policy: silent for 100 ms"), "{printed}");
    assert!(next.contains("0 lost on the way"), "{printed}");
}

#[test]
fn a_policy_that_hangs_is_connected_and_missed() {
    let address = address();
    let mut plant = Part::start(&["plant", "--listen", &address]);
    let policy = Part::start(&["policy", "--connect", &address]);
    plant.wait_for("the run begins");
    policy.signal("-STOP");
    let printed = plant.printed();
    assert!(printed.contains("FELL"), "{printed}");
    assert!(printed.contains("policy: silent for 100 ms"), "{printed}");
}

#[test]
fn parts_that_share_the_plant_or_are_open_to_the_network_are_refused() {
    for (args, why) in [
        (
            &["node", "sensor", "policy"][..],
            "run them in one process, as plant",
        ),
        (&["node", "polic"], "there is no node \"polic\""),
        (
            &["node", "plant", "--listen", "tcp/0.0.0.0:0"],
            "--insecure",
        ),
        (&["node", "plant", "--listen", "nonsense"], "nonsense"),
        (&["node", "plant", "--clock", "virtual"], "the wall's time"),
        (
            &["node", "policy", "--zenoh-config", "/nowhere"],
            "/nowhere",
        ),
    ] {
        let complaint = complaint(&ratelab(args), 2);
        assert!(complaint.contains(why), "{args:?}: {complaint}");
    }
}

/// The last line of a process that connects and is refused.
fn refused(args: &[&str], code: i32) -> String {
    let output = ratelab(args);
    let printed = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{args:?}: {printed}");
    let error = printed
        .lines()
        .last()
        .and_then(|line| line.strip_prefix("error: "));
    error
        .unwrap_or_else(|| panic!("{args:?}: {printed}"))
        .to_owned()
}

#[test]
fn a_second_process_for_a_part_is_refused_at_itself_and_changes_nothing() {
    let (folder, address) = (folder(), address());
    let seen = path(&folder, "seen.rrd");
    let mut plant = Part::start(&["plant", "--listen", &address]);
    let mut lab = Lab::open(&["lab", "--attach", &address, "--record", &seen], 24, 80);
    lab.wait_for("no state yet");
    let policy = Part::start(&["policy", "--connect", &address]);
    plant.wait_for("the run begins");
    lab.wait_for("50.0/s");
    for (part, of) in [
        ("policy", "policy runs"),
        ("plant", "sensor and actuator run"),
    ] {
        let complaint = refused(&["node", part, "--connect", &address], 1);
        assert!(
            complaint.contains(&format!("{of} already, in process ")),
            "{complaint}"
        );
    }
    lab.type_keys("q");
    let (_, screen) = lab.close();
    let left = screen.screen().contents();
    plant.interrupted();
    drop(policy);
    assert!(
        left.contains("seen.rrd") && !left.contains("seen-2"),
        "{left}"
    );
    let info = text(&ratelab(&["info", &seen]).stdout);
    assert_eq!(
        info.matches("process   policy in process ").count(),
        1,
        "{info}"
    );
}

#[test]
fn parts_that_are_set_up_differently_do_not_begin() {
    let address = address();
    let mut plant = Part::start(&["plant", "--listen", &address]);
    plant.wait_for("listening");
    for (options, why) in [
        (
            &["--control-hz", "20"][..],
            "\"rate policy 50\" there, \"rate policy 20\" here",
        ),
        (&["--policy", "lqr"], "\"send policy lqr\" here"),
        (&["--world", "own"], "a world of its own"),
        (
            &["--knob", "link /obs delay:20"],
            "\"link /obs delay:20\" only here",
        ),
    ] {
        let args = [&["node", "policy", "--connect", &address], options].concat();
        let complaint = refused(&args, 2);
        assert!(complaint.contains(why), "{options:?}: {complaint}");
        assert!(
            complaint.contains("start both with the same options"),
            "{complaint}"
        );
    }
    // The plant still waits for one that fits.
    let _policy = Part::start(&["policy", "--connect", &address, "--policy", "scripted"]);
    plant.wait_for("the run begins");
}

#[test]
fn an_address_in_use_is_an_error() {
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = taken.local_addr().expect("bound");
    let output = ratelab(&["node", "plant", "--listen", &format!("tcp/{address}")]);
    assert_eq!(output.status.code(), Some(1));
    let said = text(&output.stderr);
    assert!(
        said.contains(&format!("cannot listen on tcp/{address}")),
        "{said}"
    );
}

#[test]
fn up_runs_all_parts_and_leaves_none_behind() {
    let output = ratelab(&["up", "--port", "0", "--duration-s", "1"]);
    let (printed, said) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{said}");
    assert!(printed.contains("BALANCED"), "{printed}{said}");
    assert!(printed.contains("policy"), "{printed}");
}

#[test]
fn a_policy_that_is_gone_is_the_cause_of_the_age() {
    let address = address();
    let mut plant = Part::start(&["plant", "--listen", &address]);
    let mut lab = Lab::open(&["lab", "--attach", &address], 24, 80);
    lab.wait_for("no state yet");
    let policy = Part::start(&["policy", "--connect", &address]);
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
    let plant = Part::start(&[
        "plant",
        "--listen",
        &address,
        "--ros",
        "--domain",
        "7",
        "--duration-s",
        "3",
    ]);
    let _client = Ended::start(Command::new(python).args([ROS_POLICY, &address, "7"]));
    plant.balanced();
}

#[test]
fn an_attached_dashboard_and_each_process_record_what_they_see() {
    let (folder, address) = (folder(), address());
    let [seen, own] = ["seen.rrd", "own.rrd"].map(|name| path(&folder, name));
    let plant = ["plant", "--listen", &address, "--duration-s", "4"];
    let mut plant = Part::start(&plant);
    let mut lab = Lab::open(&["lab", "--attach", &address, "--record", &seen], 24, 80);
    lab.wait_for("no state yet");
    let policy = ["policy", "--connect", &address, "--record", &own];
    let policy = Part::start(&policy);
    plant.wait_for("the run begins");
    lab.wait_for("BALANCED so far");
    let printed = plant.printed();
    policy.interrupted();
    lab.wait_for("waiting for all nodes");
    lab.type_keys("q");
    let (status, screen) = lab.close();
    let left = screen.screen().contents();
    assert!(status.success() && left.contains("recorded "), "{left}");
    let info = text(&ratelab(&["info", &seen]).stdout);
    for line in [
        "process   sensor and actuator in process ",
        "process   policy in process ",
        "verdict   BALANCED",
        "latency   sense→act",
    ] {
        assert!(info.contains(line), "{line}: {info}{printed}");
    }
    let info = text(&ratelab(&["info", &own]).stdout);
    assert!(info.contains("process   policy in process "), "{info}");
    for (file, why) in [
        (seen, "as a dashboard saw it, without the log of any thread"),
        (
            own,
            "the network wrote to /obs between the reads of its nodes",
        ),
    ] {
        let refused = complaint(&ratelab(&["verify", &file]), 1);
        assert!(refused.contains(why), "{refused}");
    }
}

#[test]
fn a_plant_that_stands_still_or_is_killed_is_told_from_a_policy_that_is_silent() {
    let address = address();
    let mut plant = Part::start(&["plant", "--listen", &address, "--on-stale", "hold"]);
    let mut lab = Lab::open(&["lab", "--attach", &address], 24, 80);
    lab.wait_for("WAITING: the run has yet to begin");
    lab.wait_for("waiting for policy");
    let policy = ["policy", "--connect", &address, "--on-stale", "hold"];
    let mut policy = Part::start(&policy);
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
    for (address, code, why) in [
        ("tcp/127.0.0.1:1", 1, "Connection refused"),
        ("tcp/no.such.host.invalid:7447", 1, "cannot connect to"),
        (
            "127.0.0.1:7447",
            2,
            "expected one such as tcp/127.0.0.1:7447",
        ),
        ("nonsense/1:1", 2, "is no address"),
    ] {
        let args = ["node", "policy", "--connect", address, "--wait-s", "0.2"];
        let output = ratelab(&args);
        let printed = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{address}: {printed}");
        assert!(printed.contains(why), "{address}: {printed}");
        let notes = printed
            .lines()
            .filter(|line| line.starts_with("note: cannot"));
        assert!(notes.count() <= 1, "{address}: {printed}");
    }
}

#[test]
fn up_passes_its_graph_to_all_parts() {
    let graph = concat!(env!("CARGO_MANIFEST_DIR"), "/../graphs/camera-pole.toml");
    for args in [[graph, "up"], ["up", graph]] {
        let options = ["--port", "0", "--duration-s", "0.5"];
        let output = ratelab(&[&args[..], &options].concat());
        let (printed, notes) = (text(&output.stdout), text(&output.stderr));
        assert!(output.status.success(), "{notes}");
        assert!(
            printed.contains("detector") && printed.contains("verdict"),
            "{printed}"
        );
    }
}
