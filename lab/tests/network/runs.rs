//! A run in several processes, from outside: `node` and `up`.

use std::{net::TcpListener, process::Command};

use crate::{
    part::{Ended, Part, ROS_POLICY, address::address, python},
    support::{Folder, RATELAB, Said, terminal::Lab},
};

/// The process of the plant, which listens.
fn plant(address: &str, options: &str) -> Part {
    Part::start(&format!("plant --listen {address} {options}"))
}

fn policy(address: &str, options: &str) -> Part {
    Part::start(&format!("policy --connect {address} {options}"))
}

/// A run that goes on however busy the machine is: no pole can fall in it.
struct Steady {
    folder: Folder,
    address: String,
}

impl Steady {
    const GRAPH: &str = "
        name = 'steady'
        node.sensor = { rate = 50, publishes = ['/obs'] }
        node.policy = { rate = 50, reads = ['/obs'], publishes = ['/action'] }
        node.actuator = { rate = 50, reads = ['/action'] }
        chain.act.path = ['sensor', '/obs', 'policy', '/action', 'actuator']
    ";

    fn new() -> Self {
        let (folder, address) = (Folder::new(), address());
        folder.write("steady.toml", Self::GRAPH);
        Self { folder, address }
    }

    /// The process that listens.
    fn plant(&self, options: &str) -> Part {
        self.node(&format!(
            "sensor actuator --listen {} {options}",
            self.address
        ))
    }

    fn policy(&self, options: &str) -> Part {
        self.node(&format!("policy --connect {} {options}", self.address))
    }

    fn node(&self, line: &str) -> Part {
        let mut ratelab = Command::new(RATELAB);
        ratelab.current_dir(self.folder.path("")).arg("steady.toml");
        Part::start_command(ratelab, line)
    }

    /// A process with its graph file in `line`.
    fn part(&self, line: &str) -> Part {
        let mut ratelab = Command::new(RATELAB);
        ratelab.current_dir(self.folder.path(""));
        Part::start_command(ratelab, line)
    }

    /// A dashboard that looks on.
    fn attached(&self) -> Lab {
        self.lab("", 24, 80)
    }

    /// A dashboard that records, with room for all that it tells of a busy machine.
    fn records(&self) -> Lab {
        self.lab("--record seen.rrd", 100, 160)
    }

    fn lab(&self, options: &str, rows: u16, cols: u16) -> Lab {
        let line = format!("steady.toml lab --attach {} {options}", self.address);
        Lab::open_in(&self.folder.path(""), &line, rows, cols)
    }
}

/// Waits until `lab` knows all processes, and shows that messages come.
fn until_heard(lab: &mut Lab) {
    lab.wait_without("nowhere");
    lab.wait_without(" 0.0/s");
}

/// Waits until `lab` shows one of two texts; returns whether it shows the first.
fn shows(lab: &mut Lab, texts: [&str; 2]) -> bool {
    let came = lab.read_until(|screen| texts.iter().any(|text| screen.contains(text)));
    assert!(came, "none of {texts:?} came:\n{}", lab.screen());
    lab.screen().contains(texts[0])
}

/// For how long all nodes are gone, as the `screen` of a dashboard has it (s).
fn silence_s(screen: &str) -> Option<f64> {
    let (_, silence) = screen.split_once("all nodes gone for ")?;
    silence.split_once(' ')?.0.parse().ok()
}

#[test]
fn plant_and_policy_balance_in_two_processes_and_nothing_is_lost() {
    let address = address();
    let policy = policy(&address, "");
    plant(&address, "--duration-s 2 --again").balanced();
    policy.signal("-INT");
}

#[test]
fn a_killed_policy_is_missed_and_the_next_run_has_another() {
    let address = address();
    let mut plant = plant(&address, "--again");
    let first = policy(&address, "");
    plant.wait_for("the run begins");
    first.signal("-KILL");
    plant.wait_for("waiting for policy");
    let _second = policy(&address, "");
    plant.wait_for("policy: here");
    let printed = plant.interrupted();
    let (lost, next) = printed.split_once("STOPPED").expect("a second run");
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
         2 ratelab node policy --zenoh-config /nowhere => /nowhere
         ratelab new robot.toml > said
         2 ratelab robot.toml node camera --ros => --ros: robot has no topic that ROS 2 nodes know
         2 ratelab up robot.toml --ros => --ros: robot has no topic that ROS 2 nodes know
         2 ratelab node robot.toml nobody => there is no node \"nobody\"",
    );
}

/// The last line of a process that connects and is refused.
fn refused(folder: &Folder, line: &str, code: i32) -> Said {
    let output = folder.does(line);
    let printed = Said::new(&output.stderr);
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
    let run = Steady::new();
    let mut plant = run.plant("");
    let mut lab = run.records();
    lab.wait_for("no state yet");
    let policy = run.policy("");
    plant.wait_for("the run begins");
    until_heard(&mut lab);
    for (part, of) in [
        ("policy", "policy runs"),
        ("sensor actuator", "sensor and actuator run"),
    ] {
        let line = format!("steady.toml node {part} --connect {}", run.address);
        let refused = refused(&run.folder, &line, 1);
        refused.has(&format!("{of} already, in process "));
    }
    lab.type_keys("q");
    lab.close();
    plant.interrupted();
    drop(policy);
    assert!(!run.folder.path("seen-2.rrd").exists(), "another run");
    let info = run.folder.says("info seen.rrd");
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
        let line = format!("node policy --connect {address} {options}");
        let refused = refused(&Folder::new(), &line, 2);
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
    Said::new(&output.stderr).has(&format!("cannot listen on tcp/{address}"));
}

#[test]
fn up_runs_all_parts_and_leaves_none_behind() {
    let printed = Folder::new().says("up --port 0 --duration-s 0.5");
    printed.has("BALANCED").has("policy");
}

#[test]
fn a_policy_that_is_gone_is_the_cause_of_the_age() {
    let is_told = |_| {
        let address = address();
        let mut plant = plant(&address, "");
        let mut lab = Lab::open(&format!("lab --attach {address}"), 24, 80);
        lab.wait_for("no state yet");
        let policy = policy(&address, "");
        plant.wait_for("the run begins");
        until_heard(&mut lab);
        drop(policy);
        let plant = "sensor and actuator: gone, through which all others";
        shows(&mut lab, ["policy: gone. Process ", plant])
    };
    // On a busy machine the pole may fall, and the plant be gone, before the policy is.
    assert!((0..5).any(is_told));
}

#[test]
fn a_policy_of_ros_messages_in_python_balances_the_pole() {
    let python = match python() {
        Ok(python) => python,
        Err(why) => return eprintln!("skipped: {why}"),
    };
    let address = address();
    let plant = plant(&address, "--ros --domain 7 --duration-s 3 --again");
    let _client = Ended::start(Command::new(python).args([ROS_POLICY, &address, "7"]));
    plant.balanced();
}

#[test]
fn an_attached_dashboard_and_each_process_record_what_they_see() {
    let run = Steady::new();
    let mut plant = run.plant("--duration-s 4");
    let mut lab = run.records();
    lab.wait_for("no state yet");
    let policy = run.policy("--record own.rrd");
    plant.wait_for("the run begins");
    until_heard(&mut lab);
    plant.printed();
    policy.interrupted();
    // Of a busy machine the last reports may be lost.
    let verdict = if shows(&mut lab, ["waiting for all nodes", "all nodes gone for"]) {
        "verdict   COMPLETED"
    } else {
        "verdict   "
    };
    Said(lab.quit("q")).has("recorded ");
    let folder = run.folder;
    folder
        .says("info seen.rrd")
        .has("process   sensor and actuator in process ")
        .has("process   policy in process ")
        .has(verdict)
        .has("latency   act");
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
    let run = Steady::new();
    let mut plant = run.plant("");
    let mut lab = run.attached();
    lab.wait_for("WAITING: the run has yet to begin");
    lab.wait_for("waiting for policy");
    let mut policy = run.policy("");
    plant.wait_for("the run begins");
    until_heard(&mut lab);
    plant.signal("-STOP");
    // On a busy machine the first half second of it may be before the signal.
    assert!(lab.read_until(|screen| silence_s(screen) > Some(2.0)));
    lab.wait_for("UNKNOWN: nothing is heard of the run since");
    policy.wait_for("sensor: silent for 100 ms");
    plant.signal("-CONT");
    plant.wait_for("sensor: its process stood still for");
    lab.wait_for(" RUNNING");
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
        let line = format!("node policy --connect {address} --wait-s 1");
        let output = Folder::new().does(&line);
        let printed = Said::new(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{address}: {printed:?}");
        let notes = printed.has(why).matches("note: cannot");
        assert!(notes.count() <= 1, "{address}: {printed:?}");
    }
}

#[test]
fn a_dashboard_names_the_command_of_what_is_missing() {
    let steady = Steady::new();
    let mut plant = steady.plant("");
    plant.wait_for("listening on");
    // Of another graph it names the one that shows the run.
    let mut other = Lab::open(&format!("lab --attach {}", steady.address), 24, 80);
    other.wait_for("this run is of steady: ");
    other.wait_for("lab steady.toml --attach");
    drop(other);
    let mut lab = steady.lab("", 24, 160);
    lab.wait_for(&format!(
        "node steady.toml policy --connect {}",
        steady.address
    ));
    // The file may stand behind the nodes.
    let policy = steady.part(&format!("policy steady.toml --connect {}", steady.address));
    plant.wait_for("the run begins");
    until_heard(&mut lab);
    policy.signal("-KILL");
    lab.wait_for("✖ gone");
    drop(plant);
}

#[test]
fn a_part_does_not_count_messages_that_go_past_it() {
    let folder = Folder::new();
    let graph = "
        name = 'relay'
        node.a = { rate = 50, publishes = ['/a'] }
        node.b = { trigger = ['/a'], publishes = ['/b'] }
        node.c = { trigger = ['/b'], publishes = ['/c'] }
        chain.all.path = ['a', '/a', 'b', '/b', 'c', '/c']
    ";
    folder.write("relay.toml", graph);
    let printed = folder.says("up relay.toml --port 0 --duration-s 0.5");
    // The summary is that of the process at the end of the chain.
    printed.has("topics    /b ").lacks("/a 0.0 msg/s");
    // Data of the first node came to it, whose records stay in other processes.
    printed.has("chain     all: data age mean ");
}

#[test]
fn a_part_ends_by_the_run_time_of_the_process_that_began_the_run() {
    let run = Steady::new();
    let part = |options: &str| run.node(&format!("{options} --duration-s 1"));
    let mut sensor = part(&format!("sensor --listen {}", run.address));
    sensor.wait_for("listening on");
    let policy = part(&format!("policy --connect {}", run.address));
    sensor.wait_for("waiting for actuator");
    // The policy ticks for a second before the run begins.
    run.folder.says("run steady.toml --duration-s 1");
    let actuator = part(&format!("actuator --connect {}", run.address));
    sensor.wait_for("the run begins");
    assert!(lasted(&policy.printed()) >= 2.0);
    assert!(actuator.printed().contains("STOPPED at 1."));
}

/// Run time at the end of a part without the first node of its graph (s).
fn lasted(printed: &str) -> f64 {
    let time = printed.split_once(" ticks in ").map(|(_, time)| time);
    let seconds = time.and_then(|time| time.split_once(" s")?.0.parse().ok());
    seconds.unwrap_or_else(|| panic!("{printed}"))
}

#[test]
fn up_passes_its_graph_to_all_parts() {
    let folder = Folder::with(&["graphs/camera-pole.toml"]);
    for line in ["camera-pole.toml up", "up camera-pole.toml"] {
        let printed = folder.says(&format!("{line} --port 0 --duration-s 0.5"));
        printed.has("detector").has("verdict");
    }
}
