//! `cargo xtask setup`, run from outside, with a shell script in Python's place: its
//! files and messages in all cases. Needs no network.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread;
use std::time::Duration;

use xtask::mujoco::Platform;

/// A separate file, because a program cannot start while a child of any thread still has
/// it open for writing.
const PYTHON: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python.sh");

/// Behaves like pip and Python: `-m` creates a wheel, `-c` unpacks a file of it.
const GOOD: &str = r#"
    --version) ;;
    -m) for dir; do :; done; echo wheel > "$dir/some.whl" ;;
    -c) mkdir -p "$(dirname "$5/$4")"; truncate -s SIZE "$5/$4" ;;
"#;

/// Hangs during the download.
const HANGS: &str = r#"
    --version) ;;
    -m) for dir; do :; done; echo half > "$dir/half.whl"; exec sleep 5 ;;
"#;

/// An `xtask` folder as in a fresh clone, one for each test.
struct Checkout(PathBuf);

impl Checkout {
    fn new(name: &str) -> Self {
        let root = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        let _ = fs::remove_dir_all(&root);
        fs::create_dir_all(root.join("mujoco")).unwrap();
        fs::write(root.join("mujoco/requirements.txt"), "the pin\n").unwrap();
        Self(root)
    }

    fn command(&self, answers: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_xtask"));
        command
            .arg("setup")
            .env("CARGO_MANIFEST_DIR", &self.0)
            .env("MUJOCO_DYNAMIC_LINK_DIR", self.0.join("mujoco"))
            .env_remove("MUJOCO_STATIC_LINK_DIR")
            .env("PYTHON", PYTHON)
            .env("ANSWERS", answers.replace("SIZE", &size().to_string()))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        command
    }

    fn setup(&self, answers: &str) -> Output {
        self.command(answers).output().unwrap()
    }

    fn library(&self) -> PathBuf {
        self.0.join("mujoco").join(library())
    }

    /// The files in the folder besides the pin.
    fn brought(&self) -> Vec<String> {
        let entries = fs::read_dir(self.0.join("mujoco")).unwrap();
        let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
        names.filter(|name| name != "requirements.txt").collect()
    }

    /// Runs a set-up with a failing Python; returns the message to the user.
    fn failure(&self, answers: &str) -> String {
        let output = self.setup(answers);
        assert_eq!(output.status.code(), Some(1));
        assert_eq!(self.brought(), [""; 0], "something half-made stayed");
        said(&output)
    }

    /// Starts a set-up that hangs in its download, and waits for that.
    fn hanging_setup(&self) -> Child {
        let mut child = self.command(HANGS).spawn().unwrap();
        while !self.has_half_a_wheel() {
            assert!(child.try_wait().unwrap().is_none(), "it did not hang");
            thread::sleep(Duration::from_millis(5));
        }
        child
    }

    fn has_half_a_wheel(&self) -> bool {
        let half = |name| self.0.join("mujoco").join(name).join("half.whl");
        self.brought().into_iter().any(|name| half(name).exists())
    }
}

impl Drop for Checkout {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn library() -> &'static str {
    Platform::host().unwrap().places[0]
}

fn size() -> u64 {
    Platform::host().unwrap().size
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_set_up_leaves_only_the_library() {
    let clone = Checkout::new("good");
    let output = clone.setup(GOOD);
    assert!(output.status.success(), "{}", said(&output));
    assert_eq!(clone.brought(), [library()]);
    assert_eq!(fs::metadata(clone.library()).unwrap().len(), size());
}

#[test]
fn a_finished_set_up_starts_no_python() {
    let clone = Checkout::new("once");
    assert!(clone.setup(GOOD).status.success());
    assert!(clone.setup("*) exit 1 ;;").status.success());
}

#[test]
fn the_library_is_no_newer_than_its_pin_so_cargo_builds_once() {
    let clone = Checkout::new("date");
    assert!(clone.setup(GOOD).status.success());
    let date = |path: PathBuf| fs::metadata(path).unwrap().modified().unwrap();
    assert_eq!(
        date(clone.library()),
        date(clone.0.join("mujoco/requirements.txt"))
    );
}

#[test]
fn a_truncated_library_is_fetched_again() {
    let clone = Checkout::new("cut");
    fs::write(clone.library(), "half a library").unwrap();
    assert!(clone.setup(GOOD).status.success());
    assert_eq!(fs::metadata(clone.library()).unwrap().len(), size());
}

#[test]
fn a_killed_set_up_neither_blocks_nor_litters_the_next() {
    let clone = Checkout::new("killed");
    let mut child = clone.hanging_setup();
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(clone.has_half_a_wheel(), "the kill came too late");
    assert!(clone.setup(GOOD).status.success());
    assert_eq!(clone.brought(), [library()]);
}

#[test]
fn set_ups_at_the_same_time_all_succeed_with_one_fetch() {
    let clone = Checkout::new("together");
    let fetches = clone.0.join("fetches");
    let slow = format!("-m) echo >> '{}'; sleep 0.2;", fetches.display());
    let mut command = clone.command(&GOOD.replace("-m)", &slow));
    let children: Vec<_> = (0..4).map(|_| command.spawn().unwrap()).collect();
    for child in children {
        assert!(child.wait_with_output().unwrap().status.success());
    }
    assert_eq!(clone.brought(), [library()]);
    assert_eq!(fs::read_to_string(fetches).unwrap(), "\n");
}

#[test]
fn without_python_it_names_the_programs_it_tried() {
    let clone = Checkout::new("no_python");
    let mut command = clone.command("");
    let output = command.env("PYTHON", "/no/python").output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(said(&output).contains("no Python starts (tried: /no/python)"));
    assert!(clone.brought().is_empty());
}

#[test]
fn a_set_up_that_fails_says_why_and_leaves_nothing_half_made() {
    let broken = GOOD.replace("-c)", "-c) echo 'BadZipFile: cut' >&2; exit 1;");
    for (name, answers, part) in [
        (
            "no pip",
            "--version) ;; -m) echo '/x: No module named pip' >&2; exit 1 ;;",
            "python.sh has no pip",
        ),
        (
            "another hash",
            "--version) ;;
            -m) echo 'ERROR: THESE PACKAGES DO NOT MATCH THE HASHES' >&2
                echo ' Got  123' >&2; exit 1 ;;",
            "requirements.txt (Got 123)",
        ),
        (
            "offline",
            "--version) ;;
            -m) echo 'WARNING: Retrying after connection broken by X' >&2
                echo 'ERROR: No matching distribution' >&2; exit 1 ;;",
            "no connection to the package index",
        ),
        (
            "a wheel that does not unpack",
            &broken,
            "could not be unpacked (BadZipFile: cut)",
        ),
        ("another size", &GOOD.replace("SIZE", "7"), "has 7 bytes"),
        (
            "anything: the way without pip",
            "--version) ;; *) exit 1 ;;",
            "set MUJOCO_DYNAMIC_LINK_DIR",
        ),
    ] {
        let said = Checkout::new("failing").failure(answers);
        assert!(said.contains(part), "{name}: {said}");
    }
}

#[test]
fn a_library_of_the_users_own_is_left_to_the_user() {
    let clone = Checkout::new("own");
    let mut command = clone.command("*) exit 1 ;;");
    let output = command
        .env("MUJOCO_DYNAMIC_LINK_DIR", "/own/lib")
        .output()
        .unwrap();
    assert!(output.status.success());
    assert!(String::from_utf8_lossy(&output.stdout).contains("/own/lib"));
    assert!(clone.brought().is_empty());
}

#[test]
fn anything_but_setup_prints_the_usage_and_returns_2() {
    for arguments in [&[][..], &["install"], &["setup", "now"]] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_xtask"));
        let output = command.args(arguments).output().unwrap();
        assert_eq!(output.status.code(), Some(2));
        assert!(said(&output).starts_with("Usage: cargo xtask"));
    }
}
