//! Every option and argument that names a file, before every kind of file that can be there.
//!
//! The options are those of the command line's own definition, by way of its completions. Whoever
//! adds one is asked by this test what the file is for.

use std::{
    fs::{self, Permissions},
    os::unix::fs::{FileTypeExt, MetadataExt, PermissionsExt, symlink},
    path::Path,
    process::{Command, Output},
    sync::Mutex,
    thread,
};

use crate::support::{Folder, Said, shell, table::rows};

/// What is done with the file of an option.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Use {
    /// It is read.
    Read,
    /// It is written: a result, which replaces one of its kind.
    Written,
    /// It is made, and must be new.
    Made,
    /// It is read and changed.
    Kept,
    /// It is a folder to read, or there is no terminal or network here.
    Untouched,
}

/// The use of the file behind an option, or behind an argument, of a command.
fn use_of(command: &str, option: &str) -> Use {
    match (command, option) {
        ("lab" | "up" | "node", _) | ("grade", "dir") => Use::Untouched,
        (_, "--csv" | "--svg" | "--junit" | "--output" | "-o" | "--out") | ("man", _) => {
            Use::Written
        }
        (_, "--record" | "--save") | ("new", "file") => Use::Made,
        (_, "--answers") => Use::Kept,
        _ => Use::Read,
    }
}

/// A short line of each command, with `{}` where the option is, or the argument.
fn line(command: &str, given: &str) -> String {
    let is_option = given.starts_with('-');
    let recording = if is_option {
        "$CLONE/recordings/fall-5hz.rrd"
    } else {
        ""
    };
    match command {
        "run" | "sweep" | "advise" | "hunt" | "check" if !is_option => {
            format!("{command} {given} --duration-s 0.1")
        }
        "run" if given.starts_with("--like") => format!("run {given}"),
        "run" => format!("run --smoke {given}"),
        "picture" if is_option && !given.starts_with("-o") && !given.starts_with("--output") => {
            format!("picture {given}")
        }
        "sweep" => format!("sweep --seeds 0 --control-hz 5 --duration-s 0.1 {given}"),
        "advise" | "check" => format!("{command} --duration-s 0.1 {given}"),
        "hunt" => format!("hunt --control-hz 50 --duration-s 4 --hang policy=600 {given}"),
        "info" | "verify" | "trace" | "export" | "export-web" | "picture" | "replay" | "table" => {
            format!("{command} {recording} {given}")
        }
        "branch" => format!("branch {recording} --at 0.2 --knob 'control-hz 20' {given}"),
        "exercise" if given.starts_with("--session") => format!("exercise 5 {given}"),
        "exercise" => format!("exercise 2 --predict '0 because I think so' {given}"),
        "grade" if !is_option => format!("grade {given}"),
        "grade" => format!("grade class {given}"),
        "look" if is_option => format!("look $CLONE/graphs/drive.csv {given}"),
        "new" if is_option => format!("new made.toml {given}"),
        "node" => format!("node policy {given}"),
        _ => format!("{command} {given}"),
    }
}

/// What is there, behind the name of a file: and what each use of it comes to, as a status and a
/// part of what is said. `-` is the status of either success or refusal.
const EXPECTED: &str = "
    nothing   | 2             | 0           | 0           | 0
    pipe      | 2 a pipe      | 0           | 2 there is  | 2 a pipe
    zeros     | 2 a device    | 0           | 2 there is  | 2 a device
    full      | 2 a device    | 1 No space  | 2 there is  | 2 a device
    null      | 2 a device    | 0           | 2 there is  | 2 a device
    folder    | 2 a directory | 2 a folder  | 2 there is  | 2 a directory
    dangling  | 2             | 0           | 2 there is  | 0
    link      | 2             | 2 there is  | 2 there is  | 2 line 1
    foreign   | 2             | 2 there is  | 2 there is  | 2 line 1
    read-only | -             | 2 read-only | 2 there is  | 2 read-only
    private   | -             | 0           | 2 there is  | 0
    names     | -             | 0           | 2 there is  | 2 several names
    huge      | 2 bytes       | 2 there is  | 2 there is  | 2 bytes
";

/// Rows that are other ones for a reason.
const EXCEPT: &str = "
    run --record      | folder   | 0                | a recording gets a name in a folder
    branch --record   | folder   | 0                | a recording gets a name in a folder
    man folder        | folder   | 2 a folder       | the folder is in the place of a page
";

/// Puts the `kind` of file at `path`.
fn put(kind: &str, path: &Path) {
    let beside = path.with_file_name("far");
    let device = |name| symlink(Path::new("/dev").join(name), path).expect("linked");
    let empty = |mode| {
        fs::write(path, "").expect("written");
        fs::set_permissions(path, Permissions::from_mode(mode)).expect("set");
    };
    match kind {
        "nothing" => {}
        "pipe" => {
            let made = Command::new("mkfifo").arg(path).status();
            assert!(made.expect("mkfifo").success());
        }
        "zeros" => device("zero"),
        "full" => device("full"),
        "null" => device("null"),
        "folder" => fs::create_dir(path).expect("made"),
        "dangling" => symlink("far", path).expect("linked"),
        "link" => {
            fs::write(beside, "mine\n").expect("written");
            symlink("far", path).expect("linked");
        }
        "foreign" => fs::write(path, "mine\n").expect("written"),
        "read-only" => empty(0o444),
        "private" => empty(0o600),
        "names" => {
            empty(0o644);
            fs::hard_link(path, beside).expect("linked");
        }
        "huge" => {
            let file = fs::File::create(path).expect("made");
            file.set_len(20 << 30).expect("a hole");
        }
        _ => panic!("{kind}"),
    }
}

/// What is at `path`, and behind it: its kind, permissions, size, and content if that is short.
fn found(path: &Path) -> String {
    let about = fs::symlink_metadata(path);
    let target = fs::metadata(path);
    let text = target.as_ref().ok().filter(|about| about.is_file());
    let text = text
        .filter(|about| about.len() < 100)
        .map(|_| fs::read(path));
    let kind = about.map(|about| (about.file_type().is_symlink(), about.file_type().is_fifo()));
    let target = target.map(|about| (about.mode_and_size(), text));
    format!("{:?} {:?}", kind.ok(), target.ok())
}

/// Permissions and size.
trait ModeAndSize {
    fn mode_and_size(&self) -> (u32, u64);
}

impl ModeAndSize for fs::Metadata {
    fn mode_and_size(&self) -> (u32, u64) {
        // The size of a folder is that of its list.
        let size = if self.is_dir() { 0 } else { self.len() };
        (self.permissions().mode(), size)
    }
}

/// The commands with the options and arguments that name a file.
fn named() -> Vec<(String, String)> {
    let folder = Folder::new();
    let script = folder.says("completions zsh");
    let (mut command, mut named) = (None, Vec::new());
    for line in script.lines().map(str::trim) {
        let name = line
            .strip_prefix('(')
            .and_then(|line| line.strip_suffix(')'));
        match name.filter(|name| !name.contains(' ')) {
            Some("help") => break,
            Some(name) => command = Some(name.to_owned()),
            None => {}
        }
        let Some(spec) = line
            .strip_suffix(":_files' \\")
            .or(line.strip_suffix(":_files' && ret=0"))
        else {
            continue;
        };
        let spec = spec.trim_start_matches('\'');
        let spec = spec
            .split_once(')')
            .filter(|_| spec.starts_with('('))
            .map_or(spec, |(_, s)| s);
        let spec = spec.trim_start_matches('*').trim_start_matches(':');
        let name = spec.split(['=', '+', ' ']).next().expect("a name");
        named.extend(command.clone().map(|command| (command, name.to_owned())));
    }
    named
}

/// A use of one option with one kind of file.
struct Cell<'a> {
    command: &'a str,
    option: &'a str,
    kind: &'a str,
}

impl Cell<'_> {
    /// What is expected: a status and a part of what is said.
    fn expected(&self) -> String {
        let Self {
            command,
            option,
            kind,
        } = self;
        let name = format!("{command} {option}");
        let except = rows(EXCEPT).find(|[of, at, ..]: &[String; 4]| *of == name && at == kind);
        if let Some([_, _, expected, _]) = except {
            return expected;
        }
        let row = rows(EXPECTED).find(|[of, ..]: &[String; 5]| of == kind);
        let [_, read, written, made, kept] = row.expect("a kind");
        match use_of(command, option) {
            Use::Read => read,
            Use::Written => written,
            Use::Made => made,
            Use::Kept => kept,
            Use::Untouched => "2".to_owned(),
        }
    }

    /// The file that the option names, in the folder of the command.
    fn file(&self) -> &'static str {
        match (self.command, self.option) {
            ("sweep", "--out") => "out/sweep.json",
            (_, "--out") => "out/metrics.json",
            ("man", _) => "out/ratelab.1",
            ("table", "-o" | "--output") => "out/node_sensor.csv",
            (_, "graph_file") | ("new", _) => "x.toml",
            _ => "x",
        }
    }

    /// What is not as expected, if anything is.
    fn fault(&self) -> Option<String> {
        let Self {
            command,
            option,
            kind,
        } = *self;
        let folder = Folder::new();
        fs::create_dir_all(folder.path("class/nobody")).expect("made");
        let file = self.file();
        let path = folder.path(file);
        fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        put(kind, &path);
        let before = found(&path);
        let output = self.run(&folder, file);
        let after = found(&path);
        let said = [&output.stderr, &output.stdout]
            .map(|bytes| Said::new(bytes).0)
            .concat();
        let expected = self.expected();
        let (code, part) = expected.split_once(' ').unwrap_or((&expected, ""));
        let found_code = output.status.code().map_or(-1, |code| code);
        let codes: &[i32] = match code {
            "-" => &[0, 1, 2],
            "0" if command == "grade" => &[1], // Nothing is handed in.
            "0" => &[0],
            "1" => &[1],
            _ => &[2],
        };
        let refused = found_code == 2 || use_of(command, option) == Use::Read;
        let lies = [
            (!codes.contains(&found_code), "another status"),
            (!said.contains(part), "other words"),
            (refused && before != after, "it was changed"),
            (
                !path.exists() && !["nothing", "dangling"].contains(&kind),
                "it is gone",
            ),
            (left_behind(&folder), "an unfinished file was left behind"),
            (
                kind == "private" && mode(&path) != 0o600,
                "other permissions",
            ),
            (kind == "dangling" && !path.is_symlink(), "the link is gone"),
            (
                kind == "names" && names(&path) != 2,
                "its other name is of another file",
            ),
        ];
        let lies: Vec<&str> = lies
            .iter()
            .filter(|(is, _)| *is)
            .map(|(_, lie)| *lie)
            .collect();
        (!lies.is_empty()).then(|| {
            format!(
                "{command} {option}, {kind}: {}: expected {expected}, status {found_code}\n    \
                 {said}    before {before}\n    after  {after}",
                lies.join(", ")
            )
        })
    }

    fn run(&self, folder: &Folder, file: &str) -> Output {
        let value = file.strip_prefix("out/").map_or(file, |_| "out");
        let given = if self.option.starts_with('-') {
            format!("{} {value}", self.option)
        } else {
            value.to_owned()
        };
        let line = line(self.command, &given);
        // A pipe for results has a reader, which ends with the command if nothing came.
        let pipe = self.kind == "pipe" && use_of(self.command, self.option) == Use::Written;
        let line = if pipe {
            format!(
                "cat {file} > got & timeout 300 ratelab {line}; code=$?; kill $! 2> nowhere; \
                 exit $code"
            )
        } else {
            format!("timeout 300 ratelab {line}")
        };
        let root = folder.path("");
        shell(&root, &line).output().expect("sh starts")
    }
}

fn mode(path: &Path) -> u32 {
    path.metadata()
        .map_or(0, |about| about.permissions().mode() & 0o777)
}

fn names(path: &Path) -> u64 {
    path.metadata().map_or(0, |about| about.nlink())
}

/// Whether a file that was not finished is still there.
fn left_behind(folder: &Folder) -> bool {
    let in_out = folder.path("out").is_dir().then(|| folder.names("out"));
    let mut names = folder
        .names("")
        .into_iter()
        .chain(in_out.into_iter().flatten());
    names.any(|name| name.starts_with('.'))
}

#[test]
fn no_file_behind_an_option_surprises() {
    let named = named();
    for known in [
        "run --csv",
        "grade --roster",
        "exercise --answers",
        "new file",
        "lab --policy",
    ] {
        let is_it = |(command, option): &(String, String)| format!("{command} {option}") == known;
        assert!(named.iter().any(is_it), "{known} is not in {named:?}");
    }
    let kinds: Vec<String> = rows(EXPECTED).map(|[kind, ..]: [String; 5]| kind).collect();
    let cells = named.iter().flat_map(|(command, option)| {
        kinds.iter().map(move |kind| Cell {
            command,
            option,
            kind,
        })
    });
    let (cells, faults) = (Mutex::new(cells), Mutex::new(Vec::new()));
    let next = || cells.lock().expect("cells").next();
    thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                while let Some(cell) = next() {
                    faults.lock().expect("faults").extend(cell.fault());
                }
            });
        }
    });
    let faults = faults.into_inner().expect("faults");
    assert!(
        faults.is_empty(),
        "{} cells:\n{}",
        faults.len(),
        faults.join("\n")
    );
}
