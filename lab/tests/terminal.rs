//! The lab in a real terminal: taken over, driven by keys, resized, given back.
#![cfg(unix)]

use std::{
    io::{Read, Write},
    path::Path,
    process::Command,
    sync::mpsc::{Receiver, channel},
    thread,
    time::{Duration, Instant},
};

use portable_pty::{Child, CommandBuilder, ExitStatus, MasterPty, PtySize, native_pty_system};

/// How long to wait for something that takes a fraction of a second, before
/// saying that it never came.
const PATIENCE: Duration = Duration::from_secs(60);

/// A terminal with ratelab in it.
struct Lab {
    child: Box<dyn Child + Send + Sync>,
    master: Box<dyn MasterPty + Send>,
    keys: Box<dyn Write + Send>,
    output: Receiver<Vec<u8>>,
    parser: vt100::Parser,
}

impl Lab {
    fn open(args: &[&str], rows: u16, cols: u16) -> Self {
        Self::open_in(&std::env::temp_dir(), args, rows, cols)
    }

    fn open_in(folder: &Path, args: &[&str], rows: u16, cols: u16) -> Self {
        let size = PtySize {
            rows,
            cols,
            ..PtySize::default()
        };
        let pair = native_pty_system().openpty(size).expect("a pty");
        let mut command = CommandBuilder::new(env!("CARGO_BIN_EXE_ratelab"));
        command.args(args);
        command.env("TERM", "xterm-256color");
        command.cwd(folder);
        // Nobody's own predictions are touched.
        command.env("HOME", folder);
        command.env_remove("XDG_DATA_HOME");
        let child = pair.slave.spawn_command(command).expect("ratelab starts");
        drop(pair.slave);
        let mut reader = pair.master.try_clone_reader().expect("output");
        let keys = pair.master.take_writer().expect("input");
        let (sender, output) = channel();
        thread::spawn(move || {
            let mut chunk = [0; 4096];
            while let Ok(length @ 1..) = reader.read(&mut chunk) {
                if sender.send(chunk[..length].to_vec()).is_err() {
                    return;
                }
            }
        });
        Self {
            child,
            master: pair.master,
            keys,
            output,
            parser: vt100::Parser::new(rows, cols, 0),
        }
    }

    fn type_keys(&mut self, keys: &str) {
        self.keys.write_all(keys.as_bytes()).expect("typed");
        self.keys.flush().expect("typed");
    }

    fn resize(&mut self, rows: u16, cols: u16) {
        let size = PtySize {
            rows,
            cols,
            ..PtySize::default()
        };
        self.master.resize(size).expect("resized");
        self.parser.screen_mut().set_size(rows, cols);
    }

    fn screen(&self) -> String {
        self.parser.screen().contents()
    }

    /// Reads the screen until it shows `text`.
    fn wait_for(&mut self, text: &str) {
        let came = self.read_until(|screen| screen.contains(text));
        assert!(
            came,
            "{text:?} never came; the screen shows\n{}",
            self.screen()
        );
    }

    /// Reads the screen until it shows `text` no more.
    fn wait_without(&mut self, text: &str) {
        let went = self.read_until(|screen| !screen.contains(text));
        assert!(went, "{text:?} stayed; the screen shows\n{}", self.screen());
    }

    /// Reads until the screen is as wanted; false if it is not in good time.
    fn read_until(&mut self, wanted: impl Fn(&str) -> bool) -> bool {
        let deadline = Instant::now() + PATIENCE;
        while !wanted(&self.screen()) {
            let left = deadline.saturating_duration_since(Instant::now());
            match self.output.recv_timeout(left) {
                Ok(chunk) if !left.is_zero() => self.parser.process(&chunk),
                _ => return false,
            }
        }
        true
    }

    /// Reads what is left and waits for the end.
    fn close(mut self) -> (ExitStatus, vt100::Parser) {
        let deadline = Instant::now() + PATIENCE;
        let left = || deadline.saturating_duration_since(Instant::now());
        while let Ok(chunk) = self.output.recv_timeout(left()) {
            assert!(
                !left().is_zero(),
                "it does not end; the screen shows\n{}",
                self.screen()
            );
            self.parser.process(&chunk);
        }
        let parser = std::mem::replace(&mut self.parser, vt100::Parser::new(1, 1, 0));
        (self.child.wait().expect("ended"), parser)
    }
}

impl Drop for Lab {
    /// A test that fails leaves no lab behind.
    fn drop(&mut self) {
        let _ = self.child.kill();
    }
}

fn assert_given_back(parser: &vt100::Parser) {
    assert!(
        !parser.screen().alternate_screen(),
        "still on the other screen"
    );
    assert!(!parser.screen().hide_cursor(), "the cursor is hidden");
}

#[test]
fn turning_the_rate_down_fells_the_pole_and_quitting_gives_the_terminal_back() {
    let mut lab = Lab::open(&[], 45, 160);
    lab.wait_for("BALANCED so far");
    assert!(lab.parser.screen().alternate_screen());
    lab.type_keys("[[[[[[[[[[[");
    lab.wait_for("FELL");
    lab.wait_for("are the symptom");
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

#[test]
fn the_graph_goes_on_under_the_other_clock() {
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
fn what_is_written_is_of_the_last_run() {
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
fn a_termination_signal_gives_the_terminal_back() {
    let mut lab = Lab::open(&["--clock", "real"], 24, 80);
    lab.wait_for("BALANCED so far");
    let pid = lab.child.process_id().expect("running").to_string();
    let kill = Command::new("kill").args(["-TERM", &pid]).status();
    assert!(kill.expect("kill").success());
    let (status, parser) = lab.close();
    assert!(status.success());
    assert_given_back(&parser);
}

#[test]
fn a_terminal_that_goes_away_takes_the_lab_with_it() {
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
fn w_records_the_session_and_leaving_says_where() {
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
    // It plays to the fall, and stands there.
    lab.wait_for("FELL at 0.840 s");
    lab.wait_for("⏸    0.840 s");
    // Back, message by message: before the fall nothing has fallen.
    lab.type_keys(",,");
    lab.wait_for("⏸    0.800 s");
    lab.wait_for("BALANCED so far");
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
fn an_exercise_is_done_in_the_lab() {
    let folder = tempfile::TempDir::new().expect("folder");
    let mut lab = Lab::open_in(folder.path(), &["--ascii"], 45, 160);
    lab.wait_for("BALANCED so far");
    lab.type_keys("e");
    lab.wait_for("A deeper queue");
    lab.type_keys("2\r");
    lab.wait_for("how many of the three runs");
    lab.type_keys("many\r");
    lab.wait_for("does not begin with a number");
    lab.type_keys("\u{7f}\u{7f}\u{7f}\u{7f}0 because stale is stale\r");
    lab.wait_for("You predicted 0");
    lab.type_keys("\u{1b}");
    lab.wait_for("you predicted 0");
    lab.type_keys("\u{1b}");
    // Sent at once, the two would be one key: Alt-q.
    lab.wait_without("you predicted 0");
    lab.type_keys("q");
    assert!(lab.close().0.success());
}

#[test]
fn a_cell_of_the_cliff_map_runs_live() {
    let mut lab = Lab::open(&["--queue-depth", "2"], 45, 160);
    lab.wait_for("BALANCED so far");
    lab.type_keys("m");
    lab.wait_for("cliff map: scripted, sensor 50 Hz, depth 2");
    lab.wait_for("30 Hz, seed 0");
    lab.wait_for("3000 runs of 10 s");
    lab.type_keys(&"\u{1b}[D".repeat(25));
    lab.wait_for("5 Hz, seed 0");
    lab.type_keys("\u{1b}[B");
    lab.wait_for("5 Hz, seed 1: FELL at 1.180 s");
    lab.type_keys("\r");
    lab.wait_for("are the symptom");
    lab.type_keys("q");
    let (status, parser) = lab.close();
    assert!(status.success());
    assert_given_back(&parser);
    let said = parser.screen().contents();
    for line in ["seed 1", "control 5 Hz", "queue depth 2", "FELL at 1.180 s"] {
        assert!(said.contains(line), "{line:?} is missing in\n{said}");
    }
}
