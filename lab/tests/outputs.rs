//! Files written by the command: existing files stay until all outputs are known to be
//! possible, and a result has its name when it is complete.
#![cfg(unix)]

mod support;

use std::{
    fs,
    io::{self, Read},
    os::unix::fs::{FileTypeExt, PermissionsExt, symlink},
    process::{Child, ChildStderr, Command, Stdio},
    thread,
};

use support::{Folder, RATELAB, Said, User, error_line, send};

/// The commands with `--csv`, `--out` and `--record`, kept short.
const COMMANDS: [&str; 2] = [
    "run --clock virtual --duration-s 0.1",
    "sweep --seeds 0 --control-hz 5 --duration-s 0.1",
];

/// Rows of `command`, in the file `name`.
fn rows(command: &str, folder: &Folder, name: &str) -> String {
    folder.says(&format!("{command} --csv {name}"));
    folder.read(name)
}

#[test]
fn a_refused_command_changes_and_creates_no_file() {
    for command in COMMANDS {
        let folder = Folder::new();
        let before = rows(command, &folder, "old.csv");
        folder.write("taken.rrd", "mine");
        folder.refuses_each(
            command,
            "--csv old.csv --record taken.rrd --out a/b/out | taken.rrd: there is such a file
             --csv new.csv --record taken.rrd --out a/b/out | taken.rrd: there is such a file
             --csv no/such/folder/new.csv --out a/b/out     | there is no such folder",
        );
        assert_eq!(folder.names(""), ["old.csv", "taken.rrd"]);
        assert_eq!(folder.read("old.csv"), before);
    }
}

#[test]
fn two_outputs_never_share_a_file() {
    for (command, metrics) in COMMANDS.into_iter().zip(["metrics.json", "sweep.json"]) {
        let folder = Folder::new();
        symlink(format!("out/{metrics}"), folder.path("link")).expect("linked");
        folder.refuses_each(
            command,
            &format!(
                "--csv x --record ./x          | the file that --csv writes
                 --out out --csv out/{metrics} | the file that --out writes
                 --out out --csv link          | link"
            ),
        );
        assert_eq!(folder.names(""), ["link"]);
    }
}

#[test]
fn an_output_never_replaces_an_input() {
    let folder = Folder::with(&["tests/fixtures/policies/actor.pt"]);
    folder.write("knobs", "0.05 control-hz 10\n");
    symlink("knobs", folder.path("link")).expect("linked");
    folder.refuses_each(
        COMMANDS[0],
        "--knobs knobs --csv knobs | the file that --knobs reads
         --knobs knobs --csv link  | the file that --knobs reads",
    );
    for command in COMMANDS {
        let said = folder.refuses(&format!("{command} --policy actor.pt --csv actor.pt"));
        said.has("the file that --policy reads");
    }
    assert_eq!(folder.read("knobs"), "0.05 control-hz 10\n");
}

#[test]
fn rows_replace_rows_and_nothing_else() {
    for command in COMMANDS {
        let folder = Folder::new();
        let first = rows(command, &folder, "rows.csv");
        assert_eq!(rows(command, &folder, "rows.csv"), first);
        folder.write("empty", "");
        assert_eq!(rows(command, &folder, "empty"), first);
        folder.write("keep.rrd", "RRF2 and more");
        let said = folder.refuses(&format!("{command} --csv keep.rrd"));
        said.has("it is no CSV of this command");
        assert_eq!(folder.read("keep.rrd"), "RRF2 and more");
    }
}

#[test]
fn drawings_pages_and_traces_replace_their_kind_and_nothing_else() {
    let folder = Folder::with(&["recordings/fall-5hz.rrd"]);
    let sweep = format!("{} --svg", COMMANDS[1]);
    for (kind, command) in [
        ("SVG", &*sweep),
        ("SVG", "picture fall-5hz.rrd --output"),
        ("page", "export-web fall-5hz.rrd --output"),
        ("trace", "trace fall-5hz.rrd --output"),
    ] {
        for _ in 0..2 {
            folder.says(&format!("{command} {kind}"));
        }
        folder.write("robot.toml", "[nodes.camera]\n");
        let said = folder.refuses(&format!("{command} robot.toml"));
        said.has(&format!("it is no {kind} of this command"));
        assert_eq!(folder.read("robot.toml"), "[nodes.camera]\n");
    }
}

#[test]
fn rows_go_through_links_and_keep_the_permissions_of_their_file() {
    let folder = Folder::new();
    fs::create_dir(folder.path("far")).expect("made");
    symlink("far/rows.csv", folder.path("link")).expect("linked");
    let file = folder.path("far/rows.csv");
    for _ in 0..3 {
        rows(COMMANDS[0], &folder, "link");
        assert!(folder.path("link").is_symlink());
        assert_eq!(folder.names("far"), ["rows.csv"]);
        fs::set_permissions(&file, fs::Permissions::from_mode(0o604)).expect("set");
    }
    rows(COMMANDS[0], &folder, "link");
    let about = file.metadata().expect("there");
    assert_eq!(about.permissions().mode() & 0o777, 0o604);
}

#[test]
fn rows_come_before_the_summary_where_both_go_to_one_file() {
    let folder = Folder::new();
    let both = fs::File::create(folder.path("both")).expect("made");
    let mut run = folder.command(&format!("{} --csv /dev/stdout", COMMANDS[0]));
    let status = run.stdout(both).status();
    assert!(status.expect("ratelab starts").success());
    let said = Said(folder.read("both"));
    assert!(said.starts_with("step,time_s,"), "{said:?}");
    said.has("\nclock     virtual");
    let rows = said.lines().filter(|line| line.contains(','));
    assert_eq!(rows.count(), 9, "{said:?}");
}

#[test]
fn results_go_into_a_pipe_with_a_name_and_leave_it_in_place() {
    let [run, sweep] = COMMANDS;
    for (command, beginning) in [
        (&*format!("{run} --csv pipe"), "step,time_s,"),
        (&*format!("{sweep} --csv pipe"), "policy,"),
        (&*format!("{sweep} --svg pipe"), "<svg "),
        ("picture fall-5hz.rrd --output pipe", "<svg "),
        ("export-web fall-5hz.rrd --output pipe", "<!DOCTYPE html>"),
        ("trace fall-5hz.rrd --output pipe", "\n"),
        ("grade hand-ins --csv pipe", "learner,"),
    ] {
        let folder = Folder::with(&["recordings/fall-5hz.rrd"]);
        fs::create_dir_all(folder.path("hand-ins/nobody")).expect("made");
        folder.make_pipe("pipe");
        let mut reader = Command::new("cat");
        let reader = reader.arg(folder.path("pipe")).stdout(Stdio::piped());
        let reader = reader.spawn().expect("cat");
        let output = folder.does(command);
        let read = reader.wait_with_output().expect("cat");
        let begins = read.stdout.starts_with(beginning.as_bytes());
        assert!(read.status.success() && begins, "{command}: {output:?}");
        let about = folder.path("pipe").metadata().expect("there");
        assert!(about.file_type().is_fifo(), "{command}");
    }
}

/// A command that writes to the folder `out` and waits for the reader of its rows.
fn waiting(folder: &Folder, command: &str) -> Child {
    folder.make_pipe("pipe");
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
    for command in COMMANDS {
        let folder = Folder::new();
        let mut child = waiting(&folder, command);
        send("-TERM", child.id());
        let code = child.wait().expect("ended").code();
        assert_eq!(code, Some(143), "{command}");
        assert_eq!(folder.names(""), ["pipe"]);
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
    Said::of(&output.stdout).has("STOPPED");
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
fn a_limit_on_the_size_of_files_is_an_error_like_a_full_disk() {
    let folder = Folder::new();
    let line = format!("ulimit -f 1; '{RATELAB}' run --clock virtual --csv rows.csv");
    let said = error_line(&line, &folder.shell(&line), 1);
    said.has("cannot write").has("rows.csv");
    assert!(folder.names("").is_empty(), "nothing is half-written");
}

#[test]
fn no_path_or_name_has_an_effect_on_the_terminal_and_runs_with_such_a_policy_verify() {
    let folder = Folder::with(&["tests/fixtures/policies/actor.pt"]);
    let evil = "a\u{1b}]0;PWN\u{7}\nverdict   KEPT\u{9b}2J\u{202e}";
    fs::copy(folder.path("actor.pt"), folder.path(&format!("{evil}.pt"))).expect("copied");
    for (line, succeeds) in [
        (
            "run --clock virtual --duration-s 0.5 --policy '@.pt' --record '@.rrd' --csv '@.csv'",
            true,
        ),
        ("info '@.rrd'", true),
        ("verify '@.rrd'", true),
        ("branch '@.rrd' --at 0.2 --knob 'control-hz 20'", true),
        ("export-web '@.rrd' --output '@.html'", true),
        ("trace '@.rrd' --output '@.pftrace'", true),
        (
            "sweep --seeds 0 --duration-s 0.1 --knob 'send policy @.pt'",
            true,
        ),
        ("info '@.pt'", false),
        ("verify '@.html'", false),
        ("run --policy '@.ptx'", false),
    ] {
        let output = folder.does(&line.replace('@', evil));
        assert_eq!(output.status.success(), succeeds, "{line}: {output:?}");
        let printed = [&output.stdout, &output.stderr].map(|bytes| Said::of(bytes).0);
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
