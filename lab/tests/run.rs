//! `ratelab run`, as used on the command line: output, files and refusals.

mod support;

use std::{fs, path::Path};

use serde_json::Value;
use support::{Folder, Said, User};

/// The metrics of a run on the virtual clock.
#[track_caller]
fn metrics(options: &str) -> Value {
    Folder::new().json(&format!("run --clock virtual --json {options}"))
}

#[test]
fn the_published_figures_are_reproduced_at_every_control_rate() {
    for (rate, latency, dropped, steps) in [
        ("50", 0.0, 0, 501),
        ("25", 9.98, 250, 501),
        ("20", 23.9521, 300, 501),
        ("15", 35.9281, 350, 501),
        ("10", 39.9202, 400, 501),
        ("5", 85.1163, 37, 43),
    ] {
        let metrics = metrics(&format!("--control_hz {rate}"));
        assert_eq!(metrics["mean_latency_ms"], latency, "{rate} Hz");
        assert_eq!(metrics["obs_dropped"], dropped, "{rate} Hz");
        assert_eq!(metrics["steps"], steps, "{rate} Hz");
        assert_eq!(metrics["balanced"], steps == 501, "{rate} Hz");
    }
}

#[test]
fn the_same_command_gives_the_same_bytes() {
    let folder = Folder::new();
    let once = |name: &str| {
        let files = format!("--out {name} --csv {name}.csv");
        folder.says(&format!("run --clock virtual --control-hz 7 {files}"));
        ["/metrics.json", ".csv"].map(|file| folder.read(&format!("{name}{file}")))
    };
    assert_eq!(once("first"), once("second"));
}

#[test]
fn rows_hold_the_bits_of_every_control_step() {
    let folder = Folder::new();
    folder.says("run --clock virtual --break --csv run.csv");
    let rows = folder.read("run.csv");
    if cfg!(all(target_arch = "x86_64", target_os = "linux")) {
        assert_eq!(rows, include_str!("../../tests/golden/seed0_5hz.csv"));
    }
    assert_eq!(rows.lines().count(), 44, "a header and 43 steps");
}

#[test]
fn an_underscore_or_a_hyphen_makes_no_difference() {
    let underscores = "--control_hz=20 --sensor_hz=40 --queue_depth=3 --duration_s=3";
    assert_eq!(
        metrics(underscores),
        metrics(&underscores.replace('_', "-"))
    );
}

#[test]
fn knobs_are_set_at_their_times_and_printed() {
    let folder = Folder::new();
    let knobs = "# slower\n2.5 control_hz 10\n\n4 queue-depth 100 # hides it\n";
    folder.write("knobs", knobs);
    folder
        .says("run --clock virtual --knobs knobs")
        .has("knob      2.5 control-hz 10")
        .has("knob      4 queue-depth 100")
        .has("control 50 Hz → 10 Hz")
        .has("control period 100.0 ms")
        .has("/obs 50.1 msg/s (60 dropped)");
}

#[test]
fn any_knob_is_turned_before_the_run_and_the_last_one_holds() {
    let metrics = metrics(
        "--control-hz 5 --knob 'rate sensor 100' --knob 'depth /obs 3' --knob 'control_hz 7' \
         --knob 'control-hz 10'",
    );
    assert_eq!(metrics["control_hz"], 10.0);
    assert_eq!(metrics["sensor_hz"], 100.0);
    assert_eq!(metrics["obs_dropped"], 700, "seven of ten");
}

#[test]
fn a_line_of_knobs_that_cannot_be_obeyed_is_named() {
    let folder = Folder::new();
    for (line, why) in [
        ("1 rate nobody 10", "there is no node \"nobody\""),
        ("1 link /nowhere none", "there is no topic \"/nowhere\""),
        ("1 link /state none", "/state has no reader"),
        ("1 policy nowhere.pt", "nowhere.pt"),
        ("1 volume 11", "\"volume\" is not a knob"),
    ] {
        folder.write(
            "knobs",
            format!("# on the way\n0.5 control-hz 20\n{line}\n"),
        );
        let said = folder.refuses("run --smoke --knobs knobs");
        said.has("--knobs knobs: line 3: ").has(why);
    }
}

#[test]
fn a_knob_after_the_end_is_reported_as_unused() {
    let folder = Folder::new();
    folder.write("knobs", "30 control-hz 10");
    let said = folder.says("run --smoke --knobs knobs");
    said.has("30 control-hz 10: the run had ended");
}

#[test]
fn smoke_is_two_seconds_of_virtual_time() {
    let metrics = metrics("--smoke");
    assert_eq!(metrics["sim_time_s"], 2.0);
    assert_eq!(metrics["clock"], "virtual");
    assert_eq!(metrics["smoke"], true);
}

#[test]
fn bad_input_is_one_line_that_names_option_value_and_range() {
    let folder = Folder::with(&["tests/fixtures/policies/asks.pt"]);
    folder.refuses_each(
        "run",
        r#"
        --control-hz -5                        | --control-hz | -5 | 0.001 to 10000
        --control-hz 0                         | --control-hz | 0.001 to 10000
        --control-hz nan                       | --control-hz | nan | 0.001 to 10000
        --sensor-hz inf                        | --sensor-hz | inf | 0.001 to 10000
        --sensor-hz 1e9                        | --sensor-hz | 1e9 | 0.001 to 10000
        --queue-depth 0                        | --queue-depth | 1 to 1000000
        --duration-s -1                        | --duration-s | -1 | 0.001 to
        --duration 1                           | similar | --duration-s
        --seed -1                              | --seed | -1 | 0 to
        --policy alexnet                       | --policy | alexnet | lqr or a file of weights
        --policy /                             | --policy / | found a directory
        --policy asks.pt                       | asks.pt | never code | posix.system
        --speed 1000                           | --speed | 1000 | 0.1 to 100
        --smoke --clock real                   | --smoke | virtual
        --clock virtual --realtime             | --realtime | real
        --break --control-hz 3                 | --break | --control-hz
        --knob 'link '                         | expected link TOPIC SPEC
        --knob '0 lose /obs 3'                 | no time here | --knobs
        --knob 'rate nobody 5'                 | no node "nobody"
        --knob 'volume 11'                     | --knob "volume 11": "volume" is not a knob
        --knob 'policy alexnet'                | --knob "policy alexnet": alexnet: expected
        --knob 'rate actuator 25'              | 20 ms of the plant's time
        --knobs /nonexistent/knobs             | --knobs | /nonexistent/knobs
        --world-step-ms 2                      | has its own step
        --world own --world-step-ms 3          | expected 1, 2, 5 or 10
        --takes policy                         | expected NODE=SPEC
        --takes polcy=3                        | expected one of sensor, policy, actuator
        --takes policy=recorded:nowhere.rrd    | nowhere.rrd
        --world own --takes world=1            | the world moves by itself
        --offset sensor=-1                     | -1
        "#,
    );
}

#[test]
fn an_option_before_the_command_is_one_line_without_usage() {
    Folder::new().refuses("--seed 3 run").lacks("<COMMAND>");
}

#[test]
fn rows_that_cannot_be_written_end_the_run_with_an_error() {
    if !Path::new("/dev/full").exists() {
        return;
    }
    let (said, _) = Folder::new().fails("run --smoke --csv /dev/full", 1);
    said.has("cannot write /dev/full");
}

#[cfg(unix)]
#[test]
fn knobs_are_read_from_ordinary_files_of_reasonable_size_only() {
    let folder = Folder::new();
    folder.make_pipe("pipe");
    let file = fs::File::create(folder.path("large")).expect("made");
    file.set_len(1 << 32).expect("longer");
    folder.refuses_each(
        "run --smoke --knobs",
        "/dev/zero | /dev/zero | no ordinary file
         pipe      | pipe      | no ordinary file
         /         | /         | found a directory
         large     | large     | found 4294967296 bytes",
    );
}

#[test]
fn a_path_with_a_hash_can_be_a_knob_and_is_printed_as_it_is_read() {
    let folder = Folder::with(&["tests/fixtures/policies/actor.pt"]);
    for name in ["a#b.pt", "a #b.pt"] {
        fs::copy(folder.path("actor.pt"), folder.path(name)).expect("copied");
        let escaped = folder
            .path(name)
            .display()
            .to_string()
            .replace(" #", r" \#");
        folder.write("knobs", format!("0.5 policy {escaped} # swap\n"));
        for _ in 0..2 {
            let said = folder.says("run --smoke --knobs knobs");
            let line = said.lines().find_map(|line| line.strip_prefix("knob"));
            let line = line.expect("a knob").trim();
            assert!(
                line.starts_with(&format!("0.5 policy {escaped}@")),
                "{line}"
            );
            folder.write("knobs", line);
        }
    }
}

#[test]
fn an_error_is_a_line_without_effect_on_the_terminal() {
    let folder = Folder::new();
    for (line, part) in [
        (
            "run --policy \u{1b}[31mred\u{202e}",
            r"\u{1b}[31mred\u{202e}: expected",
        ),
        ("run \u{1b}[31m", r"\u{1b}[31m"),
        ("run \u{1b}[31m", "ends in .toml"),
        ("\u{9b}31m", r"\u{9b}31m"),
    ] {
        folder.refuses(line).has(part);
    }
    folder.write("knobs", "x".repeat(100_000));
    let said = folder.refuses("run --knobs knobs");
    assert!(said.len() < 2_000, "{} bytes", said.len());
    said.has("is not a timed knob: expected seconds");
}

#[test]
fn configured_costs_are_measured_in_virtual_time() {
    let usual = metrics("");
    assert_eq!(usual["world"], "course");
    assert_eq!(usual.get("world_step_ms"), None);
    assert_eq!(usual["nodes"]["policy"].get("cost"), None);
    let timed = metrics("--world own --takes policy=30 --offset sensor=5");
    assert_eq!(timed["world"], "own");
    assert_eq!(timed["world_step_ms"], 1);
    let policy = &timed["nodes"]["policy"];
    assert_eq!(policy["cost"]["max_ms"], 30.0);
    assert_eq!(policy["response"]["p50_ms"], 30.0);
    assert_eq!([&policy["ticks"], &policy["overruns"]], [251, 250]);
    assert_eq!(timed["nodes"]["sensor"]["cost"]["count"], 0);
    assert_eq!(timed["nodes"]["actuator"].get("cost"), None);
    assert_eq!(timed.get("wall_time_s"), None);
    let think = metrics("--world own --think-ms 30 --offset sensor=5");
    assert_eq!(think, timed);
}

#[test]
fn the_world_is_printed_where_it_matters() {
    let summary = |options: &str| Folder::new().says(&format!("run --clock virtual {options}"));
    // The age of the screen, whatever the world.
    let usual = summary("");
    usual.lacks("world ").has("push age  mean 10.0 ms");
    summary("--break")
        .has("43 plant steps")
        .has("mean 85.1 ms")
        .has("in the last second 96.2 ms");
    summary("--knob 'crash actuator'")
        .has("UNDECIDED (the plant never moved): 0 plant steps in 10.00 s sim");
    summary("--takes policy=60").has("course: it waits for the actuator");
    for knob in ["link /action delay:10", "lose /obs 3", "crash sensor"] {
        summary(&format!("--knob '{knob}'")).has("course: it waits for");
    }
    summary("--takes policy=60")
        .has("push age  mean 90.0 ms")
        .has("overruns  policy 334 of 501");
    let own = summary("--world own --world-step-ms 5");
    own.has("in steps of 5 ms").has("world 50 Hz");
}

#[test]
fn row_k_of_the_own_world_is_at_20_k_ms_and_has_the_state_of_the_course_s() {
    let folder = Folder::new();
    let rows = |options: &str| {
        folder.says(&format!("run --clock virtual --csv rows.csv {options}"));
        let rows = folder.read("rows.csv");
        let rows = rows.lines().skip(1);
        let rows = rows.map(|row| row.split(',').map(str::to_owned).collect());
        rows.collect::<Vec<Vec<String>>>()
    };
    let (course, own) = (rows(""), rows("--world own --world-step-ms 10"));
    assert_eq!((course.len(), own.len()), (501, 500));
    for (k, (own, course)) in own.iter().zip(&course).enumerate() {
        assert_eq!(own[0], course[0]);
        assert_eq!(own[1].parse(), Ok(20.0 * (k + 1) as f64 / 1e3));
        assert_eq!(own[2..8], course[2..8], "row {k}");
    }
}

#[test]
fn what_links_did_is_in_the_summary_and_in_the_metrics() {
    let options = "--world own --on-stale zero:90 --knob 'link /obs loss:0.5' \
                   --knob 'link /action delay:30'";
    let said = Folder::new().says(&format!("run --clock virtual {options}"));
    said.has("| on stale zero:90 |");
    let links = said.lines().find(|line| line.starts_with("links "));
    let links = Said(links.expect("a line").to_owned());
    links.has(" lost | /action 2 in flight");

    let metrics = metrics(options);
    let obs = &metrics["topics"]["/obs"];
    let count = |key: &str| obs[key].as_u64().expect(key);
    assert!(count("lost") > 200);
    assert_eq!(count("published"), 501);
    assert_eq!(["dropped", "overtaken", "in_flight"].map(count), [0; 3]);
    assert_eq!(metrics["obs_published"], 501);
    assert_eq!(metrics["on_stale"], "zero:90");
    assert_eq!(metrics["nodes"]["policy"]["ticks"], 501);

    let plain = Folder::new().says("run --clock virtual");
    plain.lacks("links").lacks("stale");
}

#[test]
fn the_real_clock_takes_a_core_away_by_priority_where_the_system_grants_it() {
    let folder = Folder::new();
    folder.write(
        "graph.toml",
        "name = \"core\"\n[node.fast]\nrate = 100\ntakes = 2\npriority = 0\n\
         [node.slow]\nrate = 10\ntakes = 30\npriority = 1\npublishes = [\"/slow\"]\n\
         [executor.core]\nkind = \"fixed-priority:1\"\nnodes = [\"fast\", \"slow\"]\n",
    );
    let run = "run graph.toml --clock real --duration-s 1 --json";
    folder.refuses(run).has("needs real-time priority");
    let output = folder.does(&format!("{run} --realtime --record run.rrd"));
    if !output.status.success() {
        println!("skipped: {output:?}");
        return;
    }
    let metrics: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    // Three ticks of the fast node come within 30 ms.
    let cost = &metrics["nodes"]["slow"]["cost"];
    let p50 = cost["p50_ms"].as_f64().expect("a duration");
    assert!(p50 > 34.0, "{cost}: it was never set aside");
    folder.says("verify run.rrd");
}
