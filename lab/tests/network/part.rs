//! A process of a run in several.

#[path = "../../../crates/network/tests/support/address.rs"]
pub mod address;

use std::{
    io::{BufRead, BufReader, Read},
    path::PathBuf,
    process::{Child, Command, Stdio},
    sync::mpsc::{Receiver, channel},
    thread,
    time::Duration,
};

use crate::support::{RATELAB, send, words};

/// Longest wait for a note: processes on a busy machine need some seconds to meet.
const PATIENCE: Duration = Duration::from_secs(60);

/// A process of a run; ended when it is dropped.
pub struct Part {
    child: Child,
    /// The lines that it prints to standard error.
    notes: Receiver<String>,
}

impl Part {
    /// Starts `ratelab node` with the options in `line`.
    pub fn start(line: &str) -> Self {
        Self::start_command(Command::new(RATELAB), line)
    }

    /// A part started by `command`, which starts ratelab.
    pub fn start_command(mut command: Command, line: &str) -> Self {
        command.arg("node").args(words(line));
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("ratelab starts");
        let lines = BufReader::new(child.stderr.take().expect("piped")).lines();
        let (note, notes) = channel();
        thread::spawn(move || {
            let mut lines = lines.map_while(Result::ok);
            lines.all(|line| note.send(line).is_ok())
        });
        Self { child, notes }
    }

    /// Reads its notes until one contains `text`.
    pub fn wait_for(&mut self, text: &str) {
        let mut before = String::new();
        while !before.contains(text) {
            let Ok(line) = self.notes.recv_timeout(PATIENCE) else {
                panic!("it ended, or was silent for too long, before: {text}\n{before}");
            };
            before += &(line + "\n");
        }
    }

    /// Waits for its end; returns what it printed.
    pub fn printed(self) -> String {
        self.ended(0)
    }

    /// Waits for its end with this status; returns what it printed.
    fn ended(mut self, code: i32) -> String {
        let mut printed = String::new();
        let mut output = self.child.stdout.take().expect("piped");
        output.read_to_string(&mut printed).expect("UTF-8");
        let notes: Vec<String> = self.notes.iter().collect();
        let notes = notes.join("\n");
        let status = self.child.wait().expect("ended");
        assert_eq!(status.code(), Some(code), "{notes}\n{printed}");
        printed
    }

    /// Waits for the end of the plant's process: the pole stayed up in the last run, and all
    /// actions came. One before may be lost on a busy machine, if it begins `--again`.
    pub fn balanced(self) {
        let printed = self.printed();
        let (_, last) = printed.split_once("BALANCED").expect(&printed);
        let wire = "/action from policy: 0 lost on the way, 0 refused";
        assert!(last.contains(wire), "{printed}");
    }

    /// Stops it, and waits for its end; returns what it printed.
    pub fn interrupted(self) -> String {
        // A shell without job control has its background commands, and so this test, ignore `INT`.
        self.signal("-TERM");
        self.ended(143)
    }

    pub fn signal(&self, name: &str) {
        send(name, self.child.id());
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        let ended = self.child.try_wait();
        let _ = self.child.kill();
        let _ = self.child.wait();
        if thread::panicking() {
            let notes: Vec<String> = self.notes.iter().collect();
            eprintln!("another part: {ended:?}\n{}", notes.join("\n"));
        }
    }
}

/// A process that ends with the test.
pub struct Ended(Child);

impl Ended {
    pub fn start(command: &mut Command) -> Self {
        Self(command.spawn().expect("it starts"))
    }
}

impl Drop for Ended {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The policy in Python, which speaks to the plant as a ROS node does.
pub const ROS_POLICY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/ros2/policy.py");

/// A Python with the packages `eclipse-zenoh` and `rosbags`, or the reason why there is none.
pub fn python() -> Result<PathBuf, &'static str> {
    let named = std::env::var_os("RATELAB_ROS_PYTHON").map(PathBuf::from);
    let python = named.unwrap_or_else(|| PathBuf::from("python3"));
    let mut imports = Command::new(&python);
    imports.args(["-c", "import zenoh, rosbags"]);
    match imports.stderr(Stdio::null()).status() {
        Ok(status) if status.success() => Ok(python),
        _ => Err("no Python with eclipse-zenoh and rosbags: name one in RATELAB_ROS_PYTHON"),
    }
}
