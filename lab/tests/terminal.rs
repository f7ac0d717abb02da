//! The lab in a real terminal: start, keys, resizing, end.
#![cfg(unix)]

#[path = "support/terminal.rs"]
mod terminal;

use std::{
    io::Read,
    path::Path,
    process::Command,
    thread,
    time::{Duration, Instant},
};

use portable_pty::{CommandBuilder, PtySize, native_pty_system};
use terminal::{Lab, PATIENCE};

fn assert_given_back(parser: &vt100::Parser) {
    assert!(
        !parser.screen().alternate_screen(),
        "still on the other screen"
    );
    assert!(!parser.screen().hide_cursor(), "the cursor is hidden");
}

#[test]
fn lowering_the_rate_fells_the_pole_and_quitting_restores_the_terminal() {
    let mut lab = Lab::open(&[], 45, 160);
    lab.wait_for("BALANCED so far");
    assert!(lab.parser.screen().alternate_screen());
    lab.type_keys("[[[[[[[[[[[");
    lab.wait_for("FELL");
    lab.wait_for("readings were dropped");
    lab.resize(24, 80);
    lab.wait_for("FELL");
    lab.resize(12, 40);
    lab.wait_for("FELL");
    lab.resize(5, 20);
    lab.wait_for("needs 40x12");
    lab.resize(45, 160);
    lab.type_keys("]]]]]]]]]]]r");
    lab.wait_for("BALANCED so far");
    lab.type_keys("q");
    let (status, parser) = lab.close();
    assert!(status.success());
    assert_given_back(&parser);
    assert!(
        parser.screen().contents().contains("STOPPED"),
        "no summary after leaving"
    );
}

/// Whether some cell has a colour of this number.
fn has_colour(lab: &Lab, number: u8) -> bool {
    let screen = lab.parser.screen();
    let (rows, columns) = screen.size();
    let mut cells = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
    cells.any(|(row, column)| {
        let cell = screen.cell(row, column);
        cell.is_some_and(|cell| cell.fgcolor() == vt100::Color::Idx(number))
    })
}

#[test]
fn the_colours_are_those_for_the_background_that_the_terminal_reports() {
    let [dark, light] = [75, 25];
    for (reply, expected, other) in [
        ("\u{1b}]11;rgb:ffff/ffff/ffff\u{1b}\\", light, dark),
        ("\u{1b}]11;rgb:0000/0000/0000\u{7}", dark, light),
        ("", dark, light),
    ] {
        let mut lab = Lab::open(&[], 24, 80);
        // Keys around the reply stay keys.
        lab.type_keys(&format!("[[{reply}[["));
        lab.wait_for("● 20 Hz");
        lab.wait_for("BALANCED");
        assert!(
            has_colour(&lab, expected) && !has_colour(&lab, other),
            "{reply:?}"
        );
        lab.type_keys("q");
        assert!(lab.close().0.success());
    }
}

#[test]
fn the_graph_continues_under_the_other_clock() {
    let mut lab = Lab::open(&["lab", "--ascii"], 40, 120);
    lab.wait_for("virtual");
    lab.type_keys("c");
    lab.wait_for("on to the real clock");
    lab.type_keys("c");
    lab.wait_for("on to the virtual clock");
    lab.type_keys("\u{3}"); // Ctrl-C
    let (status, parser) = lab.close();
    assert!(status.success());
    assert_given_back(&parser);
}

#[test]
fn the_files_contain_the_last_run() {
    let folder = tempfile::TempDir::new().expect("folder");
    let (out, csv) = (folder.path().join("out"), folder.path().join("run.csv"));
    let (out, csv) = (out.display().to_string(), csv.display().to_string());
    let args = ["--break", "--speed", "10", "--out", &out, "--csv", &csv];
    let mut lab = Lab::open(&args, 40, 120);
    lab.wait_for("FELL at 0.840 s");
    lab.type_keys("nr");
    lab.wait_for("seed 1");
    lab.wait_for("FELL at 1.180 s");
    lab.type_keys("q");
    let (status, parser) = lab.close();
    assert!(status.success());
    assert_given_back(&parser);
    let rows = std::fs::read_to_string(csv).expect("rows");
    assert_eq!(
        rows.lines().count(),
        61,
        "a header and the 60 steps of seed 1"
    );
    let metrics = std::fs::read_to_string(format!("{out}/metrics.json")).expect("metrics");
    assert!(metrics.contains("\"seed\": 1"), "{metrics}");
}

#[test]
fn the_lab_ends_with_its_terminal() {
    let pair = native_pty_system()
        .openpty(PtySize::default())
        .expect("a pty");
    let command = CommandBuilder::new(env!("CARGO_BIN_EXE_ratelab"));
    let mut child = pair.slave.spawn_command(command).expect("ratelab starts");
    let mut output = pair.master.try_clone_reader().expect("output");
    assert!(output.read(&mut [0; 4096]).expect("something drawn") > 0);
    drop((output, pair));
    let deadline = Instant::now() + PATIENCE;
    while child.try_wait().expect("a child").is_none() {
        assert!(Instant::now() < deadline, "it goes on without a terminal");
        thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn without_a_terminal_the_lab_points_to_the_headless_command() {
    let output = Command::new(env!("CARGO_BIN_EXE_ratelab"))
        .output()
        .expect("ratelab starts");
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("ratelab run"), "{said}");
    assert_eq!(said.lines().count(), 1);
}

#[test]
fn w_records_the_session_and_quitting_prints_the_path() {
    let folder = tempfile::TempDir::new().expect("folder");
    let file = folder.path().join("session.rrd").display().to_string();
    let mut lab = Lab::open(&["--record", &file], 45, 160);
    lab.wait_for("● rec");
    lab.type_keys("[[[[");
    lab.wait_for("20 Hz");
    lab.type_keys("w");
    lab.wait_for("recorded");
    lab.type_keys("q");
    let (status, parser) = lab.close();
    assert!(status.success());
    assert!(parser.screen().contents().contains("recorded"));
    let mut verify = Command::new(env!("CARGO_BIN_EXE_ratelab"));
    let output = verify.args(["verify", &file]).output().expect("verified");
    assert!(output.status.success(), "{output:?}");
}

#[test]
fn a_recording_plays_in_the_panes_of_the_lab() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let file = root.join("recordings/fall-5hz.rrd").display().to_string();
    let mut lab = Lab::open(&["replay", "--terminal", &file], 45, 160);
    lab.wait_for("replay");
    // It plays up to the fall, and stops there.
    lab.wait_for("FELL at 0.840 s");
    lab.wait_for("‖    0.840 s");
    // Back by two messages: before the fall the pole is up.
    lab.type_keys(",,");
    lab.wait_for("‖    0.800 s");
    lab.wait_for("NOT LOST YET");
    // The next event is the fall.
    lab.type_keys("n");
    lab.wait_for("FELL");
    lab.resize(12, 40);
    lab.wait_for("0.840 s");
    lab.resize(45, 160);
    lab.type_keys("?");
    lab.wait_for("to the event before, to the next event");
    lab.type_keys("?q");
    let (status, parser) = lab.close();
    assert!(status.success());
    assert_given_back(&parser);
}

#[test]
fn a_recording_plays_in_the_terminal_where_no_viewer_is() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let file = root.join("recordings/fall-5hz.rrd").display().to_string();
    let mut command = CommandBuilder::new(env!("CARGO_BIN_EXE_ratelab"));
    command.args(["replay", &file]);
    command.cwd(std::env::temp_dir());
    command.env("PATH", "");
    let mut lab = Lab::start(command, 45, 160);
    lab.wait_for("FELL at 0.840 s");
    lab.type_keys("q");
    let (status, parser) = lab.close();
    assert!(status.success());
    let said = parser.screen().contents();
    assert!(said.contains("the rerun viewer was not found"), "{said}");
}

/// The terminal joins the rows of a line that it had to break itself.
#[test]
fn summaries_and_errors_are_broken_between_words() {
    for (args, text) in [
        (
            &["run", "--clock", "virtual", "--break"][..],
            "\n          (control period 200.0 ms)\n",
        ),
        (
            &["run", "--knob", "d:3"],
            "queue-depth, policy, think-ms, on-stale, rate, depth, send,",
        ),
    ] {
        let (_, parser) = Lab::open(args, 24, 80).close();
        let said = parser.screen().contents();
        assert!(said.contains(text), "{said}");
        for line in said.lines() {
            assert!(line.chars().count() <= 80, "{line}");
        }
    }
}

#[test]
fn a_result_stays_in_sight_until_the_learner_goes_on() {
    let folder = tempfile::TempDir::new().expect("folder");
    let mut lab = Lab::open_in(folder.path(), &["exercise", "7"], 24, 80);
    lab.wait_for("Your prediction in s, and why:");
    lab.type_keys("5 because it grows old\r");
    lab.wait_for("Enter goes on to 7b");
    let screen = lab.parser.screen().contents();
    for part in ["depth  stay up", "You called it", "message was read"] {
        assert!(screen.contains(part), "{part:?} is missing in\n{screen}");
    }
    lab.type_keys("\r");
    lab.wait_for("Your prediction in messages, and why:");
    lab.type_keys("4 because it is short\r");
    lab.wait_for("Next: ratelab exercise 8");
    assert!(lab.parser.screen().contents().contains("depth  stay up"));
    assert!(lab.close().0.success());
}

#[test]
fn an_exercise_is_done_in_the_lab() {
    let folder = tempfile::TempDir::new().expect("folder");
    let mut lab = Lab::open_in(folder.path(), &["--ascii"], 45, 160);
    lab.wait_for("BALANCED so far");
    lab.type_keys("e");
    lab.wait_for("A deeper queue");
    lab.type_keys("2\r");
    lab.wait_for("how many of the three runs");
    lab.type_keys("many\r");
    lab.wait_for("expected a number and a reason");
    lab.wait_for("how many of the three runs");
    lab.type_keys("\u{7f}\u{7f}\u{7f}\u{7f}8 of three\r");
    lab.wait_for("8 is impossible here");
    lab.type_keys(&"\u{7f}".repeat(10));
    lab.type_keys("0 because stale is stale\r");
    lab.wait_for("You predicted 0");
    lab.type_keys("\u{1b}");
    lab.wait_for("you predicted 0");
    lab.type_keys("\u{1b}");
    // Sent together, the two would be one key: Alt-q.
    lab.wait_without("you predicted 0");
    lab.type_keys("q");
    assert!(lab.close().0.success());
}

#[test]
fn a_cell_of_the_cliff_map_runs_live() {
    let mut lab = Lab::open(&["--queue-depth", "2"], 45, 160);
    lab.wait_for("BALANCED so far");
    lab.type_keys("m");
    lab.wait_for("m again");
    lab.type_keys("m");
    lab.wait_for("cliff map: queue-depth 2");
    lab.wait_for("50 Hz, seed 0");
    lab.wait_for("3100 runs of 10 s");
    lab.type_keys(&"\u{1b}[D".repeat(26));
    lab.wait_for("5 Hz, seed 0");
    lab.type_keys("\u{1b}[B");
    lab.wait_for("5 Hz, seed 1: FELL at 1.180 s");
    lab.type_keys("\r");
    lab.wait_for("■ ended");
    lab.type_keys("q");
    let (status, parser) = lab.close();
    assert!(status.success());
    assert_given_back(&parser);
    let said = parser.screen().contents();
    for line in ["seed 1", "control 5 Hz", "queue depth 2", "FELL at 1.180 s"] {
        assert!(said.contains(line), "{line:?} is missing in\n{said}");
    }
}

/// The process that runs in a terminal.
fn pid(lab: &Lab) -> u32 {
    lab.child.process_id().expect("running")
}

/// A shell with job control, in a separate terminal.
fn shell() -> Lab {
    let folder = std::env::temp_dir();
    let mut shell = CommandBuilder::new("sh");
    shell.args(["-i", "-m"]);
    shell.cwd(folder);
    shell.env("PS1", "PROMPT ");
    shell.env("RATELAB", env!("CARGO_BIN_EXE_ratelab"));
    Lab::start(shell, 24, 80)
}

#[test]
fn thousands_of_keys_are_all_handled() {
    for burst in [1023, 1024, 20_000] {
        let mut lab = Lab::open(&[], 24, 80);
        lab.wait_for("BALANCED so far");
        lab.type_keys(&format!("{}q", "x".repeat(burst)));
        let (status, parser) = lab.close();
        assert!(status.success(), "{burst} keys");
        assert_given_back(&parser);
    }
}

#[test]
fn an_incomplete_key_blocks_nothing() {
    let mut lab = Lab::open(&["--speed", "1"], 24, 80);
    lab.wait_for("BALANCED so far");
    lab.type_keys("\u{1b}["); // Alt-[
    lab.wait_for(" 3 s wall");
    lab.type_keys("Cq"); // The rest makes it an arrow.
    assert!(lab.close().0.success());
}

#[test]
fn a_paste_goes_into_text_fields_and_triggers_no_keys() {
    let mut lab = Lab::open(&[], 45, 160);
    lab.wait_for("BALANCED so far");
    assert!(lab.parser.screen().bracketed_paste());
    let paste = |text: &str| format!("\u{1b}[200~{text}\u{1b}[201~");
    // As keys of the lab these would break the graph, and quit.
    lab.type_keys(&paste(&"b\rq".repeat(1000)));
    lab.type_keys(":");
    lab.type_keys(&paste("control-hz 7.5\n"));
    lab.type_keys("\r");
    lab.wait_for("policy at 7.5 Hz");
    assert!(!lab.screen().contains("at 5 Hz"), "{}", lab.screen());
    lab.type_keys("q");
    let (status, parser) = lab.close();
    assert!(status.success());
    assert_given_back(&parser);
    assert!(!parser.screen().bracketed_paste());
}

#[test]
fn a_knob_of_any_node_is_completed_refused_in_full_and_edited() {
    let mut lab = Lab::open(&["--world", "own"], 45, 160);
    lab.wait_for("BALANCED so far");
    lab.type_keys(":ra\tac\t0\r");
    lab.wait_for("✖ \"0\" is not a rate");
    lab.wait_for(": rate actuator 0");
    lab.type_keys("\u{7f}25\r");
    lab.wait_for("actuator at 25 Hz");
    // The keys change the marked node.
    lab.type_keys("\u{1b}[B");
    lab.wait_for("▸actuator");
    lab.type_keys("]");
    lab.wait_for("actuator at 30 Hz");
    lab.type_keys("q");
    assert!(lab.close().0.success());
}

#[test]
fn the_shell_stops_the_lab_and_continues_it() {
    let mut shell = shell();
    shell.wait_for("PROMPT");
    shell.type_keys("\"$RATELAB\" lab\r");
    for stop in ["key", "signal"] {
        shell.wait_for("BALANCED so far");
        assert!(shell.parser.screen().alternate_screen());
        if stop == "key" {
            shell.type_keys("\u{1a}");
        } else {
            let jobs = child_of(pid(&shell));
            let kill = Command::new("kill").args(["-TSTP", &jobs]).status();
            assert!(kill.expect("kill").success());
        }
        shell.wait_for("Stopped");
        assert!(!shell.parser.screen().alternate_screen(), "{stop}");
        assert!(!shell.parser.screen().bracketed_paste(), "{stop}");
        // The terminal edits and echoes lines again.
        shell.type_keys("echo mode:$(stty -a | grep -o '.icanon' | tr ' ' +)\r");
        shell.wait_for("mode:+icanon");
        shell.type_keys("clear; fg\r");
    }
    shell.wait_for("BALANCED so far");
    assert!(shell.parser.screen().alternate_screen());
    // One key works without Enter: the mode is raw.
    shell.type_keys("?");
    shell.wait_for("show or hide this help");
    shell.type_keys("?q");
    // What is typed before the prompt may still go to the lab.
    shell.wait_for("PROMPT");
    assert!(shell.screen().contains("STOPPED"), "{}", shell.screen());
    shell.type_keys("exit\r");
    shell.close();
}

/// The only child of a process.
fn child_of(parent: u32) -> String {
    let children = format!("/proc/{parent}/task/{parent}/children");
    let children = std::fs::read_to_string(children).expect("children");
    children.trim().to_owned()
}

#[test]
fn without_a_shell_to_continue_it_the_lab_does_not_stop() {
    let mut lab = Lab::open(&[], 24, 80);
    lab.wait_for("BALANCED so far");
    lab.type_keys("\u{1a}q");
    assert!(lab.close().0.success());
}

#[test]
fn a_policy_with_a_tick_of_a_minute_does_not_block_the_lab() {
    for keys in ["q", "rq"] {
        let mut lab = Lab::open(&["--clock", "real", "--think-ms", "60000"], 24, 80);
        // The pole falls during the policy's first tick.
        lab.wait_for("−12.");
        lab.type_keys(keys);
        let (status, parser) = lab.close();
        assert!(status.success(), "{keys}");
        assert_given_back(&parser);
    }
}

#[test]
fn a_changed_policy_file_is_used_after_a_restart() {
    let folder = tempfile::TempDir::new().expect("folder");
    let policies = Path::new(env!("CARGO_MANIFEST_DIR")).join("../policies");
    let put = |name: &str| {
        let to = folder.path().join("x.safetensors");
        std::fs::copy(policies.join(name), to).expect("copied");
    };
    put("patient.safetensors");
    let mut lab = Lab::open_in(folder.path(), &["--policy", "x.safetensors"], 24, 80);
    lab.wait_for("BALANCED so far");
    put("prompt.safetensors");
    lab.type_keys("n");
    lab.wait_for("seed 1");
    std::fs::remove_file(folder.path().join("x.safetensors")).expect("removed");
    lab.type_keys("n");
    lab.wait_for("x.safetensors: expected");
    lab.wait_for("seed 1");
    lab.type_keys("q");
    assert!(lab.close().0.success());
}

/// Threads of the recorder's library in a process.
#[cfg(target_os = "linux")]
fn recorder_threads(pid: u32) -> usize {
    let tasks = std::fs::read_dir(format!("/proc/{pid}/task")).expect("threads");
    let names = tasks.flatten().filter_map(|task| {
        let name = std::fs::read_to_string(task.path().join("comm"));
        name.ok() // It may have ended already.
    });
    let ours = |name: &String| name.starts_with("ChunkBatcher") || name.starts_with("RecordingStr");
    names.filter(ours).count()
}

#[test]
#[cfg(target_os = "linux")]
fn recordings_leave_no_threads_behind() {
    let folder = tempfile::TempDir::new().expect("folder");
    let mut lab = Lab::open_in(folder.path(), &[], 24, 80);
    lab.wait_for("BALANCED so far");
    std::fs::create_dir(folder.path().join("recordings")).expect("a folder");
    let record = |lab: &mut Lab| {
        lab.type_keys("w");
        lab.wait_for("● rec");
        lab.type_keys("w");
        lab.wait_without("● rec");
    };
    record(&mut lab);
    // The first recording keeps some threads, but only once. On a busy machine they are there
    // some time after its mark on the screen.
    let deadline = Instant::now() + PATIENCE;
    while recorder_threads(pid(&lab)) == 0 {
        assert!(
            Instant::now() < deadline,
            "the first recording has no threads"
        );
        thread::sleep(Duration::from_millis(5));
    }
    let first = recorder_threads(pid(&lab));
    (0..5).for_each(|_| record(&mut lab));
    let deadline = Instant::now() + PATIENCE;
    while recorder_threads(pid(&lab)) > first {
        let threads = recorder_threads(pid(&lab));
        assert!(Instant::now() < deadline, "{first} threads, then {threads}");
        thread::sleep(Duration::from_millis(20));
    }
    lab.type_keys("q");
    assert!(lab.close().0.success());
}

#[test]
fn a_termination_signal_restores_the_terminal_and_prints_the_summary() {
    let mut lab = Lab::open(&["--clock", "real"], 24, 80);
    lab.wait_for("BALANCED so far");
    let pid = lab.child.process_id().expect("running").to_string();
    let kill = Command::new("kill").args(["-TERM", &pid]).status();
    assert!(kill.expect("kill").success());
    let (status, parser) = lab.close();
    assert_eq!(status.exit_code(), 143);
    assert_given_back(&parser);
    let said = parser.screen().contents();
    assert!(said.contains("STOPPED"), "{said}");
}

#[test]
fn a_refused_lab_changes_and_creates_no_file() {
    let folder = tempfile::TempDir::new().expect("folder");
    let at = |name: &str| folder.path().join(name);
    let old = "step,time_s,cart_position_m,cart_velocity_m_s,cos_theta,sin_theta,\
               pole_angular_velocity_rad_s,action,latency_s\nrows";
    std::fs::write(at("old.csv"), old).expect("written");
    std::fs::write(at("taken.rrd"), "mine").expect("written");
    for csv in ["old.csv", "new.csv"] {
        let args = ["lab", "--csv", csv, "--record", "taken.rrd", "--out", "a/b"];
        let lab = Lab::open_in(folder.path(), &args, 24, 80);
        let (status, parser) = lab.close();
        let said = parser.screen().contents();
        assert_eq!(status.exit_code(), 2, "{said}");
        assert!(said.contains("taken.rrd: there is such a file"), "{said}");
        let files = folder.path().read_dir().expect("folder");
        let visible = files.filter(|file| {
            let name = file.as_ref().expect("a file").file_name();
            !name.to_string_lossy().starts_with('.')
        });
        assert_eq!(visible.count(), 2);
        assert_eq!(std::fs::read_to_string(at("old.csv")).expect("rows"), old);
    }
}

#[test]
fn a_limit_on_the_size_of_files_restores_the_terminal() {
    let folder = tempfile::TempDir::new().expect("folder");
    let program = env!("CARGO_BIN_EXE_ratelab");
    let line = format!("ulimit -f 40; exec '{program}' --csv rows.csv --speed 100");
    let mut shell = CommandBuilder::new("sh");
    shell.args(["-c", &line]);
    shell.cwd(folder.path());
    let mut lab = Lab::start(shell, 24, 80);
    lab.wait_for("BALANCED so far");
    // The limit is 20,480 bytes: some 250 rows, or five seconds of run time.
    let csv = folder.path().join("rows.csv");
    let deadline = Instant::now() + PATIENCE;
    while csv.metadata().expect("rows").len() < 20_480 {
        assert!(Instant::now() < deadline, "the limit is never reached");
        thread::sleep(Duration::from_millis(5));
    }
    lab.type_keys("q");
    let (status, parser) = lab.close();
    assert_eq!(status.exit_code(), 1);
    assert_given_back(&parser);
    let said = parser.screen().contents();
    assert!(
        said.contains("cannot write rows.csv: File too large"),
        "{said}"
    );
}
