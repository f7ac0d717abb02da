//! Files written by the command: existing files stay until all outputs are known to be
//! possible, and a result has its name when it is complete.

use std::{
    fs,
    io::{self, BufRead, BufReader, Read},
    process::{Child, ChildStderr, Stdio},
    thread,
    time::{Duration, Instant},
};

use crate::support::{Folder, Said, error_line, send, table::rows};

/// A command that writes to the folder `out` and waits for the reader of its rows.
fn waiting(folder: &Folder, command: &str) -> Child {
    folder.plays("mkfifo pipe");
    let mut command = folder.command(&format!("{command} --out out --csv pipe"));
    let child = command.stderr(Stdio::null()).spawn();
    // An unfinished file shows that the handler is installed.
    while !folder.path("out").is_dir() || folder.names("out").is_empty() {
        thread::yield_now();
    }
    child.expect("ratelab starts")
}

#[test]
fn one_signal_ends_the_wait_for_the_reader_of_a_pipe() {
    for command in ["run --smoke", "sweep --seeds 0 --control-hz 5"] {
        let folder = Folder::new();
        let mut child = waiting(&folder, command);
        send("-TERM", child.id());
        let code = child.wait().expect("ended").code();
        assert_eq!(code, Some(143), "{command}");
        assert_eq!(folder.names(""), ["pipe"]);
    }
}

/// Whatever it is at when the signal comes: it may not have come to the pipe yet.
#[test]
#[cfg(target_os = "linux")]
fn a_signal_ends_every_command_that_waits_for_a_reader_with_a_line() {
    for [line] in rows(
        "picture fall-5hz.rrd --output pipe
         trace fall-5hz.rrd --output pipe
         export-web fall-5hz.rrd --output pipe
         check robot.toml --junit pipe
         run --smoke --csv pipe
         exercise check 6c",
    ) {
        let folder = Folder::with(&["recordings/fall-5hz.rrd", "graphs/robot.toml"]);
        folder.plays("mkfifo pipe");
        let mut command = folder.command(&line);
        let child = command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let child = child.spawn().expect("ratelab starts");
        crate::support::wait_for_handlers(child.id());
        send("-TERM", child.id());
        let output = child.wait_with_output().expect("ended");
        error_line(&line, &output, 143);
        let names = folder.names("");
        assert!(!names.iter().any(|name| name.ends_with("tmp")), "{names:?}");
    }
}

#[test]
fn any_number_of_signals_leaves_no_unfinished_files() {
    let folder = Folder::new();
    let mut child = waiting(&folder, "run --smoke");
    while child.try_wait().expect("a child").is_none() {
        send("-INT", child.id());
        thread::yield_now();
    }
    assert_eq!(child.wait().expect("ended").code(), Some(130));
    assert!(!folder.path("out").exists() || folder.names("out").is_empty());
}

#[test]
fn any_number_of_signals_leaves_the_curves_of_a_sweep_whole_or_not_at_all() {
    let folder = Folder::new();
    let line = "sweep --control-hz 5 --seeds 0..99999 --record curves.rrd --out out";
    let mut command = folder.command(line);
    let command = command.stdout(Stdio::null()).stderr(Stdio::null());
    let mut child = command.spawn().expect("ratelab starts");
    while !folder.path("curves.rrd").exists() {
        thread::yield_now();
    }
    while child.try_wait().expect("a child").is_none() {
        send("-INT", child.id());
        thread::yield_now();
    }
    assert_eq!(child.wait().expect("ended").code(), Some(130));
    if folder.path("curves.rrd").exists() {
        let (said, _) = folder.fails("info curves.rrd", 2);
        said.has("curves of a sweep");
    } else {
        // What comes before the curves may be complete.
        let names = folder.names("");
        assert!(
            names.is_empty() || folder.names("out") == ["sweep.json"],
            "{names:?}"
        );
    }
}

/// As a closing terminal and its shell send them, on a machine so busy that the program stands still
/// for a while.
#[test]
fn two_signals_at_once_leave_a_recording_that_is_whole_or_told() {
    let folder = Folder::new();
    let line = "run --clock virtual --duration-s 1000000 --record run.rrd";
    let mut command = folder.command(line);
    let command = command.stdout(Stdio::null()).stderr(Stdio::piped());
    let child = command.spawn().expect("ratelab starts");
    let size = || fs::metadata(folder.path("run.rrd")).map_or(0, |file| file.len());
    while size() < 2_000_000 {
        thread::yield_now();
    }
    for signal in ["-HUP", "-TERM", "-STOP"] {
        send(signal, child.id());
    }
    let stopped = Instant::now();
    while stopped.elapsed() < Duration::from_millis(1200) {
        thread::yield_now();
    }
    send("-CONT", child.id());
    let output = child.wait_with_output().expect("ended");
    assert_eq!(output.status.code(), Some(143));
    let said = Said::new(&output.stderr);
    if said.contains("before the recording was complete") {
        // A run at full speed may be cut off before anything of it is in the file.
        let info = folder.does("info run.rrd");
        // Cut off between two chunks, or within one.
        if let Some(0 | 1) = info.status.code() {
            Said::new(&info.stdout).has("as far as the file is good");
        } else {
            assert_eq!(info.status.code(), Some(2));
            Said::new(&info.stderr).has("nothing in this recording is whole");
        }
    } else {
        folder.says("verify run.rrd").has("identical");
    }
}

/// Starts a long run that writes to the folder `out`; returns its rows.
fn long_run(folder: &Folder) -> (Child, ChildStderr) {
    let mut run = folder.command("run --duration-s 3600 --csv /dev/stderr --out out");
    let run = run.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = run.spawn().expect("ratelab starts");
    let mut rows = child.stderr.take().expect("piped");
    assert!(rows.read(&mut [0; 200]).expect("rows") > 0);
    (child, rows)
}

/// Sends `signal` to a long run, which ends with its summary and this status.
fn end((child, mut rows): (Child, ChildStderr), signal: &str, code: i32) {
    send(signal, child.id());
    io::copy(&mut rows, &mut io::sink()).expect("rows");
    let output = child.wait_with_output().expect("ended");
    assert_eq!(output.status.code(), Some(code), "{signal}");
    Said::new(&output.stdout).has("STOPPED");
}

#[test]
fn every_signal_ends_a_run_in_order_with_its_number() {
    for (signal, code) in [("-INT", 130), ("-TERM", 143), ("-HUP", 129)] {
        let folder = Folder::new();
        end(long_run(&folder), signal, code);
        assert_eq!(folder.names("out"), ["metrics.json"]);
    }
}

#[test]
fn a_signal_that_was_ignored_at_the_start_stays_ignored() {
    let folder = Folder::new();
    let line = "trap '' HUP INT; exec ratelab run --duration-s 3600 --csv /dev/stderr --out out";
    let mut run = crate::support::shell(&folder.path(""), line);
    let run = run.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = run.spawn().expect("ratelab starts");
    let mut rows = BufReader::new(child.stderr.take().expect("piped"));
    let mut more = |count| {
        let came = (0..count).filter(|_| rows.read_line(&mut String::new()).expect("rows") > 0);
        assert_eq!(came.count(), count, "the run has ended");
    };
    more(2);
    send("-HUP", child.id());
    send("-INT", child.id());
    more(100);
    end((child, rows.into_inner()), "-TERM", 143);
}

#[test]
fn a_signal_ends_the_runs_at_other_phases_and_prints_what_is_done() {
    let folder = Folder::new();
    let line = "run --clock virtual --duration-s 1000 --phases 1000 --csv /dev/stderr";
    let mut run = folder.command(line);
    let run = run.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = run.spawn().expect("ratelab starts");
    let mut rows = BufReader::new(child.stderr.take().expect("piped"));
    // Behind the header and all steps come the phases.
    for _ in 0..=50_000 {
        rows.read_line(&mut String::new()).expect("rows");
    }
    send("-TERM", child.id());
    let mut said = String::new();
    rows.read_to_string(&mut said).expect("an error");
    Said(said).has("of 1000 runs at other phases: the result is of these");
    let output = child.wait_with_output().expect("ended");
    assert_eq!(output.status.code(), Some(143));
    Said::new(&output.stdout).has("BALANCED").has("by seed 0");
}

#[test]
fn leftovers_of_a_killed_run_are_removed_and_files_in_use_are_kept() {
    let folder = Folder::new();
    let (mut killed, _rows) = long_run(&folder);
    let living = long_run(&folder);
    assert_eq!(folder.names("out").len(), 2);
    killed.kill().expect("killed");
    killed.wait().expect("ended");
    folder.says("run --smoke --out out");
    let left = folder.names("out");
    assert_eq!(left.len(), 2, "{left:?}");
    assert!(left[0].ends_with(".ratelab-tmp"), "{left:?}");
    end(living, "-TERM", 143);
    assert_eq!(folder.names("out"), ["metrics.json"]);
}

#[test]
fn no_path_or_name_has_an_effect_on_the_terminal_and_runs_with_such_a_policy_verify() {
    let folder = Folder::with(&["tests/fixtures/policies/actor.pt"]);
    let evil = "a\u{1b}]0;PWN\u{7}\nverdict   KEPT\u{9b}2J\u{202e}\u{1b}[8m";
    fs::copy(folder.path("actor.pt"), folder.path(&format!("{evil}.pt"))).expect("copied");
    for [succeeds, line] in rows(
        "true | run --clock virtual --duration-s 0.5 --policy '@.pt' --record '@.rrd' --csv '@.csv'
         true | info '@.rrd'
         true | verify '@.rrd'
         true | branch '@.rrd' --at 0.2 --knob 'control-hz 20'
         true | export-web '@.rrd' --output '@.html'
         true | trace '@.rrd' --output '@.pftrace'
         true | export '@.rrd' --output '@.mcap'
         true | sweep --seeds 0 --duration-s 0.1 --knob 'send policy @.pt'
         true | sweep --seeds 0 --duration-s 0.1 --policy 'scripted,@.pt' --csv /dev/stdout
         true | exercise 1 --answers a.toml --predict '7 because @ it is so'
         true | exercise 1 --answers a.toml
         false | exercise 1 --answers a.toml --predict '8 because @'
         false | info '@.pt'
         false | verify '@.html'
         false | run --policy '@.ptx'",
    ) {
        let output = folder.does(&line.replace('@', evil));
        let success = output.status.success().to_string();
        assert_eq!(success, succeeds, "{line}: {output:?}");
        let printed = [&output.stdout, &output.stderr].map(|bytes| Said::new(bytes).0);
        let printed = Said(printed.concat());
        assert!(!printed.is_empty(), "{line}");
        let raw = printed.chars().find(|c| c.is_control() && *c != '\n');
        assert_eq!(raw, None, "{line}: {printed:?}");
        printed.lacks("\u{202e}");
        let mut lines = printed.lines();
        let forged = lines.any(|line| line.starts_with("verdict   KEPT"));
        assert!(!forged, "{line}: {printed:?}");
    }
}
