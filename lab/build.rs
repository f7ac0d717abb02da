//! Says where the programs of this package find MuJoCo's library, and what they
//! were built from.

use std::{env, path::Path, process::Command};

/// Set by `cargo xtask dist`: the program leaves this machine, so it must not look
/// for the library in a folder of this machine, where it may be another one.
const DIST: &str = "RATELAB_DIST";

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed={DIST}");
    if let Ok(dir) = env::var("DEP_RATELAB_MUJOCO_RPATH") {
        if env::var_os(DIST).is_none() {
            println!("cargo::rustc-link-arg=-Wl,-rpath,{dir}");
        }
        beside();
    }
    let variable = |name| env::var(name).unwrap_or_default();
    let (profile, level) = (variable("PROFILE"), variable("OPT_LEVEL"));
    tell("TARGET", &variable("TARGET"));
    tell("PROFILE", &format!("{profile}, opt-level {level}"));
    if let Some(rustc) = said(Command::new(variable("RUSTC")).arg("--version")) {
        tell("RUSTC", rustc.trim_start_matches("rustc "));
    }
    // Read while running: the clone may have moved since this was compiled.
    commit(&Path::new(&variable("CARGO_MANIFEST_DIR")).join(".."));
}

/// An installed program outlives a clone that moves or goes: it takes a library
/// in `lib/ratelab`, beside the folder that the program is in.
fn beside() {
    let here = match env::var("CARGO_CFG_TARGET_OS").as_deref() {
        Ok("macos") => "@executable_path",
        _ => "$ORIGIN",
    };
    println!("cargo::rustc-link-arg=-Wl,-rpath,{here}/../lib/ratelab");
}

/// What the program is made of. Looking at these builds nothing more often: what
/// changes one of them has the program built anew as it is.
const SOURCES: [&str; 11] = [
    "Cargo.toml",
    "Cargo.lock",
    "build.rs",
    "src",
    "exercises/Cargo.toml",
    "exercises/bands.toml",
    "exercises/build.rs",
    "exercises/src",
    "lab/Cargo.toml",
    "lab/build.rs",
    "lab/src",
];

/// Tells the commit in the clone at `root`, and whether anything was changed
/// since; nothing, where there is no git or this is no clone.
fn commit(root: &Path) {
    for source in SOURCES {
        watch(&root.join(source));
    }
    // A copy without history may lie in somebody else's repository.
    if !root.join(".git").exists() {
        return;
    }
    let git = |args: &[&str]| {
        let mut git = Command::new("git");
        git.arg("-C").arg(root).args(args);
        said(git.env("GIT_OPTIONAL_LOCKS", "0"))
    };
    // What a commit or a checkout changes; without a log of them, the branch, of
    // which there may be none.
    let branch = git(&["symbolic-ref", "--quiet", "HEAD"]);
    let watch = |name| {
        if let Some(file) = git(&["rev-parse", "--git-path", name]) {
            watch(&root.join(file));
        }
    };
    ["HEAD", "logs/HEAD"].into_iter().for_each(watch);
    branch.as_deref().into_iter().for_each(watch);
    let Some(commit) = git(&[
        "log",
        "-1",
        "--no-show-signature",
        "--abbrev=12",
        "--format=%h %cs",
    ]) else {
        // The first commit of all adds the first branch.
        watch("refs/heads");
        return;
    };
    let changed = git(&[&["status", "--porcelain", "--"], &SOURCES[..]].concat());
    let changes = match changed.as_deref() {
        Some("") => "",
        _ => " + changes",
    };
    if let Some((commit, date)) = commit.split_once(' ') {
        tell("COMMIT", &format!("{commit}{changes}"));
        tell("DATE", date);
    }
}

/// What is not there would have this run each time.
fn watch(file: &Path) {
    if file.exists() {
        println!("cargo::rerun-if-changed={}", file.display());
    }
}

fn tell(name: &str, fact: &str) {
    println!("cargo::rustc-env=RATELAB_{name}={fact}");
}

/// What `command` says, if it can be run and succeeds.
fn said(command: &mut Command) -> Option<String> {
    let output = command.output().ok()?;
    let said = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| said.trim().to_owned())
}
