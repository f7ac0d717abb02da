//! The lab in a real terminal: start, keys, resizing, end.

use std::{
    fs,
    io::Read,
    thread,
    time::{Duration, Instant},
};

use portable_pty::{CommandBuilder, PtySize, native_pty_system};

use crate::support::{
    Folder, RATELAB, Said, send,
    table::rows,
    terminal::{Lab, PATIENCE, assert_given_back, command_in},
};

/// Ratelab on a large terminal, in a folder of its own.
fn open(folder: &Folder, line: &str) -> Lab {
    Lab::open_in(&folder.path(""), line, 45, 160)
}

/// The lab with these options on a small terminal, under way.
fn under_way(line: &str) -> Lab {
    let mut lab = Lab::open(line, 24, 80);
    lab.wait_for("BALANCED so far");
    lab
}

/// Waits until `reached`, which no screen shows; `what` is missing otherwise.
fn wait_until(what: &str, mut reached: impl FnMut() -> bool) {
    let deadline = Instant::now() + PATIENCE;
    while !reached() {
        assert!(Instant::now() < deadline, "{what}");
        thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn a_terminal_of_any_size_shows_the_run() {
    let mut lab = Lab::open("--break", 24, 80);
    for (rows, columns, text) in [
        (24, 80, "FELL"),
        (12, 40, "FELL"),
        (5, 20, "needs 40x12"),
        (45, 160, "readings were dropped"),
    ] {
        lab.resize(rows, columns);
        lab.wait_for(text);
    }
    lab.quit("q");
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
        let mut lab = Lab::open("", 24, 80);
        // Keys around the reply stay keys.
        lab.type_keys(&format!("[[{reply}[["));
        lab.wait_for("● 20 Hz");
        lab.wait_for("BALANCED");
        let seen = [expected, other].map(|number| has_colour(&lab, number));
        assert_eq!(seen, [true, false], "{reply:?}");
        lab.quit("q");
    }
}

#[test]
fn the_graph_continues_under_the_other_clock() {
    let mut lab = under_way("lab --ascii");
    lab.play(&[("c", "cart-pole  real"), ("c", "cart-pole  virtual")]);
    lab.quit("\u{3}"); // Ctrl-C
}

#[test]
fn the_files_contain_the_last_run() {
    let folder = Folder::new();
    let mut lab = open(&folder, "--break --speed 10 --out out --csv run.csv");
    lab.play(&[
        ("", "FELL at 0.840 s"),
        ("nr", "seed 1"),
        ("", "FELL at 1.180 s"),
    ]);
    lab.quit("q");
    let rows = folder.read("run.csv");
    assert_eq!(rows.lines().count(), 61, "a header and 60 steps of seed 1");
    Said(folder.read("out/metrics.json")).has("\"seed\": 1");
}

#[test]
fn whatever_runs_in_a_terminal_ends_with_it_and_leaves_whole_files() {
    for [line, text] in rows(
        "lab | BALANCED so far
         lab --record run.rrd --out out | ● rec
         lab --clock real --record real.rrd | ● rec
         tour | the policy
         replay --terminal fall-5hz.rrd | replay
         exercise 7 | Your prediction in s, and why:",
    ) {
        let folder = Folder::with(&["recordings/fall-5hz.rrd"]);
        let code = closed_at(&folder, &line, &text);
        assert_eq!(code, 129, "{line}");
        let files = folder.names("").into_iter();
        for recorded in files.filter(|name| name.ends_with(".rrd")) {
            folder.says(&format!("verify {recorded}")).has("identical");
        }
        if line.contains("--out") {
            Said(folder.read("out/metrics.json")).has("\"seed\": 0");
        }
    }
}

/// The exit code of ratelab in a terminal, for all three streams, that is closed once `text` is there.
fn closed_at(folder: &Folder, line: &str, text: &str) -> u32 {
    let size = PtySize {
        rows: 45,
        cols: 160,
        ..PtySize::default()
    };
    let pair = native_pty_system().openpty(size).expect("a pty");
    let command = command_in(&folder.path(""), line);
    let mut child = pair.slave.spawn_command(command).expect("ratelab starts");
    let mut output = pair.master.try_clone_reader().expect("output");
    let mut parser = vt100::Parser::new(45, 160, 0);
    let mut chunk = [0; 4096];
    while !parser.screen().contents().contains(text) {
        let length = output.read(&mut chunk).expect("output");
        assert!(length > 0, "{line}: {}", parser.screen().contents());
        parser.process(&chunk[..length]);
    }
    drop((output, pair));
    let mut status = None;
    wait_until("it goes on without a terminal", || {
        status = child.try_wait().expect("a child");
        status.is_some()
    });
    status.expect("ended").exit_code()
}

#[test]
fn w_records_the_session_and_quitting_prints_the_path() {
    let folder = Folder::new();
    let mut lab = open(&folder, "--record session.rrd");
    lab.play(&[("", "● rec"), ("[[[[", "20 Hz"), ("w", "recorded")]);
    Said(lab.quit("q")).has("recorded");
    folder.says("verify session.rrd");
}

#[test]
fn a_recording_plays_in_the_panes_of_the_lab() {
    let folder = Folder::with(&["recordings/fall-5hz.rrd"]);
    let mut lab = open(&folder, "replay --terminal fall-5hz.rrd");
    lab.play(&[
        ("", "▷ replay"),
        // It waits at its beginning, at a speed at which 0.84 s can be watched.
        ("", "‖    0.000 s"),
        ("", "0.1×"),
        ("", "Space plays it at 0.1×"),
        // It plays up to the fall, and stops there.
        ("0", "1×"),
        (" ", "FELL at 0.840 s"),
        ("", "‖    0.840 s"),
        // Back by two messages: before the fall the pole is up, with a push that is too old.
        (",,", "‖    0.800 s"),
        ("a", "a: show them"),
        ("a", "NOT LOST YET"),
        // The next event is the fall.
        ("n", "FELL"),
    ]);
    lab.resize(12, 40);
    lab.wait_for("0.840 s");
    lab.resize(45, 160);
    lab.play(&[("?", "to the event before, to the next event")]);
    lab.quit("?q");
}

#[test]
fn a_recording_plays_in_the_terminal_where_no_viewer_is() {
    let folder = Folder::with(&["recordings/fall-5hz.rrd"]);
    let mut command = CommandBuilder::new(RATELAB);
    command.args(["replay", "fall-5hz.rrd"]);
    command.cwd(folder.path(""));
    command.env("PATH", "");
    let mut lab = Lab::start(command, 45, 160);
    lab.wait_for("Space plays it");
    lab.type_keys("0 ");
    lab.wait_for("FELL at 0.840 s");
    Said(lab.quit("q")).has("the rerun viewer was not found");
}

/// The terminal joins the rows of a line that it had to break itself.
#[test]
fn summaries_and_errors_are_broken_between_words() {
    let period = "\n          (control period 200.0 ms)\n";
    let knobs = "\nqueue-depth, policy, think-ms, on-stale, observe,";
    for (line, text) in [
        ("run --clock virtual --break", period),
        ("run --knob d:3", knobs),
    ] {
        let (_, parser) = Lab::open(line, 24, 80).close();
        let said = Said(parser.screen().contents());
        let longest = said.lines().map(|line| line.chars().count()).max();
        assert!(longest <= Some(80), "{said:?}");
        said.has(text);
    }
}

#[test]
fn a_result_stays_in_sight_until_the_learner_goes_on() {
    let folder = Folder::new();
    let mut lab = Lab::open_in(&folder.path(""), "exercise 7", 24, 80);
    lab.play(&[
        ("", "Your prediction in s, and why:"),
        ("5 because it grows old\r", "Enter goes on to 7b"),
    ]);
    Said(lab.screen())
        .has("depth  stay up")
        .has("Correct")
        .has("read its newest message");
    lab.play(&[
        ("\r", "Your prediction in messages, and why:"),
        ("4 because it is short\r", "Next: ratelab exercise 1"),
    ]);
    Said(lab.quit("")).has("depth  stay up");
}

#[test]
fn an_exercise_is_done_in_the_lab() {
    let folder = Folder::new();
    let mut lab = open(&folder, "--ascii");
    lab.play(&[
        ("", "BALANCED so far"),
        ("e", "A deeper queue"),
        ("2\r", "how many of the three runs"),
        ("many\r", "expected a number and a reason"),
        ("", "how many of the three runs"),
        (
            "\u{7f}\u{7f}\u{7f}\u{7f}8 of three\r",
            "8 is impossible here",
        ),
    ]);
    lab.type_keys(&"\u{7f}".repeat(10));
    lab.play(&[
        ("0 because stale is stale\r", "You predicted 0"),
        ("\u{1b}", "you predicted 0"),
    ]);
    lab.type_keys("\u{1b}");
    // Sent together, the two would be one key: Alt-q.
    lab.wait_without("you predicted 0");
    lab.quit("q");
}

/// The process that runs in a terminal.
fn pid(lab: &Lab) -> u32 {
    lab.child.process_id().expect("running")
}

#[test]
fn thousands_of_keys_are_all_handled() {
    for burst in [1023, 1024, 20_000] {
        under_way("").quit(&format!("{}q", "x".repeat(burst)));
    }
}

#[test]
fn an_incomplete_key_blocks_nothing() {
    let mut lab = Lab::open("--speed 1", 45, 160);
    lab.wait_for("BALANCED so far");
    // Alt-[, which the rest makes an arrow.
    lab.play(&[("\u{1b}[", " 3 s wall")]);
    lab.quit("Cq");
}

#[test]
fn a_paste_goes_into_text_fields_and_triggers_no_keys() {
    let mut lab = Lab::open("", 45, 160);
    lab.wait_for("BALANCED so far");
    assert!(lab.parser.screen().bracketed_paste());
    let paste = |text: &str| format!("\u{1b}[200~{text}\u{1b}[201~");
    // As keys of the lab these would break the graph, and quit; a line feed would enter nothing.
    lab.type_keys(&paste(&"b\rq".repeat(1000)));
    lab.type_keys(&format!(":{}", paste("control-hz\r\n7.5\n")));
    lab.play(&[("\r", "policy at 7.5 Hz")]);
    Said(lab.screen()).lacks("at 5 Hz");
    lab.quit("q");
}

#[test]
fn the_shell_stops_the_lab_and_continues_it() {
    let mut shell = CommandBuilder::new("sh");
    shell.args(["-i", "-m"]); // With job control.
    shell.cwd(std::env::temp_dir());
    shell.env("PS1", "PROMPT ");
    shell.env("RATELAB", RATELAB);
    let mut shell = Lab::start(shell, 24, 80);
    shell.wait_for("PROMPT");
    shell.type_keys("\"$RATELAB\" lab\r");
    for stop in ["key", "signal"] {
        shell.wait_for("BALANCED so far");
        assert!(shell.parser.screen().alternate_screen());
        if stop == "key" {
            shell.type_keys("\u{1a}");
        } else {
            send("-TSTP", child_of(pid(&shell)));
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
    Said(shell.screen()).has("STOPPED");
    shell.type_keys("exit\r");
    shell.close();
}

/// The only child of a process.
fn child_of(parent: u32) -> u32 {
    let children = format!("/proc/{parent}/task/{parent}/children");
    let children = fs::read_to_string(children).expect("children");
    children.trim().parse().expect("one")
}

#[test]
fn without_a_shell_to_continue_it_the_lab_does_not_stop() {
    under_way("").quit("\u{1a}q");
}

#[test]
fn a_policy_with_a_tick_of_a_minute_does_not_block_the_lab() {
    for keys in ["q", "rq"] {
        let mut lab = Lab::open("--clock real --think-ms 60000", 24, 80);
        // The pole falls during the policy's first tick.
        lab.wait_for("−12.");
        lab.quit(keys);
    }
}

/// Threads of the recorder's library in a process.
#[cfg(target_os = "linux")]
fn recorder_threads(pid: u32) -> usize {
    let tasks = fs::read_dir(format!("/proc/{pid}/task")).expect("threads");
    let names = tasks.flatten().filter_map(|task| {
        let name = fs::read_to_string(task.path().join("comm"));
        name.ok() // It may have ended already.
    });
    let ours = |name: &String| name.starts_with("ChunkBatcher") || name.starts_with("RecordingStr");
    names.filter(ours).count()
}

#[test]
#[cfg(target_os = "linux")]
fn recordings_leave_no_threads_behind() {
    let folder = Folder::new();
    fs::create_dir(folder.path("recordings")).expect("a folder");
    let mut lab = open(&folder, "");
    lab.wait_for("BALANCED so far");
    let record = |lab: &mut Lab| {
        lab.play(&[("w", "● rec")]);
        lab.type_keys("w");
        lab.wait_without("● rec");
    };
    record(&mut lab);
    // The first recording keeps some threads, but only once. On a busy machine they are there
    // some time after its mark on the screen.
    let threads = || recorder_threads(pid(&lab));
    wait_until("the first recording has no threads", || threads() > 0);
    let first = threads();
    (0..5).for_each(|_| record(&mut lab));
    let threads = || recorder_threads(pid(&lab));
    wait_until("more threads than after the first", || threads() <= first);
    lab.quit("q");
}

#[test]
fn a_termination_signal_restores_the_terminal_and_prints_the_summary() {
    let lab = under_way("--clock real");
    send("-TERM", pid(&lab));
    let (status, parser) = lab.close();
    assert_eq!(status.exit_code(), 143);
    assert_given_back(&parser);
    Said(parser.screen().contents()).has("STOPPED");
}

#[test]
fn a_refused_lab_changes_and_creates_no_file() {
    let folder = Folder::new();
    let old = "step,time_s,cart_position_m,cart_velocity_m_s,cos_theta,sin_theta,\
               pole_angular_velocity_rad_s,action,latency_s\nrows";
    folder.write("old.csv", old);
    folder.write("taken.rrd", "mine");
    for csv in ["old.csv", "new.csv"] {
        let line = format!("lab --csv {csv} --record taken.rrd --out a/b");
        let (status, parser) = open(&folder, &line).close();
        Said(parser.screen().contents()).has("taken.rrd: there is such a file");
        assert_eq!(status.exit_code(), 2);
        let files = folder.names("").into_iter();
        let visible = files.filter(|name| !name.starts_with('.'));
        assert!(visible.eq(["old.csv", "taken.rrd"]));
        assert_eq!(folder.read("old.csv"), old);
    }
}

#[test]
fn a_limit_on_the_size_of_files_restores_the_terminal() {
    let folder = Folder::new();
    let line = format!("ulimit -f 40; exec '{RATELAB}' --csv rows.csv --speed 100");
    let mut shell = CommandBuilder::new("sh");
    shell.args(["-c", &line]);
    shell.cwd(folder.path(""));
    let mut lab = Lab::start(shell, 24, 80);
    lab.wait_for("BALANCED so far");
    // The limit is 20,480 bytes: some 250 rows, or five seconds of run time.
    let csv = folder.path("rows.csv");
    wait_until("the limit is never reached", || {
        csv.metadata().expect("rows").len() >= 20_480
    });
    lab.type_keys("q");
    let (status, parser) = lab.close();
    assert_eq!(status.exit_code(), 1);
    assert_given_back(&parser);
    Said(parser.screen().contents()).has("cannot write rows.csv: File too large");
}
