//! Recordings, as used on the command line: recorded, described, torn and refused.

mod support;

use std::{
    fs,
    path::Path,
    process::{Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use tempfile::TempDir;

use support::{command, complaint, folder, path, ratelab, reference, text};

#[test]
fn info_prints_the_summary_of_the_run() {
    let folder = folder();
    let knobs = path(&folder, "knobs");
    fs::write(&knobs, "1 control-hz 8\n2.5 queue-depth 4\n").expect("written");
    let args = [
        "run", "--clock", "virtual", "--seed", "3", "--knobs", &knobs, "--record",
    ];
    let file = path(&folder, "run.rrd");
    let said = text(&ratelab(&[&args[..], &[&file]].concat()).stdout);
    let info = text(&ratelab(&["info", &file]).stdout);
    let summary = said.lines().filter(|line| !line.starts_with("recorded"));
    // Except for the wall time, which is rounded to a hundredth of a second.
    for line in summary {
        assert!(info.contains(line), "{line:?} is not in\n{info}");
    }
}

#[test]
fn info_includes_losses_after_the_last_message_of_a_topic() {
    let folder = folder();
    let (knobs, file) = (path(&folder, "knobs"), path(&folder, "run.rrd"));
    fs::write(&knobs, "1.0095 queue-depth 1\n").expect("written");
    let args = [
        "run",
        "--clock",
        "virtual",
        "--duration-s",
        "1.0095",
        "--control-hz",
        "1000",
        "--queue-depth",
        "5",
        "--knobs",
        &knobs,
        "--record",
        &file,
    ];
    let topics = |output: &str| {
        let mut lines = output.lines();
        let line = lines.find(|line| line.starts_with("topics"));
        line.expect("a line of topics").to_owned()
    };
    let said = topics(&text(&ratelab(&args).stdout));
    assert!(said.contains("758 dropped"), "{said}");
    assert_eq!(topics(&text(&ratelab(&["info", &file]).stdout)), said);
    assert!(ratelab(&["verify", &file]).status.success());
}

#[test]
fn a_recording_without_a_name_goes_to_recordings_and_overwrites_none() {
    let folder = folder();
    for _ in 0..3 {
        let output = command()
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
    let said = complaint(&ratelab(&["run", "--smoke", "--record", &file]), 2);
    assert!(
        said.contains("overwrite none: choose another name"),
        "{said}"
    );
    assert_eq!(fs::read_to_string(&file).expect("read"), "mine");
    let said = complaint(
        &ratelab(&["run", "--smoke", "--record", "/dev/null/x.rrd"]),
        2,
    );
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
    let without = ratelab(&[&args[..], &[&plain]].concat());
    let file = path(&folder, "run.rrd");
    let with = ratelab(&[&args[..], &[&csv, "--record", &file]].concat());
    assert!(with.status.success());
    assert_eq!(
        text(&without.stdout),
        text(&with.stdout),
        "stdout is the metrics alone"
    );
    let read = |path: &String| fs::read(path).expect("read");
    assert_eq!(read(&plain), read(&csv));
    assert!(String::from_utf8_lossy(&with.stderr).contains("run.rrd"));
}

#[test]
fn an_invalid_recording_is_refused_in_one_line() {
    let folder = folder();
    let file = path(&folder, "file.rrd");
    for content in [
        "",
        "step,time_s\n",
        "RRF2 and rubbish that goes on for a while",
    ] {
        fs::write(&file, content).expect("written");
        for command in [&["info", &file][..], &["verify", &file], &["replay", &file]] {
            let said = complaint(&ratelab(command), 2);
            assert!(
                said.contains("file.rrd") && said.contains("recording"),
                "{said}"
            );
        }
    }
    let missing = path(&folder, "missing.rrd");
    for target in [&missing, &folder.path().display().to_string()] {
        for command in ["info", "verify", "replay"] {
            complaint(&ratelab(&[command, target]), 2);
        }
    }
}

#[test]
fn the_intact_part_of_a_torn_file_is_shown() {
    let folder = folder();
    let file = path(&folder, "torn.rrd");
    let whole = fs::read(reference("rescued.rrd")).expect("read");
    fs::write(&file, &whole[..whole.len() / 3]).expect("written");
    // Its batches were combined, so none of them is complete.
    complaint(&ratelab(&["info", &file]), 2);
    let killed = killed(&folder);
    for command in ["info", "verify"] {
        let output = ratelab(&[command, &killed]);
        let said = complaint(&output, 1);
        assert!(said.contains("this file is good up to"), "{said}");
        assert!(!text(&output.stdout).is_empty(), "nothing was shown");
    }
    let output = ratelab(&["verify", &killed]);
    assert!(
        text(&output.stdout).contains("identical, 3 topics"),
        "{output:?}"
    );
}

/// The recording of a run at real-time speed that was killed after 2.5 s.
fn killed(folder: &TempDir) -> String {
    killed_after(folder, Duration::from_millis(2_500)).0
}

/// The recording of a run at real-time speed that was killed, and the time since its
/// start.
fn killed_after(folder: &TempDir, time: Duration) -> (String, f64) {
    let file = path(folder, "killed.rrd");
    let _ = fs::remove_file(&file);
    let args = [
        "run", "--clock", "virtual", "--speed", "1", "--record", &file,
    ];
    let mut child = command()
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
fn a_killed_run_loses_at_most_the_last_second_of_its_recording() {
    let folder = folder();
    // A busy machine may delay any thread, but not every time.
    let lost = (0..5).map(|_| {
        let (file, lived) = killed_after(&folder, Duration::from_millis(2_500));
        let said = complaint(&ratelab(&["info", &file]), 1);
        let until = said.split_once("good up to ").expect("a time").1;
        let until = until.split(' ').next().expect("a time").parse::<f64>();
        lived - until.expect("seconds")
    });
    let lost: Vec<f64> = lost.take_while(|lost| *lost > 1.0).collect();
    assert!(lost.len() < 5, "{lost:?} s were lost");
}

/// Only Unix can limit the size of files from outside.
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
        text(&output.stdout).contains("BALANCED"),
        "the run ended with it"
    );
    let output = ratelab(&["info", &file]);
    assert!(complaint(&output, 1).contains("good up to"), "{output:?}");
}
