//! Recordings, as used on the command line: recorded, described, torn and refused.

mod support;

use std::{
    fs,
    process::Stdio,
    thread,
    time::{Duration, Instant},
};

use support::{Folder, RATELAB, User, error_line};

#[test]
fn info_prints_the_summary_of_the_run() {
    let folder = Folder::new();
    folder.write("knobs", "1 control-hz 8\n2.5 queue-depth 4\n");
    let said = folder.says("run --clock virtual --seed 3 --knobs knobs --record run.rrd");
    let info = folder.says("info run.rrd");
    for line in said.lines().filter(|line| !line.starts_with("recorded")) {
        info.has(line);
    }
}

#[test]
fn info_includes_losses_after_the_last_message_of_a_topic() {
    let folder = Folder::new();
    folder.write("knobs", "1.0095 queue-depth 1\n");
    let said = folder.says(
        "run --clock virtual --duration-s 1.0095 --control-hz 1000 --queue-depth 5 \
         --knobs knobs --record run.rrd",
    );
    let topics = said.lines().find(|line| line.starts_with("topics"));
    let topics = topics.expect("a line of topics");
    assert!(topics.contains("758 dropped"), "{topics}");
    folder.says("info run.rrd").has(&format!("\n{topics}\n"));
    folder.says("verify run.rrd");
}

#[test]
fn a_recording_without_a_name_goes_to_recordings_and_overwrites_none() {
    let folder = Folder::new();
    for number in 1..=3 {
        folder.says("run --smoke --record");
        assert_eq!(folder.names("recordings").len(), number);
    }
}

#[test]
fn a_file_that_exists_is_refused_and_left_alone() {
    let folder = Folder::new();
    folder.write("mine.rrd", "mine");
    folder.refuses_each(
        "run --smoke --record",
        "mine.rrd         | overwrite none: choose another name
         /dev/null/x.rrd  | /dev/null/x.rrd",
    );
    assert_eq!(folder.read("mine.rrd"), "mine");
}

#[test]
fn recording_changes_no_figure() {
    let folder = Folder::new();
    let run = "run --clock virtual --json --control-hz 7";
    let without = folder.says(&format!("{run} --csv plain.csv"));
    let with = folder.does(&format!("{run} --csv recorded.csv --record run.rrd"));
    assert!(with.status.success(), "{with:?}");
    // The metrics alone.
    assert_eq!(support::Said::of(&with.stdout), without);
    support::Said::of(&with.stderr).has("run.rrd");
    assert_eq!(folder.read("plain.csv"), folder.read("recorded.csv"));
}

#[test]
fn an_invalid_recording_is_refused_in_one_line() {
    let folder = Folder::new();
    for content in [
        "",
        "step,time_s\n",
        "RRF2 and rubbish that goes on for a while",
    ] {
        folder.write("file.rrd", content);
        for command in ["info", "verify", "replay"] {
            folder.refuses_each(
                command,
                "file.rrd    | file.rrd | recording
                 missing.rrd | missing.rrd
                 .           | error: .",
            );
        }
    }
}

#[test]
fn the_intact_part_of_a_torn_file_is_shown() {
    let folder = Folder::with(&["recordings/rescued.rrd"]);
    let whole = folder.bytes("rescued.rrd");
    folder.write("torn.rrd", &whole[..whole.len() / 3]);
    // Its batches were combined, so none of them is complete.
    folder.refuses("info torn.rrd");
    killed(&folder);
    for (command, shown) in [("info", "clock"), ("verify", "identical, 3 topics")] {
        let (said, printed) = folder.fails(&format!("{command} killed.rrd"), 1);
        said.has("this file is good up to");
        printed.has(shown);
    }
}

/// Records `killed.rrd`, of a run at real-time speed that is killed after 2.5 s; the time since
/// its start (s).
fn killed(folder: &Folder) -> f64 {
    let file = folder.path("killed.rrd");
    let _ = fs::remove_file(&file);
    let mut run = folder.command("run --clock virtual --speed 1 --record killed.rrd");
    let mut child = run.stdout(Stdio::null()).spawn().expect("ratelab starts");
    while !file.exists() {
        thread::sleep(Duration::from_millis(1));
    }
    let began = Instant::now();
    thread::sleep(Duration::from_millis(2_500));
    child.kill().expect("killed");
    let lived = began.elapsed().as_secs_f64();
    child.wait().expect("gone");
    lived
}

#[test]
fn a_killed_run_loses_at_most_the_last_second_of_its_recording() {
    let folder = Folder::new();
    // A busy machine may delay any thread, but not every time.
    let lost = (0..5).map(|_| {
        let lived = killed(&folder);
        let (said, _) = folder.fails("info killed.rrd", 1);
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
    let folder = Folder::new();
    let script = format!(
        "trap '' XFSZ; ulimit -f 700; exec {RATELAB} run --clock virtual --speed 4 \
         --duration-s 16 --record full.rrd"
    );
    let output = folder.shell(&script);
    let said = error_line("run", &output, 1);
    said.has("ended early").has("full.rrd");
    // The run ended with its verdict.
    support::Said::of(&output.stdout).has("BALANCED");
    let (said, _) = folder.fails("info full.rrd", 1);
    said.has("good up to");
}
