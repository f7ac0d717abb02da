//! Recordings as a user meets them: made, shown, run again, torn and refused.

mod common;

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
    thread,
    time::{Duration, Instant},
};

use tempfile::TempDir;

use common::path;

fn ratelab() -> Command {
    Command::new(env!("CARGO_BIN_EXE_ratelab"))
}

fn run(args: &[&str]) -> Output {
    ratelab().args(args).output().expect("ratelab starts")
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).expect("UTF-8")
}

/// The one line that was said of a failure.
fn complaint(output: &Output, code: i32) -> String {
    let said = String::from_utf8(output.stderr.clone()).expect("UTF-8");
    assert_eq!(output.status.code(), Some(code), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    said
}

fn folder() -> TempDir {
    TempDir::new().expect("a folder")
}

/// Records a virtual run with `args` to the file `name` in `folder`.
fn record(folder: &TempDir, name: &str, args: &[&str]) -> String {
    let file = path(folder, name);
    let args = [&["run", "--clock", "virtual", "--record", &file], args].concat();
    let output = run(&args);
    assert!(output.status.success(), "{output:?}");
    assert!(stdout(&output).contains("recorded  "), "{output:?}");
    file
}

fn reference(name: &str) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    root.join("recordings").join(name).display().to_string()
}

#[test]
fn the_reference_recordings_come_again_and_are_what_their_readme_says() {
    let told = [
        (
            "balanced-50hz.rrd",
            "identical, 3 topics, 1,503 messages",
            "mean 0.0 ms",
        ),
        (
            "fall-5hz.rrd",
            "identical, 3 topics, 91 messages",
            "FELL at 0.840 s",
        ),
        (
            "rescued.rrd",
            "identical, 3 topics, 1,004 messages",
            "knob      2.116662647 control-hz 25",
        ),
    ];
    for (name, identical, info) in told {
        let output = run(&["verify", &reference(name)]);
        assert!(output.status.success(), "{output:?}");
        assert!(stdout(&output).contains(identical), "{output:?}");
        let output = run(&["info", &reference(name)]);
        assert!(
            output.status.success() && stdout(&output).contains(info),
            "{output:?}"
        );
    }
}

#[test]
fn info_says_what_the_run_said() {
    let folder = folder();
    let knobs = path(&folder, "knobs");
    fs::write(&knobs, "1 control-hz 8\n2.5 queue-depth 4\n").expect("written");
    let args = [
        "run", "--clock", "virtual", "--seed", "3", "--knobs", &knobs, "--record",
    ];
    let file = path(&folder, "run.rrd");
    let said = stdout(&run(&[&args[..], &[&file]].concat()));
    let info = stdout(&run(&["info", &file]));
    let summary = said.lines().filter(|line| !line.starts_with("recorded"));
    // But for the wall time, to a hundredth of a second, which was rounded once.
    for line in summary {
        assert!(info.contains(line), "{line:?} is not in\n{info}");
    }
}

#[test]
fn a_recording_without_a_name_lands_in_recordings_and_overwrites_none() {
    let folder = folder();
    for _ in 0..3 {
        let output = ratelab()
            .current_dir(folder.path())
            .args(["run", "--smoke", "--record"])
            .output();
        assert!(output.expect("ratelab starts").status.success());
    }
    let files = fs::read_dir(folder.path().join("recordings")).expect("folder");
    assert_eq!(files.count(), 3);
}

#[test]
fn a_file_that_exists_is_refused_and_left_alone() {
    let folder = folder();
    let file = path(&folder, "mine.rrd");
    fs::write(&file, "mine").expect("written");
    let said = complaint(&run(&["run", "--smoke", "--record", &file]), 2);
    assert!(
        said.contains("overwrite none: choose another name"),
        "{said}"
    );
    assert_eq!(fs::read_to_string(&file).expect("read"), "mine");
    let said = complaint(&run(&["run", "--smoke", "--record", "/dev/null/x.rrd"]), 2);
    assert!(said.contains("/dev/null/x.rrd"), "{said}");
}

#[test]
fn recording_changes_no_figure() {
    let folder = folder();
    let args = [
        "run",
        "--clock",
        "virtual",
        "--json",
        "--control-hz",
        "7",
        "--csv",
    ];
    let (plain, csv) = (path(&folder, "plain.csv"), path(&folder, "recorded.csv"));
    let without = run(&[&args[..], &[&plain]].concat());
    let file = path(&folder, "run.rrd");
    let with = run(&[&args[..], &[&csv, "--record", &file]].concat());
    assert!(with.status.success());
    assert_eq!(
        stdout(&without),
        stdout(&with),
        "stdout is the metrics alone"
    );
    let read = |path: &String| fs::read(path).expect("read");
    assert_eq!(read(&plain), read(&csv));
    assert!(String::from_utf8_lossy(&with.stderr).contains("run.rrd"));
}

#[test]
fn what_is_no_recording_is_refused_in_one_line() {
    let folder = folder();
    let file = path(&folder, "file.rrd");
    for content in [
        "",
        "step,time_s\n",
        "RRF2 and rubbish that goes on for a while",
    ] {
        fs::write(&file, content).expect("written");
        for command in [&["info", &file][..], &["verify", &file], &["replay", &file]] {
            let said = complaint(&run(command), 2);
            assert!(
                said.contains("file.rrd") && said.contains("recording"),
                "{said}"
            );
        }
    }
    let missing = path(&folder, "missing.rrd");
    for target in [&missing, &folder.path().display().to_string()] {
        for command in ["info", "verify", "replay"] {
            complaint(&run(&[command, target]), 2);
        }
    }
}

#[test]
fn a_torn_file_is_shown_as_far_as_it_is_good() {
    let folder = folder();
    let file = path(&folder, "torn.rrd");
    let whole = fs::read(reference("rescued.rrd")).expect("read");
    fs::write(&file, &whole[..whole.len() - 200_000]).expect("written");
    // Its batches were put together, so nothing of it is whole.
    complaint(&run(&["info", &file]), 2);
    let killed = killed(&folder);
    for command in ["info", "verify"] {
        let output = run(&[command, &killed]);
        let said = complaint(&output, 2);
        assert!(said.contains("this file is good up to"), "{said}");
        assert!(!stdout(&output).is_empty(), "nothing was shown");
    }
    let output = run(&["verify", &killed]);
    assert!(
        stdout(&output).contains("identical, 3 topics"),
        "{output:?}"
    );
}

/// The recording of a run at the wall's speed that was killed after 2.5 s.
fn killed(folder: &TempDir) -> String {
    killed_after(folder, Duration::from_millis(2_500)).0
}

/// The recording of a run at the wall's speed that was killed, and for how long
/// it was made.
fn killed_after(folder: &TempDir, time: Duration) -> (String, f64) {
    let file = path(folder, "killed.rrd");
    let _ = fs::remove_file(&file);
    let args = [
        "run", "--clock", "virtual", "--speed", "1", "--record", &file,
    ];
    let mut child = ratelab()
        .args(args)
        .stdout(Stdio::null())
        .spawn()
        .expect("ratelab starts");
    while !Path::new(&file).exists() {
        thread::sleep(Duration::from_millis(1));
    }
    let began = Instant::now();
    thread::sleep(time);
    child.kill().expect("killed");
    let lived = began.elapsed().as_secs_f64();
    child.wait().expect("gone");
    (file, lived)
}

#[test]
fn of_a_run_that_is_killed_all_but_the_last_second_is_there() {
    let folder = folder();
    // A busy machine may keep any thread waiting, but not every time.
    let lost = (0..5).map(|_| {
        let (file, lived) = killed_after(&folder, Duration::from_millis(2_500));
        let said = complaint(&run(&["info", &file]), 2);
        let until = said.split_once("good up to ").expect("a time").1;
        let until = until.split(' ').next().expect("a time").parse::<f64>();
        lived - until.expect("seconds")
    });
    let lost: Vec<f64> = lost.take_while(|lost| *lost > 1.0).collect();
    assert!(lost.len() < 5, "{lost:?} s were lost");
}

/// The only one for which a limit on the size of files can be set from outside.
#[cfg(unix)]
#[test]
fn a_full_disk_ends_the_recording_and_not_the_run() {
    let folder = folder();
    let file = path(&folder, "full.rrd");
    let script = format!(
        "trap '' XFSZ; ulimit -f 700; exec {} run --clock virtual --speed 4 \
         --duration-s 16 --record {file}",
        env!("CARGO_BIN_EXE_ratelab")
    );
    let output = Command::new("sh").args(["-c", &script]).output();
    let output = output.expect("sh starts");
    let said = complaint(&output, 1);
    assert!(
        said.contains("ended early") && said.contains("full.rrd"),
        "{said}"
    );
    assert!(
        stdout(&output).contains("BALANCED"),
        "the run ended with it"
    );
    let output = run(&["info", &file]);
    assert!(complaint(&output, 2).contains("good up to"), "{output:?}");
}

#[test]
fn a_real_clock_recording_says_why_it_is_not_verified() {
    let folder = folder();
    let file = path(&folder, "real.rrd");
    assert!(
        run(&["run", "--duration-s", "0.5", "--record", &file])
            .status
            .success()
    );
    let said = complaint(&run(&["verify", &file]), 1);
    assert!(
        said.contains("real clock") && said.contains("nothing to verify"),
        "{said}"
    );
    assert!(run(&["info", &file]).status.success());
}

#[test]
fn all_of_several_recordings_are_verified_whatever_the_first_says() {
    let folder = folder();
    let good = record(&folder, "good.rrd", &["--break"]);
    let bad = path(&folder, "bad.rrd");
    fs::write(&bad, "").expect("written");
    let output = run(&["verify", &bad, &good]);
    assert!(
        stdout(&output).contains("good.rrd: identical"),
        "{output:?}"
    );
    let said = String::from_utf8(output.stderr.clone()).expect("UTF-8");
    assert!(
        said.contains("bad.rrd: ") && said.contains("1 of 2"),
        "{said}"
    );
    assert_eq!(output.status.code(), Some(1));
}

/// A folder with a command `rerun` that answers `version` when it is asked, and
/// otherwise notes what it is given in `given`.
#[cfg(unix)]
fn viewer(folder: &TempDir, version: &str) -> PathBuf {
    use std::os::unix::fs::PermissionsExt;
    let bin = folder.path().join("bin");
    fs::create_dir_all(&bin).expect("a folder");
    let given = folder.path().join("given");
    let script = format!(
        "#!/bin/sh\nif [ \"$1\" = --version ]; then echo '{version}'; else echo \"$@\" > {}; fi\n",
        given.display()
    );
    let command = bin.join("rerun");
    fs::write(&command, script).expect("written");
    fs::set_permissions(&command, fs::Permissions::from_mode(0o755)).expect("executable");
    bin
}

#[cfg(unix)]
#[test]
fn replay_opens_the_viewer_and_says_how_to_get_it() {
    let folder = folder();
    let file = reference("fall-5hz.rrd");
    let replay = |path: &Path| {
        let path = std::env::join_paths([path, Path::new("/bin"), Path::new("/usr/bin")]);
        let path = path.expect("a search path");
        ratelab()
            .env("PATH", path)
            .args(["replay", &file])
            .output()
            .expect("ratelab starts")
    };
    let bin = viewer(&folder, "rerun-cli 0.36.3 [rustc 1.92.0]");
    let output = replay(&bin);
    assert!(
        output.status.success() && output.stderr.is_empty(),
        "{output:?}"
    );
    let given = fs::read_to_string(folder.path().join("given")).expect("opened");
    assert_eq!(given.trim(), file);
    // One of another version is opened too, with a word about it.
    let output = replay(&viewer(&folder, "rerun-cli 0.30.0"));
    let said = complaint(&output, 0);
    assert!(
        said.contains("0.30.0") && said.contains("pip install rerun-sdk==0.36.3"),
        "{said}"
    );
    let said = complaint(&replay(&viewer(&folder, "usage: something else")), 1);
    assert!(said.contains("not the rerun viewer"), "{said}");
    fs::remove_dir_all(bin).expect("removed");
    let said = complaint(&replay(folder.path()), 1);
    assert!(
        said.contains("was not found") && said.contains("pip install"),
        "{said}"
    );
}

#[test]
fn replay_in_a_terminal_needs_one() {
    let output = run(&["replay", "--terminal", &reference("fall-5hz.rrd")]);
    assert!(
        complaint(&output, 2).contains("try ratelab info"),
        "{output:?}"
    );
}

#[test]
fn a_run_that_swaps_brains_is_verified_and_a_brain_that_changed_is_named() {
    let folder = folder();
    let fixture = |name: &str| {
        let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/brains");
        tests.join(name)
    };
    let brain = path(&folder, "actor.pt");
    fs::copy(fixture("actor.pt"), &brain).expect("copied");
    let knobs = path(&folder, "swaps.knobs");
    let swaps = format!("0.5 policy lqr\n1 policy {brain}\n1.1 policy scripted\n");
    fs::write(&knobs, swaps).expect("written");
    let file = record(&folder, "swaps.rrd", &["--knobs", &knobs]);
    let output = run(&["verify", &file]);
    assert!(stdout(&output).contains("identical"), "{output:?}");
    fs::copy(fixture("half.pt"), &brain).expect("copied");
    let said = complaint(&run(&["verify", &file]), 1);
    assert!(
        said.contains("actor.pt") && said.contains("SHA-256"),
        "{said}"
    );
    fs::remove_file(&brain).expect("removed");
    let said = complaint(&run(&["verify", &file]), 1);
    assert!(
        said.contains("actor.pt") && said.contains("found neither"),
        "{said}"
    );
}
