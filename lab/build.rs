//! Gives the programs of this package the location of MuJoCo's library, and the version
//! of their sources.

use std::{env, path::Path, process::Command};

/// Set by `cargo xtask dist`: the program is for other machines, so it must not search
/// for the library in a folder of this one, which could contain a different library
/// there.
const DIST: &str = "RATELAB_DIST";

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed={DIST}");
    if let Ok(dir) = env::var("DEP_RATELAB_MUJOCO_RPATH") {
        if env::var_os(DIST).is_none() {
            println!("cargo::rustc-link-arg=-Wl,-rpath,{dir}");
            // For crates of one's own, whose programs load it as well.
            println!("cargo::metadata=rpath={dir}");
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
    // Read at run time of the script: the clone may have moved since it was compiled.
    commit(&Path::new(&variable("CARGO_MANIFEST_DIR")).join(".."));
}

/// An installed program outlives its clone, so it uses a library in `lib/ratelab`, beside
/// the folder of the program.
fn beside() {
    let here = match env::var("CARGO_CFG_TARGET_OS").as_deref() {
        Ok("macos") => "@executable_path",
        _ => "$ORIGIN",
    };
    println!("cargo::rustc-link-arg=-Wl,-rpath,{here}/../lib/ratelab");
}

/// The sources of the program. Watching these causes no extra builds, because a change of
/// any of them rebuilds the program anyway.
const SOURCES: [&str; 25] = [
    "Cargo.toml",
    "Cargo.lock",
    "crates/metrics",
    "crates/bag",
    "crates/cart-pole",
    "crates/plant",
    "crates/policy",
    "crates/real-clock",
    "crates/recording/Cargo.toml",
    "crates/recording/src",
    "crates/re-execution",
    "crates/screen",
    "crates/experiment",
    "crates/system",
    "crates/network/Cargo.toml",
    "crates/network/src",
    "src",
    "exercises/Cargo.toml",
    "exercises/bands.toml",
    "exercises/mend",
    "exercises/questions.toml",
    "exercises/src",
    "lab/Cargo.toml",
    "lab/build.rs",
    "lab/src",
];

/// Passes on the commit of the clone at `root`, and whether files have changed since;
/// nothing without git or outside of a clone.
fn commit(root: &Path) {
    for source in SOURCES {
        watch(&root.join(source));
    }
    // A copy without history may lie in another repository.
    if !root.join(".git").exists() {
        return;
    }
    let git = |args: &[&str]| {
        let mut git = Command::new("git");
        git.arg("-C").arg(root).args(args);
        said(git.env("GIT_OPTIONAL_LOCKS", "0"))
    };
    // The log changes with every commit or checkout; without a log, watch the branch,
    // which may not exist.
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
        // The first commit of a repository adds the first branch.
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

/// Watching a missing file would run the script on every build.
fn watch(file: &Path) {
    if file.exists() {
        println!("cargo::rerun-if-changed={}", file.display());
    }
}

fn tell(name: &str, fact: &str) {
    println!("cargo::rustc-env=RATELAB_{name}={fact}");
}

/// Returns the output of `command`, if it runs and succeeds.
fn said(command: &mut Command) -> Option<String> {
    let output = command.output().ok()?;
    let said = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| said.trim().to_owned())
}
