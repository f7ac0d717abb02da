//! `ratelab run`, as used on the command line: output, files and refusals.

mod support;

use std::{fs, path::Path, process::Command};

use serde_json::Value;
use tempfile::TempDir;

use support::{complaint, path, ratelab, text};

fn metrics(args: &[&str]) -> Value {
    let output = ratelab(&[&["run", "--clock", "virtual", "--json"], args].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("stdout is JSON and nothing else")
}

#[test]
fn the_published_figures_are_reproduced_at_every_control_rate() {
    let table = [
        ("50", 0.0, 0, 501),
        ("25", 9.98, 250, 501),
        ("20", 23.9521, 300, 501),
        ("15", 35.9281, 350, 501),
        ("10", 39.9202, 400, 501),
        ("5", 85.1163, 37, 43),
    ];
    for (rate, latency, dropped, steps) in table {
        let metrics = metrics(&["--control_hz", rate]);
        assert_eq!(metrics["mean_latency_ms"], latency, "{rate} Hz");
        assert_eq!(metrics["obs_dropped"], dropped, "{rate} Hz");
        assert_eq!(metrics["steps"], steps, "{rate} Hz");
        assert_eq!(metrics["balanced"], steps == 501, "{rate} Hz");
    }
}

#[test]
fn the_same_command_gives_the_same_bytes() {
    let folder = TempDir::new().expect("folder");
    let once = |name: &str| {
        let (out, csv) = (path(&folder, name), path(&folder, &format!("{name}.csv")));
        let args = [
            "run",
            "--clock",
            "virtual",
            "--control-hz",
            "7",
            "--out",
            &out,
            "--csv",
            &csv,
        ];
        assert!(ratelab(&args).status.success());
        let metrics = fs::read(Path::new(&out).join("metrics.json")).expect("metrics");
        (metrics, fs::read(csv).expect("rows"))
    };
    assert_eq!(once("first"), once("second"));
}

#[test]
fn rows_hold_the_bits_of_every_control_step() {
    let folder = TempDir::new().expect("folder");
    let csv = path(&folder, "run.csv");
    metrics(&["--break", "--csv", &csv]);
    let rows = fs::read_to_string(csv).expect("rows");
    if cfg!(all(target_arch = "x86_64", target_os = "linux")) {
        assert_eq!(rows, include_str!("../../tests/golden/seed0_5hz.csv"));
    }
    assert_eq!(rows.lines().count(), 44, "a header and 43 steps");
}

#[test]
fn an_underscore_or_a_hyphen_makes_no_difference() {
    let underscores = [
        "--control_hz=20",
        "--sensor_hz=40",
        "--queue_depth=3",
        "--duration_s=3",
    ];
    let hyphens = underscores.map(|arg| arg.replace('_', "-"));
    assert_eq!(
        metrics(&underscores),
        metrics(&hyphens.each_ref().map(String::as_str))
    );
}

#[test]
fn knobs_are_set_at_their_times_and_printed() {
    let folder = TempDir::new().expect("folder");
    let knobs = path(&folder, "knobs");
    fs::write(
        &knobs,
        "# slower\n2.5 control_hz 10\n\n4 queue-depth 100 # hides it\n",
    )
    .expect("file");
    let output = ratelab(&["run", "--clock", "virtual", "--knobs", &knobs]);
    let said = text(&output.stdout);
    for line in [
        "knob      2.5 control-hz 10",
        "knob      4 queue-depth 100",
        "control 50 Hz → 10 Hz",
        "control period 100.0 ms",
    ] {
        assert!(said.contains(line), "{line:?} is missing in\n{said}");
    }
    assert!(said.contains("/obs 50.1 msg/s (60 dropped)"), "{said}");
}

#[test]
fn any_knob_is_turned_before_the_run_and_the_last_one_holds() {
    let knobs = [
        "rate sensor 100",
        "depth /obs 3",
        "control_hz 7",
        "control-hz 10",
    ];
    let knobs = knobs.map(|knob| ["--knob", knob]).concat();
    let metrics = metrics(&[&["--control-hz", "5"], &knobs[..]].concat());
    assert_eq!(metrics["control_hz"], 10.0);
    assert_eq!(metrics["sensor_hz"], 100.0);
    assert_eq!(metrics["obs_dropped"], 700, "seven of ten");
    for (knob, why) in [
        ("rate nobody 5", "no node \"nobody\""),
        (
            "volume 11",
            "--knob \"volume 11\": \"volume\" is not a knob",
        ),
        (
            "policy alexnet",
            "--knob \"policy alexnet\": alexnet: expected",
        ),
    ] {
        let said = support::complaint(&ratelab(&["run", "--smoke", "--knob", knob]), 2);
        assert!(said.contains(why), "{said}");
    }
}

#[test]
fn a_line_of_knobs_that_the_graph_refuses_is_named() {
    let folder = TempDir::new().expect("folder");
    let knobs = path(&folder, "knobs");
    for (line, why) in [
        ("1 rate nobody 10", "there is no node \"nobody\""),
        ("1 link /nowhere none", "there is no topic \"/nowhere\""),
        ("1 link /state none", "/state has no reader"),
        ("1 policy nowhere.pt", "nowhere.pt"),
        ("1 volume 11", "\"volume\" is not a knob"),
    ] {
        fs::write(&knobs, format!("# on the way\n0.5 control-hz 20\n{line}\n")).expect("file");
        let complaint = support::complaint(&ratelab(&["run", "--smoke", "--knobs", &knobs]), 2);
        let place = format!("--knobs {knobs}: line 3: ");
        assert!(
            complaint.contains(&place) && complaint.contains(why),
            "{complaint}"
        );
    }
}

#[test]
fn a_knob_after_the_end_is_reported_as_unused() {
    let folder = TempDir::new().expect("folder");
    let knobs = path(&folder, "knobs");
    fs::write(&knobs, "30 control-hz 10").expect("file");
    let output = ratelab(&["run", "--smoke", "--knobs", &knobs]);
    assert!(text(&output.stdout).contains("30 control-hz 10: the run had ended"));
}

#[test]
fn smoke_is_two_seconds_of_virtual_time() {
    let metrics = metrics(&["--smoke"]);
    assert_eq!(metrics["sim_time_s"], 2.0);
    assert_eq!(metrics["clock"], "virtual");
    assert_eq!(metrics["smoke"], true);
}

#[test]
fn bad_input_is_one_line_that_names_option_value_and_range() {
    let cases: [(&[&str], &[&str]); 20] = [
        (
            &["--control-hz", "-5"],
            &["--control-hz", "-5", "0.001 to 10000"],
        ),
        (&["--control-hz", "0"], &["--control-hz", "0.001 to 10000"]),
        (
            &["--control-hz", "nan"],
            &["--control-hz", "nan", "0.001 to 10000"],
        ),
        (
            &["--sensor-hz", "inf"],
            &["--sensor-hz", "inf", "0.001 to 10000"],
        ),
        (
            &["--sensor-hz", "1e9"],
            &["--sensor-hz", "1e9", "0.001 to 10000"],
        ),
        (&["--queue-depth", "0"], &["--queue-depth", "1 to 1000000"]),
        (&["--duration-s", "-1"], &["--duration-s", "-1", "0.001 to"]),
        (&["--duration", "1"], &["similar", "--duration-s"]),
        (&["--seed", "-1"], &["--seed", "-1", "0 to"]),
        (
            &["--policy", "alexnet"],
            &["--policy", "alexnet", "lqr or a file of weights"],
        ),
        (&["--policy", "/"], &["--policy /", "found a directory"]),
        (
            &["--policy", "../tests/fixtures/policies/asks.pt"],
            &["asks.pt", "never code", "posix.system"],
        ),
        (&["--speed", "1000"], &["--speed", "1000", "0.1 to 100"]),
        (&["--smoke", "--clock", "real"], &["--smoke", "virtual"]),
        (
            &["--clock", "virtual", "--realtime"],
            &["--realtime", "real"],
        ),
        (
            &["--break", "--control-hz", "3"],
            &["--break", "--control-hz"],
        ),
        (&["--knob", "link "], &["expected link TOPIC SPEC"]),
        (&["--knob", "0 lose /obs 3"], &["no time here", "--knobs"]),
        (&["\u{1b}[31m"], &[r"\u{1b}[31m", "ends in .toml"]),
        (
            &["--knobs", "/nonexistent/knobs"],
            &["--knobs", "/nonexistent/knobs"],
        ),
    ];
    for (args, expected) in cases {
        let output = ratelab(&[&["run"], args].concat());
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?} said {said}");
        assert_eq!(said.lines().count(), 1, "{args:?} said {said}");
        assert!(output.stdout.is_empty(), "{args:?} printed a summary");
        for word in expected {
            assert!(said.contains(word), "{args:?} said {said}");
        }
    }
}

#[test]
fn bad_input_writes_nothing() {
    let folder = TempDir::new().expect("folder");
    let (out, csv) = (
        path(&folder, "a/b/out"),
        path(&folder, "no/such/folder/run.csv"),
    );
    let output = ratelab(&["run", "--smoke", "--out", &out, "--csv", &csv]);
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(folder.path().read_dir().expect("folder").count(), 0);
}

#[test]
fn an_option_before_the_command_is_one_line_without_usage() {
    let output = ratelab(&["--seed", "3", "run"]);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(!said.contains("<COMMAND>"), "{said}");
}

#[test]
fn a_malformed_knob_line_is_named() {
    let folder = TempDir::new().expect("folder");
    let knobs = path(&folder, "knobs");
    fs::write(&knobs, "1 control-hz 10\n2 volume 11\n").expect("file");
    let output = ratelab(&["run", "--knobs", &knobs]);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        said.contains("line 2") && said.contains("\"volume\""),
        "{said}"
    );
}

#[test]
fn rows_that_cannot_be_written_end_the_run_with_an_error() {
    if !Path::new("/dev/full").exists() {
        return;
    }
    let output = ratelab(&["run", "--smoke", "--csv", "/dev/full"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("cannot write /dev/full"));
}

#[cfg(unix)]
#[test]
fn an_interrupt_ends_the_run_in_order_with_its_summary() {
    use std::{io::Read, process::Stdio};
    let mut child = Command::new(env!("CARGO_BIN_EXE_ratelab"))
        .args(["run", "--duration-s", "3600", "--csv", "/dev/stderr"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("ratelab starts");
    // The first row shows that the graph is running and the handler is installed.
    let mut row = [0; 200];
    let mut rows = child.stderr.take().expect("piped");
    assert!(rows.read(&mut row).expect("rows") > 0);
    let pid = child.id().to_string();
    let kill = Command::new("kill").args(["-INT", &pid]).status();
    assert!(kill.expect("kill").success());
    std::io::copy(&mut rows, &mut std::io::sink()).expect("rows");
    let output = child.wait_with_output().expect("ended");
    assert_eq!(output.status.code(), Some(130));
    assert!(
        text(&output.stdout).contains("STOPPED"),
        "{}",
        text(&output.stdout)
    );
}

#[cfg(unix)]
#[test]
fn knobs_are_read_from_ordinary_files_of_reasonable_size_only() {
    let folder = TempDir::new().expect("folder");
    let pipe = path(&folder, "pipe");
    let made = Command::new("mkfifo").arg(&pipe).status();
    assert!(made.expect("mkfifo").success());
    let large = path(&folder, "large");
    let file = fs::File::create(&large).expect("made");
    file.set_len(1 << 32).expect("longer");
    for (knobs, found) in [
        ("/dev/zero", "no ordinary file"),
        (&pipe, "no ordinary file"),
        ("/", "found a directory"),
        (&large, "found 4294967296 bytes"),
    ] {
        let said = support::complaint(&ratelab(&["run", "--smoke", "--knobs", knobs]), 2);
        assert!(said.contains(knobs) && said.contains(found), "{said}");
    }
}

#[test]
fn a_path_with_a_hash_can_be_a_knob_and_is_printed_as_it_is_read() {
    let folder = TempDir::new().expect("folder");
    let knobs = path(&folder, "knobs");
    for name in ["a#b.pt", "a #b.pt"] {
        let policy = path(&folder, name);
        fs::copy("../tests/fixtures/policies/actor.pt", &policy).expect("copied");
        let escaped = policy.replace(" #", r" \#");
        fs::write(&knobs, format!("0.5 policy {escaped} # swap\n")).expect("file");
        for _ in 0..2 {
            let output = ratelab(&["run", "--smoke", "--knobs", &knobs]);
            assert!(output.status.success(), "{}", text(&output.stderr));
            let said = text(&output.stdout);
            let line = said.lines().find_map(|line| line.strip_prefix("knob"));
            let line = line.expect("a knob").trim();
            assert!(
                line.starts_with(&format!("0.5 policy {escaped}@")),
                "{line}"
            );
            fs::write(&knobs, line).expect("file");
        }
    }
}

#[test]
fn an_error_is_a_line_without_effect_on_the_terminal() {
    let folder = TempDir::new().expect("folder");
    let said = support::complaint(&ratelab(&["run", "--policy", "\u{1b}[31mred\u{202e}"]), 2);
    assert!(said.contains(r"\u{1b}[31mred\u{202e}: expected"), "{said}");
    let said = support::complaint(&ratelab(&["\u{9b}31m"]), 2);
    assert!(said.contains(r"\u{9b}31m"), "{said}");
    let knobs = path(&folder, "knobs");
    fs::write(&knobs, "x".repeat(100_000)).expect("file");
    let said = support::complaint(&ratelab(&["run", "--knobs", &knobs]), 2);
    assert!(said.len() < 2_000, "{} bytes", said.len());
    assert!(
        said.contains("is not a timed knob: expected seconds"),
        "{said}"
    );
}

#[test]
fn help_that_cannot_be_printed_is_an_error_and_a_closed_pipe_is_none() {
    if !Path::new("/dev/full").exists() {
        return;
    }
    for option in ["--help", "--version"] {
        let full = fs::File::options().write(true).open("/dev/full");
        let output = support::command()
            .arg(option)
            .stdout(full.expect("open"))
            .output()
            .expect("ratelab starts");
        let said = support::complaint(&output, 1);
        assert!(said.contains("cannot write to standard output"), "{said}");
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let closed = support::command().arg(option).stdout(writer).output();
        let closed = closed.expect("ratelab starts");
        assert!(closed.status.success(), "{}", text(&closed.stderr));
    }
}

#[test]
fn configured_costs_are_measured_in_virtual_time() {
    let usual = metrics(&[]);
    assert_eq!(usual["world"], "course");
    assert_eq!(usual.get("world_step_ms"), None);
    assert_eq!(usual["nodes"]["policy"].get("cost"), None);
    let asked = [
        "--world",
        "own",
        "--takes",
        "policy=30",
        "--offset",
        "sensor=5",
    ];
    let timed = metrics(&asked);
    assert_eq!(
        (&timed["world"], &timed["world_step_ms"]),
        (&"own".into(), &1.into())
    );
    let policy = &timed["nodes"]["policy"];
    assert_eq!(policy["cost"]["max_ms"], 30.0);
    assert_eq!(policy["response"]["p50_ms"], 30.0);
    assert_eq!(
        policy["ticks"].as_u64().zip(policy["overruns"].as_u64()),
        Some((251, 250))
    );
    assert_eq!(timed["nodes"]["sensor"]["cost"]["count"], 0);
    assert_eq!(timed["nodes"]["actuator"].get("cost"), None);
    assert_eq!(timed.get("wall_time_s"), None);
    let think = ["--world", "own", "--think-ms", "30", "--offset", "sensor=5"];
    assert_eq!(metrics(&think), timed);
}

#[test]
fn the_world_is_printed_where_it_matters() {
    let summary = |args: &[&str]| {
        let output = ratelab(&[&["run", "--clock", "virtual"], args].concat());
        assert!(output.status.success(), "{output:?}");
        text(&output.stdout)
    };
    let usual = summary(&[]);
    assert!(!usual.contains("world "), "{usual}");
    // The age of the screen, whatever the world.
    assert!(usual.contains("push age  mean 10.0 ms"), "{usual}");
    let broken = summary(&["--break"]);
    for part in [
        "43 plant steps",
        "mean 85.1 ms",
        "in the last second 96.2 ms",
    ] {
        assert!(broken.contains(part), "{part}: {broken}");
    }
    let still = summary(&["--knob", "crash actuator"]);
    let verdict = "UNDECIDED (the plant never moved): 0 plant steps in 10.00 s sim";
    assert!(still.contains(verdict), "{still}");
    let waits = summary(&["--takes", "policy=60"]);
    assert!(
        waits.contains("course: it waits for the actuator"),
        "{waits}"
    );
    for knob in ["link /action delay:10", "lose /obs 3", "crash sensor"] {
        let waits = summary(&["--knob", knob]);
        assert!(waits.contains("course: it waits for"), "{knob}: {waits}");
    }
    assert!(waits.contains("push age  mean 90.0 ms"), "{waits}");
    assert!(waits.contains("overruns  policy 334 of 501"), "{waits}");
    let own = summary(&["--world", "own", "--world-step-ms", "5"]);
    assert!(
        own.contains("in steps of 5 ms") && own.contains("world 50 Hz"),
        "{own}"
    );
}

#[test]
fn row_k_of_the_own_world_is_at_20_k_ms_and_has_the_state_of_the_course_s() {
    let folder = TempDir::new().expect("folder");
    let rows = |name: &str, args: &[&str]| {
        let csv = path(&folder, name);
        let args = [&["run", "--clock", "virtual", "--csv", &csv], args].concat();
        assert!(ratelab(&args).status.success());
        let rows = fs::read_to_string(csv).expect("rows");
        let rows = rows
            .lines()
            .skip(1)
            .map(|row| row.split(',').map(str::to_owned).collect());
        rows.collect::<Vec<Vec<String>>>()
    };
    let course = rows("course.csv", &[]);
    let own = rows("own.csv", &["--world", "own", "--world-step-ms", "10"]);
    assert_eq!((course.len(), own.len()), (501, 500));
    for (k, (own, course)) in own.iter().zip(&course).enumerate() {
        assert_eq!(own[0], course[0]);
        assert_eq!(own[1].parse(), Ok(20.0 * (k + 1) as f64 / 1e3));
        assert_eq!(own[2..8], course[2..8], "row {k}");
    }
}

#[test]
fn invalid_worlds_and_costs_are_refused() {
    for (args, part) in [
        (&["--world-step-ms", "2"][..], "has its own step"),
        (
            &["--world", "own", "--world-step-ms", "3"],
            "expected 1, 2, 5 or 10",
        ),
        (&["--takes", "policy"], "expected NODE=SPEC"),
        (
            &["--takes", "polcy=3"],
            "expected one of sensor, policy, actuator",
        ),
        (&["--offset", "sensor=-1"], "-1"),
        (&["--takes", "policy=recorded:nowhere.rrd"], "nowhere.rrd"),
        (
            &["--world", "own", "--takes", "world=1"],
            "the world moves by itself",
        ),
        (&["--knob", "rate actuator 25"], "20 ms of the plant's time"),
    ] {
        let said = support::complaint(&ratelab(&[&["run"], args].concat()), 2);
        assert!(said.contains(part), "{args:?}: {said}");
    }
}

#[test]
fn what_links_did_is_in_the_summary_and_in_the_metrics() {
    let knobs = [
        "--knob",
        "link /obs loss:0.5",
        "--knob",
        "link /action delay:30",
    ];
    let args = [
        "run",
        "--clock",
        "virtual",
        "--world",
        "own",
        "--on-stale",
        "zero:90",
    ];
    let output = ratelab(&[&args[..], &knobs].concat());
    let said = text(&output.stdout);
    assert!(said.contains("| on stale zero:90 |"), "{said}");
    let links = said
        .lines()
        .find(|line| line.starts_with("links "))
        .expect("a line");
    assert!(links.contains(" lost | /action 2 in flight"), "{links}");

    let output = ratelab(&[&args[..], &knobs, &["--json"]].concat());
    let metrics: serde_json::Value = serde_json::from_slice(&output.stdout).expect("metrics");
    let obs = &metrics["topics"]["/obs"];
    let count = |key: &str| obs[key].as_u64().expect(key);
    assert!(count("lost") > 200);
    assert_eq!(count("published"), 501);
    assert_eq!(
        [count("dropped"), count("overtaken"), count("in_flight")],
        [0; 3]
    );
    assert_eq!(metrics["obs_published"], 501);
    assert_eq!(metrics["on_stale"], "zero:90");
    assert_eq!(metrics["nodes"]["policy"]["ticks"], 501);

    let plain = text(&ratelab(&["run", "--clock", "virtual"]).stdout);
    assert!(
        !plain.contains("links") && !plain.contains("stale"),
        "{plain}"
    );
}

#[test]
fn the_real_clock_takes_a_core_away_by_priority_where_the_system_grants_it() {
    let folder = TempDir::new().expect("folder");
    let (graph, recorded) = (path(&folder, "graph.toml"), path(&folder, "run.rrd"));
    let text_of_graph = "\
        name = \"core\"\n[node.fast]\nrate = 100\ntakes = 2\npriority = 0\n\
        [node.slow]\nrate = 10\ntakes = 30\npriority = 1\npublishes = [\"/slow\"]\n\
        [executor.core]\nkind = \"fixed-priority:1\"\nnodes = [\"fast\", \"slow\"]\n";
    fs::write(&graph, text_of_graph).expect("written");
    let run = [
        "run",
        &graph,
        "--clock",
        "real",
        "--duration-s",
        "1",
        "--json",
    ];
    assert!(complaint(&ratelab(&run), 2).contains("needs real-time priority"));
    let output = ratelab(&[&run[..], &["--realtime", "--record", &recorded]].concat());
    if !output.status.success() {
        println!("skipped: {}", text(&output.stderr));
        return;
    }
    let metrics: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    // Three ticks of the fast node come within 30 ms.
    let cost = &metrics["nodes"]["slow"]["cost"];
    let p50 = cost["p50_ms"].as_f64().expect("a duration");
    assert!(p50 > 34.0, "{cost}: it was never set aside");
    let verified = ratelab(&["verify", &recorded]);
    assert!(verified.status.success(), "{}", text(&verified.stderr));
}
