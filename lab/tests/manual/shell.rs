//! The shell for the commands of a page: a folder like a fresh clone, with everything
//! already built.

use std::{
    fs,
    os::unix::fs::{PermissionsExt, symlink},
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use portable_pty::CommandBuilder;
use ratelab_recording::rrd::rerun_version;
use tempfile::TempDir;

use crate::support::{RATELAB, terminal::Lab};

/// A stand-in for cargo: the real one runs this check and has built everything already.
const CARGO: &str = r#"#!/bin/sh
case "$1 $2" in
"run ") exec ratelab ;;
"run --") shift 2 && exec ratelab "$@" ;;
"run --example") example=$3; shift 3; [ "$1" != -- ] || shift; exec "$BUILT/examples/$example" "$@" ;;
esac
echo "the check of the manual knows no cargo $*" >&2
exit 125
"#;

/// A viewer without a window.
const VIEWER: &str = "#!/bin/sh\n[ \"$1\" != --version ] || echo \"rerun $RERUN\"\n";

/// Programs allowed on a page.
const PROGRAMS: [&str; 10] = [
    "cargo", "cat", "cp", "echo", "grep", "head", "mkdir", "ratelab", "sed", "tail",
];

/// Folders that commands on the pages read, without their subfolders.
const FOLDERS: [&str; 9] = [
    "docs",
    "docs/own-crate",
    "docs/own-crate/.cargo",
    "docs/recordings",
    "examples",
    "graphs",
    "graphs/robots",
    "policies",
    "tests/fixtures/policies",
];

/// Folders that may also contain a reader's own files.
const FILES: [&str; 5] = [
    "exercises/bands.toml",
    "recordings/balanced-50hz.rrd",
    "recordings/fall-5hz.rrd",
    "recordings/rescue.knobs",
    "recordings/rescued.rrd",
];

/// A shell in a separate folder.
pub struct Shell {
    folder: TempDir,
    root: PathBuf,
}

impl Shell {
    /// Creates a shell for the clone at `root`.
    pub fn new(root: &Path) -> Self {
        let folder = TempDir::new().expect("folder");
        let shell = Self {
            folder,
            root: root.canonicalize().expect("clone"),
        };
        fs::create_dir(shell.programs()).expect("folder");
        fs::create_dir(shell.clone()).expect("folder");
        symlink(RATELAB, shell.programs().join("ratelab")).expect("ratelab");
        shell.program("cargo", CARGO);
        shell.program("rerun", VIEWER);
        for folder in FOLDERS {
            for entry in fs::read_dir(shell.root.join(folder)).expect(folder) {
                let name = entry.expect(folder).file_name();
                shell.copy(&format!("{folder}/{}", name.display()));
            }
        }
        FILES.iter().for_each(|file| shell.copy(file));
        shell.stand_in_for_mujoco();
        shell
    }

    fn programs(&self) -> PathBuf {
        self.folder.path().join("programs")
    }

    fn clone(&self) -> PathBuf {
        self.folder.path().join("clone")
    }

    fn program(&self, name: &str, script: &str) {
        let path = self.programs().join(name);
        fs::write(&path, script).expect(name);
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect(name);
    }

    /// Copies a file of the clone; ignores anything else.
    fn copy(&self, name: &str) {
        let (from, to) = (self.root.join(name), self.clone().join(name));
        fs::create_dir_all(to.with_file_name("")).expect(name);
        if from.is_file() {
            fs::copy(from, to).expect(name);
        }
    }

    /// A placeholder for the library that the first build fetches; nothing here loads it.
    fn stand_in_for_mujoco(&self) {
        let folder = self.clone().join("xtask/mujoco");
        fs::create_dir_all(&folder).expect("folder");
        let version = ratelab_cart_pole::mujoco_version();
        fs::write(folder.join(format!("libmujoco.so.{version}")), "").expect("library");
    }

    /// The environment of a reader.
    fn environment(&self) -> [(&'static str, String); 5] {
        let path = std::env::var("PATH").unwrap_or_default();
        [
            ("PATH", format!("{}:{path}", self.programs().display())),
            ("BUILT", built().display().to_string()),
            ("RERUN", rerun_version()),
            ("HOME", self.folder.path().display().to_string()),
            ("LC_ALL", "C.UTF-8".to_owned()),
        ]
    }

    /// The output of a command, with standard error if `all`; or the reason for its
    /// failure.
    pub fn run(&self, command: &str, all: bool) -> Result<String, String> {
        allowed(command)?;
        let script = format!("{}\n{command}", if all { "exec 2>&1" } else { "" });
        let mut shell = Command::new("sh");
        shell.args(["-c", &script]).current_dir(self.clone());
        shell.env_clear().envs(self.environment());
        let ended = shell.stdin(Stdio::null()).output().expect("a shell");
        let printed = String::from_utf8_lossy(&ended.stdout).into_owned();
        if ended.status.success() {
            return Ok(printed);
        }
        let failed = String::from_utf8_lossy(&ended.stderr);
        Err(format!("{}\n{printed}{failed}", ended.status))
    }

    /// Starts a program that uses the whole terminal, and quits it after its first frame.
    pub fn look(&self, command: &str) -> Result<(), String> {
        allowed(command)?;
        let mut shell = CommandBuilder::new("sh");
        shell.args(["-c", command]);
        shell.cwd(self.clone());
        shell.env_clear();
        for (name, value) in self.environment() {
            shell.env(name, value);
        }
        let mut lab = Lab::start(shell, 45, 160);
        lab.wait_for("1 graph");
        lab.type_keys("q");
        let (status, _) = lab.close();
        status.success().then_some(()).ok_or(status.to_string())
    }
}

/// The folder of cargo's output.
fn built() -> PathBuf {
    Path::new(RATELAB).with_file_name("")
}

/// Checks that each example is newer than its source.
pub fn check_examples(root: &Path) {
    let built = built().join("examples");
    for entry in fs::read_dir(root.join("examples")).expect("examples") {
        let source = entry.expect("example").path();
        let age = |path: &Path| fs::metadata(path).and_then(|file| file.modified()).ok();
        let program = built.join(source.file_stem().expect("a name"));
        let name = program.display();
        assert!(
            age(&program) >= age(&source),
            "cargo test builds {name}: it is not up to date"
        );
    }
}

/// Refuses commands that change the machine.
fn allowed(command: &str) -> Result<(), String> {
    if command.contains(['&', '`']) || command.contains("$(") {
        return Err("the check of the manual joins commands with ; and | only".to_owned());
    }
    let starts = command.split(['|', ';', '\n']).map(str::trim);
    for start in starts.filter(|start| !start.is_empty()) {
        let program = start.split_whitespace().next().unwrap_or_default();
        let argument = program.starts_with("--") || program.ends_with('\\');
        if !argument && !PROGRAMS.contains(&program) {
            return Err(format!("the check of the manual runs no {program}"));
        }
    }
    Ok(())
}

/// Whether `command` takes over the terminal.
pub fn takes_the_terminal(command: &str) -> bool {
    let words: Vec<_> = command.split_whitespace().collect();
    let arguments = match words.as_slice() {
        ["cargo", "run", "--", arguments @ ..]
        | ["cargo", "run", "--example", _, "--", arguments @ ..]
        | ["ratelab", arguments @ ..] => arguments,
        ["cargo", "run"] => &[],
        _ => return false,
    };
    match arguments.first() {
        None | Some(&"lab") => true,
        Some(&"replay") => arguments.contains(&"--terminal"),
        Some(first) => first.starts_with("--") && !["--help", "--version"].contains(first),
    }
}
