//! A run in several processes, from outside: `node` and `up`.

mod support;

use std::{
    io::{BufRead, BufReader, Read},
    net::TcpListener,
    path::PathBuf,
    process::{Child, ChildStderr, Command, Stdio},
};

use support::{command, complaint, ratelab, text};

/// A port that is free, as an address.
fn address() -> String {
    let free = TcpListener::bind("127.0.0.1:0").and_then(|free| free.local_addr());
    format!("tcp/{}", free.expect("a free port"))
}

/// A process of a run; ended when it is dropped.
struct Part {
    child: Child,
    notes: BufReader<ChildStderr>,
}

impl Part {
    fn start(args: &[&str]) -> Self {
        Self::of(command(), args)
    }

    /// The same by `command`, which starts ratelab.
    fn of(mut command: Command, args: &[&str]) -> Self {
        command.arg("node").args(args);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("ratelab starts");
        let notes = BufReader::new(child.stderr.take().expect("piped"));
        Self { child, notes }
    }

    /// Reads its notes until one contains `text`.
    fn wait_for(&mut self, text: &str) {
        let mut line = String::new();
        while !line.contains(text) {
            line.clear();
            let read = self.notes.read_line(&mut line).expect("its notes");
            assert!(read > 0, "it ended before: {text}");
        }
    }

    /// Waits for its end; returns what it printed.
    fn printed(mut self) -> String {
        let mut printed = String::new();
        let mut output = self.child.stdout.take().expect("piped");
        output.read_to_string(&mut printed).expect("UTF-8");
        let mut notes = String::new();
        self.notes.read_to_string(&mut notes).expect("UTF-8");
        let status = self.child.wait().expect("ended");
        assert!(status.success(), "{status}: {notes}\n{printed}");
        printed
    }

    fn signal(&self, name: &str) {
        let id = self.child.id().to_string();
        let sent = Command::new("kill").args([name, &id]).status();
        assert!(sent.expect("kill").success());
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn plant_and_policy_balance_in_two_processes_and_nothing_is_lost() {
    let address = address();
    let policy = Part::start(&["policy", "--connect", &address]);
    let plant = Part::start(&["plant", "--listen", &address, "--duration-s", "2"]);
    let printed = plant.printed();
    assert!(printed.contains("BALANCED"), "{printed}");
    let wire = "/action from policy: 0 lost on the way, 0 refused";
    assert!(printed.contains(wire), "{printed}");
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

/// Two machines on a cable, as network namespaces; removed when dropped.
struct Cable([String; 2]);

impl Cable {
    /// The cable, or the reason why there is none.
    fn new() -> Result<Self, &'static str> {
        let id = std::process::id();
        let cable = Self([format!("rl-{id}-a"), format!("rl-{id}-b")]);
        let [a, b] = &cable.0;
        let made = ip(&format!("netns add {a}"))
            && ip(&format!("netns add {b}"))
            && ip(&format!(
                "link add cable netns {a} type veth peer name cable netns {b}"
            ))
            && ip(&format!("-n {a} addr add 10.77.0.1/24 dev cable"))
            && ip(&format!("-n {b} addr add 10.77.0.2/24 dev cable"))
            && ip(&format!("-n {a} link set cable up"))
            && ip(&format!("-n {b} link set cable up"));
        let why = "no network namespaces: they need ip, and the rights of root";
        made.then_some(cable).ok_or(why)
    }

    /// Starts a process on machine `side`.
    fn start(&self, side: usize, args: &[&str]) -> Part {
        let mut inside = Command::new("ip");
        inside.args([
            "netns",
            "exec",
            &self.0[side],
            env!("CARGO_BIN_EXE_ratelab"),
        ]);
        Part::of(inside, args)
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
    let address = "tcp/10.77.0.1:7447";
    let listen = ["plant", "--listen", address, "--insecure"];
    let plant = [&listen[..], &["--duration-s", "2", "--again"]].concat();
    let mut plant = cable.start(0, &plant);
    let _policy = cable.start(1, &["policy", "--connect", address]);
    plant.wait_for("the run begins");
    cable.set("down");
    plant.wait_for("waiting for policy");
    cable.set("up");
    let printed = plant.printed();
    let (cut, next) = printed.split_once("BALANCED").expect("a second run");
    assert!(cut.contains("policy: silent for 100 ms"), "{printed}");
    assert!(next.contains("0 refused"), "{printed}");
}

/// A Python with the packages `eclipse-zenoh` and `rosbags`, or the reason why there is none.
fn python() -> Result<PathBuf, &'static str> {
    let named = std::env::var_os("RATELAB_ROS_PYTHON").map(PathBuf::from);
    let python = named.unwrap_or_else(|| PathBuf::from("python3"));
    let mut imports = Command::new(&python);
    imports.args(["-c", "import zenoh, rosbags"]);
    match imports.stderr(Stdio::null()).status() {
        Ok(status) if status.success() => Ok(python),
        _ => Err("no Python with eclipse-zenoh and rosbags: name one in RATELAB_ROS_PYTHON"),
    }
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
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/ros2/policy.py");
    let client = Command::new(python).args([script, &address, "7"]).spawn();
    let mut client = client.expect("Python starts");
    let printed = plant.printed();
    let _ = client.kill();
    let _ = client.wait();
    assert!(printed.contains("BALANCED"), "{printed}");
    let wire = "/action from policy: 0 lost on the way, 0 refused";
    assert!(printed.contains(wire), "{printed}");
}
