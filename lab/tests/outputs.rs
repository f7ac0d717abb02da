//! Files written by the command: existing files stay until all outputs are known to be
//! possible, and a result has its name when it is complete.
#![cfg(unix)]

mod support;

use std::{
    fs,
    io::Read,
    os::unix::fs::symlink,
    path::Path,
    process::{Child, ChildStderr, Command, Stdio},
};

use support::{command, complaint, folder, path, ratelab, text};
use tempfile::TempDir;

/// The commands with `--csv`, `--out` and `--record`, kept short.
const COMMANDS: [&[&str]; 2] = [
    &["run", "--clock", "virtual", "--duration-s", "0.1"],
    &[
        "sweep",
        "--seeds",
        "0",
        "--control-hz",
        "5",
        "--duration-s",
        "0.1",
    ],
];

/// Names in `folder`, sorted.
fn names(folder: &Path) -> Vec<String> {
    let entries = folder.read_dir().expect("a folder");
    let names = entries.map(|entry| entry.expect("an entry").file_name());
    let mut names: Vec<_> = names.map(|name| name.to_string_lossy().into()).collect();
    names.sort();
    names
}

/// The error line for `args`, which must be bad input.
fn refusal(args: &[&str]) -> String {
    let output = ratelab(args);
    assert!(output.stdout.is_empty(), "{args:?} printed a result");
    complaint(&output, 2)
}

/// Rows of `command`, in the file `name`.
fn rows(command: &[&str], folder: &TempDir, name: &str) -> String {
    let csv = path(folder, name);
    let output = ratelab(&[command, &["--csv", &csv]].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    fs::read_to_string(csv).expect("rows")
}

#[test]
fn a_refused_command_changes_and_creates_no_file() {
    for command in COMMANDS {
        let folder = folder();
        let [old, new, taken, out] =
            ["old.csv", "new.csv", "taken.rrd", "a/b/out"].map(|name| path(&folder, name));
        let before = rows(command, &folder, "old.csv");
        fs::write(&taken, "mine").expect("written");
        for csv in [&old, &new] {
            let said =
                refusal(&[command, &["--csv", csv, "--record", &taken, "--out", &out]].concat());
            assert!(said.contains("taken.rrd: there is such a file"), "{said}");
            assert_eq!(names(folder.path()), ["old.csv", "taken.rrd"]);
        }
        assert_eq!(fs::read_to_string(&old).expect("rows"), before);
    }
}

#[test]
fn two_outputs_never_share_a_file() {
    for (command, metrics) in COMMANDS.into_iter().zip(["metrics.json", "sweep.json"]) {
        let folder = folder();
        let [x, also_x, out] = ["x", "./x", "out"].map(|name| path(&folder, name));
        let said = refusal(&[command, &["--csv", &x, "--record", &also_x]].concat());
        assert!(said.contains("the file that --csv writes"), "{said}");
        let inside = format!("{out}/{metrics}");
        let said = refusal(&[command, &["--out", &out, "--csv", &inside]].concat());
        assert!(said.contains("the file that --out writes"), "{said}");
        symlink(&inside, path(&folder, "link")).expect("linked");
        let link = path(&folder, "link");
        refusal(&[command, &["--out", &out, "--csv", &link]].concat());
        assert_eq!(names(folder.path()), ["link"]);
    }
}

#[test]
fn an_output_never_replaces_an_input() {
    let folder = folder();
    let [knobs, link, policy] = ["knobs", "link", "policy.pt"].map(|name| path(&folder, name));
    fs::write(&knobs, "0.05 control-hz 10\n").expect("written");
    symlink("knobs", &link).expect("linked");
    fs::copy("../tests/fixtures/policies/actor.pt", &policy).expect("copied");
    for csv in [&knobs, &link] {
        let said = refusal(&[COMMANDS[0], &["--knobs", &knobs, "--csv", csv]].concat());
        assert!(said.contains("the file that --knobs reads"), "{said}");
    }
    for command in COMMANDS {
        let said = refusal(&[command, &["--policy", &policy, "--csv", &policy]].concat());
        assert!(said.contains("the file that --policy reads"), "{said}");
    }
    let kept = fs::read_to_string(&knobs).expect("knobs");
    assert_eq!(kept, "0.05 control-hz 10\n");
}

#[test]
fn rows_replace_rows_and_nothing_else() {
    for command in COMMANDS {
        let folder = folder();
        let first = rows(command, &folder, "rows.csv");
        assert_eq!(rows(command, &folder, "rows.csv"), first);
        fs::write(folder.path().join("empty"), "").expect("written");
        assert_eq!(rows(command, &folder, "empty"), first);
        fs::write(folder.path().join("keep.rrd"), "RRF2 and more").expect("written");
        let keep = path(&folder, "keep.rrd");
        let said = refusal(&[command, &["--csv", &keep]].concat());
        assert!(said.contains("it is no CSV of this command"), "{said}");
        assert_eq!(fs::read_to_string(&keep).expect("kept"), "RRF2 and more");
    }
}

#[test]
fn drawings_pages_and_traces_replace_their_kind_and_nothing_else() {
    let folder = folder();
    let recording = "../recordings/fall-5hz.rrd";
    let drawing = [COMMANDS[1], &["--svg"]].concat();
    for (kind, command) in [
        ("SVG", &drawing[..]),
        ("SVG", &["picture", recording, "--output"]),
        ("page", &["export-web", recording, "--output"]),
        ("trace", &["trace", recording, "--output"]),
    ] {
        let result = path(&folder, kind);
        for _ in 0..2 {
            let made = ratelab(&[command, &[&result]].concat());
            assert!(made.status.success(), "{}", text(&made.stderr));
        }
        let keep = path(&folder, "robot.toml");
        fs::write(&keep, "[nodes.camera]\n").expect("written");
        let said = refusal(&[command, &[&keep]].concat());
        assert!(
            said.contains(&format!("it is no {kind} of this command")),
            "{said}"
        );
        assert_eq!(fs::read_to_string(&keep).expect("kept"), "[nodes.camera]\n");
    }
}

#[test]
fn rows_go_through_links_and_keep_the_permissions_of_their_file() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder();
    fs::create_dir(folder.path().join("far")).expect("made");
    symlink("far/rows.csv", folder.path().join("link")).expect("linked");
    for _ in 0..2 {
        rows(COMMANDS[0], &folder, "link");
        assert!(folder.path().join("link").is_symlink());
        assert_eq!(names(&folder.path().join("far")), ["rows.csv"]);
        let file = folder.path().join("far/rows.csv");
        fs::set_permissions(&file, fs::Permissions::from_mode(0o604)).expect("set");
    }
    rows(COMMANDS[0], &folder, "link");
    let about = folder.path().join("far/rows.csv").metadata();
    assert_eq!(about.expect("there").permissions().mode() & 0o777, 0o604);
}

#[test]
fn rows_come_before_the_summary_where_both_go_to_one_file() {
    let folder = folder();
    let both = fs::File::create(folder.path().join("both")).expect("made");
    let args = [COMMANDS[0], &["--csv", "/dev/stdout"]].concat();
    let status = command().args(args).stdout(both).status();
    assert!(status.expect("ratelab starts").success());
    let said = fs::read_to_string(folder.path().join("both")).expect("text");
    assert!(said.starts_with("step,time_s,"), "{said}");
    assert!(said.contains("\nclock     virtual"), "{said}");
    assert_eq!(
        said.lines().filter(|line| line.contains(',')).count(),
        9,
        "{said}"
    );
}

/// Creates a pipe with a name.
fn make_pipe(path: &str) {
    let made = Command::new("mkfifo").arg(path).status();
    assert!(made.expect("mkfifo").success());
}

#[test]
fn results_go_into_a_pipe_with_a_name_and_leave_it_in_place() {
    use std::os::unix::fs::FileTypeExt;
    let recording = "../recordings/fall-5hz.rrd";
    let [run, sweep] = COMMANDS;
    for (command, beginning) in [
        (&[run, &["--csv"]].concat()[..], "step,time_s,"),
        (&[sweep, &["--csv"]].concat(), "policy,"),
        (&[sweep, &["--svg"]].concat(), "<svg "),
        (&["picture", recording, "--output"], "<svg "),
        (&["export-web", recording, "--output"], "<!DOCTYPE html>"),
        (&["trace", recording, "--output"], "\n"),
        (&["grade", "--csv"], "learner,"),
    ] {
        let folder = folder();
        let pipe = path(&folder, "pipe");
        make_pipe(&pipe);
        let mut reader = Command::new("cat")
            .arg(&pipe)
            .stdout(Stdio::piped())
            .spawn()
            .expect("cat");
        let hand_ins = path(&folder, "hand-ins");
        fs::create_dir_all(Path::new(&hand_ins).join("nobody")).expect("made");
        let graded = [&pipe, &*hand_ins];
        let files = if command[0] == "grade" {
            &graded[..]
        } else {
            &graded[..1]
        };
        let output = ratelab(&[command, files].concat());
        let mut content = Vec::new();
        let mut piped = reader.stdout.take().expect("piped");
        piped.read_to_end(&mut content).expect("content");
        assert!(reader.wait().expect("cat").success());
        let said = text(&output.stderr);
        assert!(
            content.starts_with(beginning.as_bytes()),
            "{command:?}: {said}"
        );
        let about = Path::new(&pipe).metadata().expect("there");
        assert!(about.file_type().is_fifo(), "{command:?}");
    }
}

#[test]
fn one_signal_ends_the_wait_for_the_reader_of_a_pipe() {
    for command in COMMANDS {
        let folder = folder();
        let [out, pipe] = ["out", "pipe"].map(|name| path(&folder, name));
        make_pipe(&pipe);
        let args = [command, &["--out", &out, "--csv", &pipe]].concat();
        let mut child = command_of(&args).spawn().expect("ratelab starts");
        // An unfinished file shows that the handler is installed.
        while !Path::new(&out).is_dir() || names(Path::new(&out)).is_empty() {
            std::thread::yield_now();
        }
        send("-TERM", &child);
        assert_eq!(
            child.wait().expect("ended").code(),
            Some(143),
            "{command:?}"
        );
        assert_eq!(names(folder.path()), ["pipe"]);
    }
}

/// The command with `args`, without output.
fn command_of(args: &[&str]) -> Command {
    let mut command = command();
    command.args(args).stderr(Stdio::null());
    command
}

/// Sends a signal and checks that it was delivered.
fn send(signal: &str, child: &Child) {
    let pid = child.id().to_string();
    let kill = Command::new("kill").args([signal, &pid]).status();
    assert!(kill.expect("kill").success());
}

/// Starts a long run that writes to the folder `out`; returns its rows.
fn long_run(out: &str) -> (Child, ChildStderr) {
    let mut child = command()
        .args([
            "run",
            "--duration-s",
            "3600",
            "--csv",
            "/dev/stderr",
            "--out",
            out,
        ])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("ratelab starts");
    let mut rows = child.stderr.take().expect("piped");
    assert!(rows.read(&mut [0; 200]).expect("rows") > 0);
    (child, rows)
}

#[test]
fn every_signal_ends_a_run_in_order_with_its_number() {
    for (signal, code) in [("-INT", 130), ("-TERM", 143), ("-HUP", 129)] {
        let folder = folder();
        let (child, mut rows) = long_run(&path(&folder, "out"));
        send(signal, &child);
        std::io::copy(&mut rows, &mut std::io::sink()).expect("rows");
        let output = child.wait_with_output().expect("ended");
        assert_eq!(output.status.code(), Some(code), "{signal}");
        assert!(text(&output.stdout).contains("STOPPED"), "{signal}");
        assert_eq!(names(&folder.path().join("out")), ["metrics.json"]);
    }
}

#[test]
fn any_number_of_signals_leaves_no_unfinished_files() {
    let folder = folder();
    let [out, pipe] = ["out", "pipe"].map(|name| path(&folder, name));
    make_pipe(&pipe);
    let args = ["run", "--smoke", "--out", &out, "--csv", &pipe];
    let mut child = command_of(&args).spawn().expect("ratelab starts");
    while !Path::new(&out).is_dir() || names(Path::new(&out)).is_empty() {
        std::thread::yield_now();
    }
    while child.try_wait().expect("a child").is_none() {
        send("-INT", &child);
        std::thread::yield_now();
    }
    assert_eq!(child.wait().expect("ended").code(), Some(130));
    assert!(!Path::new(&out).exists() || names(Path::new(&out)).is_empty());
}

#[test]
fn leftovers_of_a_killed_run_are_removed_and_files_in_use_are_kept() {
    let folder = folder();
    let out = path(&folder, "out");
    let (mut killed, _rows) = long_run(&out);
    let (living, mut rows) = long_run(&out);
    assert_eq!(names(Path::new(&out)).len(), 2);
    killed.kill().expect("killed");
    killed.wait().expect("ended");
    let next = ratelab(&["run", "--smoke", "--out", &out]);
    assert!(next.status.success(), "{}", text(&next.stderr));
    let left = names(Path::new(&out));
    assert_eq!(left.len(), 2, "{left:?}");
    assert!(left[0].ends_with(".ratelab-tmp"), "{left:?}");
    send("-TERM", &living);
    std::io::copy(&mut rows, &mut std::io::sink()).expect("rows");
    assert_eq!(
        living.wait_with_output().expect("ended").status.code(),
        Some(143)
    );
    assert_eq!(names(Path::new(&out)), ["metrics.json"]);
}

#[test]
fn a_limit_on_the_size_of_files_is_an_error_like_a_full_disk() {
    let folder = folder();
    let csv = path(&folder, "rows.csv");
    let program = env!("CARGO_BIN_EXE_ratelab");
    let line = format!("ulimit -f 1; '{program}' run --clock virtual --csv '{csv}'");
    let output = Command::new("sh").args(["-c", &line]).output().expect("sh");
    let said = complaint(&output, 1);
    assert!(
        said.contains("cannot write") && said.contains("rows.csv"),
        "{said}"
    );
    assert!(names(folder.path()).is_empty(), "nothing is half-written");
}

#[test]
fn no_path_or_name_has_an_effect_on_the_terminal_and_runs_with_such_a_policy_verify() {
    let folder = folder();
    let evil = "a\u{1b}]0;PWN\u{7}\nverdict   KEPT\u{9b}2J\u{202e}";
    let [policy, recording, page, trace, rows] = ["pt", "rrd", "html", "pftrace", "csv"]
        .map(|ending| path(&folder, &format!("{evil}.{ending}")));
    fs::copy("../tests/fixtures/policies/actor.pt", &policy).expect("copied");
    let run = [
        "run",
        "--clock",
        "virtual",
        "--duration-s",
        "0.5",
        "--policy",
        &policy,
    ];
    let knob = format!("send policy {policy}");
    for args in [
        &[&run[..], &["--record", &recording, "--csv", &rows]].concat()[..],
        &["info", &recording],
        &["verify", &recording],
        &[
            "branch",
            &recording,
            "--at",
            "0.2",
            "--knob",
            "control-hz 20",
        ],
        &["export-web", &recording, "--output", &page],
        &["trace", &recording, "--output", &trace],
        &[
            "sweep",
            "--seeds",
            "0",
            "--duration-s",
            "0.1",
            "--knob",
            &knob,
        ],
        &["info", &policy],
        &["verify", &page],
        &["run", "--policy", &format!("{policy}x")],
    ] {
        let output = ratelab(args);
        let printed = text(&output.stdout) + &text(&output.stderr);
        assert!(!printed.is_empty());
        let raw = printed.chars().find(|c| c.is_control() && *c != '\n');
        assert_eq!(raw, None, "{args:?}: {printed}");
        assert!(!printed.contains('\u{202e}'), "{args:?}: {printed}");
        let forged = printed
            .lines()
            .any(|line| line.starts_with("verdict   KEPT"));
        assert!(!forged, "{args:?}: {printed}");
        if ["verify", "branch"].contains(&args[0]) && args[1] == recording {
            assert!(output.status.success(), "{args:?}: {printed}");
        }
    }
}
