//! Recordings, as used on the command line: recorded, described, torn and refused.

use std::{
    fs,
    process::Stdio,
    thread,
    time::{Duration, Instant},
};

use crate::support::Folder;

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
fn a_killed_run_loses_at_most_the_last_second_of_its_recording_and_the_rest_is_shown() {
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
    // What is whole is shown.
    for (command, shown) in [("info", "clock"), ("verify", "identical, 3 topics")] {
        let (said, printed) = folder.fails(&format!("{command} killed.rrd"), 1);
        said.has("this file is good up to");
        printed.has(shown);
    }
}
