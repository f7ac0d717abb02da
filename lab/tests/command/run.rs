//! `ratelab run`, as used on the command line: output, files and refusals.

use serde_json::Value;

use crate::support::{Folder, table::rows};

/// The metrics of a run on the virtual clock.
#[track_caller]
fn metrics(options: &str) -> Value {
    Folder::new().json(&format!("run --clock virtual --json {options}"))
}

#[test]
fn rows_hold_the_bits_of_every_control_step() {
    let folder = Folder::new();
    folder.says("run --clock virtual --break --csv run.csv");
    let rows = folder.read("run.csv");
    let first = |line: &str| line.split(',').take(9).collect::<Vec<_>>().join(",") + "\n";
    let first_columns: String = rows.lines().map(first).collect();
    if cfg!(all(target_arch = "x86_64", target_os = "linux")) {
        let golden = include_str!("../../../tests/golden/seed0_5hz.csv");
        assert_eq!(first_columns, golden);
    }
    assert_eq!(rows.lines().count(), 44, "a header and 43 steps");
    let metrics = folder.json("run --clock virtual --break --json");
    let cells = |line: Option<&str>| {
        let cells = line.expect("a line").split(',').skip(9);
        cells.map(str::to_owned).collect::<Vec<_>>()
    };
    let names = [
        "push_age_ms",
        "obs_dropped",
        "action_dropped",
        "latency_ms",
        "pole_angle_rad",
    ];
    assert_eq!(cells(rows.lines().next()), names);
    // The action was made of a reading 160 ms before the last step.
    let [age, obs, action, latency, angle] = &*cells(rows.lines().last()) else {
        panic!("{rows}");
    };
    assert_eq!([age, latency].map(String::as_str), ["40"; 2]);
    assert_eq!(
        [obs, action].map(|count| count.parse().ok()),
        [
            metrics["obs_dropped"].as_u64(),
            metrics["action_dropped"].as_u64()
        ]
    );
    let angle: f64 = angle.parse().expect("an angle");
    let known = metrics["final_pole_angle_rad"].as_f64().expect("an angle");
    assert!((angle - known).abs() < 1e-4, "{angle} is not {known}");
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
fn what_links_did_is_in_the_metrics() {
    let metrics = metrics(
        "--world own --on-stale zero:90 --knob 'link /obs loss:0.5' \
         --knob 'link /action delay:30'",
    );
    let obs = &metrics["topics"]["/obs"];
    let count = |key: &str| obs[key].as_u64().expect(key);
    assert!(count("lost") > 200);
    assert_eq!(count("published"), 501);
    assert_eq!(["dropped", "overtaken", "in_flight"].map(count), [0; 3]);
    assert_eq!(metrics["obs_published"], 501);
    assert_eq!(metrics["on_stale"], "zero:90");
    assert_eq!(metrics["nodes"]["policy"]["ticks"], 501);
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
fn the_real_clock_takes_a_core_away_by_priority_or_deadline_where_the_system_grants_it() {
    // Three ticks of the fast node come within 30 ms of the slow one, whose deadline is its period,
    // or earlier than all others.
    for [kind, deadline, node, figure, at_least] in rows(
        r"fixed-priority:1 | | slow | /cost/p50_ms | 34
          edf:1 | | slow | /cost/p50_ms | 34
          edf:1 | deadline_ms = 5\n | fast | /response/p99_ms | 20",
    ) {
        let folder = Folder::new();
        let nodes = "[node.fast]\nrate = 100\ntakes = 2\npriority = 0\n\
                     [node.slow]\nrate = 10\ntakes = 30\npriority = 1\npublishes = [\"/slow\"]\n";
        let executor = format!("[executor.core]\nkind = {kind:?}\nnodes = [\"fast\", \"slow\"]\n");
        let graph = format!("name = \"core\"\n{nodes}{deadline}{executor}");
        folder.write("graph.toml", &graph);
        let run = "run graph.toml --clock real --duration-s 1 --json";
        folder.plays(&format!("2 ratelab {run} => needs real-time priority"));
        let output = folder.does(&format!("{run} --realtime --record run.rrd"));
        if !output.status.success() {
            println!("skipped: {output:?}");
            return;
        }
        let metrics: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let found = metrics["nodes"][&node].pointer(&figure);
        let found = found.and_then(Value::as_f64).expect("a duration");
        let at_least: f64 = at_least.parse().expect("milliseconds");
        assert!(found > at_least, "{graph}: {node} never waited: {found} ms");
        folder.says("verify run.rrd");
    }
}
