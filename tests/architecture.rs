//! The rooms of the house stay apart: the runtime knows no robot, the library
//! knows no terminal, no command line and no recorder. And none gets too large to
//! be read at one go.

#[path = "common/clone.rs"]
mod clone;

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
};

use clone::root;

/// The lines of a manifest that name what the library itself depends on,
/// whatever the platform.
fn library_dependencies(manifest: &str) -> String {
    let mut wanted = false;
    let lines = manifest.lines().filter(|line| {
        if line.starts_with('[') {
            let section = line.trim_matches(['[', ']']);
            let platform = section.starts_with("target.") && section.contains(".dependencies");
            wanted = platform || section.split('.').next() == Some("dependencies");
        }
        wanted
    });
    lines.collect::<Vec<_>>().join("\n")
}

#[test]
fn the_library_depends_on_no_terminal_no_command_line_and_no_recorder() {
    let manifest = fs::read_to_string(root().join("Cargo.toml")).expect("manifest");
    let dependencies = library_dependencies(&manifest);
    assert!(dependencies.contains("mujoco-rs"), "nothing was read");
    for foreign in ["ratatui", "crossterm", "clap", "rerun"] {
        assert!(
            !dependencies.contains(foreign),
            "the library depends on {foreign}"
        );
    }
}

/// Where the code is. A clone may hold other folders: of builds, of Python, of
/// whatever somebody keeps there.
const ROOMS: [&str; 7] = [
    "benches",
    "examples",
    "exercises",
    "lab",
    "src",
    "tests",
    "xtask",
];

/// The Rust files of the workspace.
fn all_rust_files() -> Vec<PathBuf> {
    let rooms = ROOMS.iter().map(|room| root().join(room));
    let mut files: Vec<_> = rooms.flat_map(|room| rust_files(&room)).collect();
    files.push(root().join("build.rs"));
    files
}

/// The Rust files below `folder`, but for what cargo and git keep there.
fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).expect("folder") {
        let path = entry.expect("entry").path();
        let name = path.file_name().and_then(|name| name.to_str());
        if name.is_none_or(|name| name == "target" || name.starts_with('.')) {
            continue;
        }
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    files
}

/// A source file without its comments, which may speak of anything.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).expect("source");
    let lines = text
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"));
    lines.collect::<Vec<_>>().join("\n")
}

#[test]
fn the_runtime_imports_no_robot_no_policy_and_no_experiment() {
    let files = rust_files(&root().join("src/runtime"));
    assert!(files.len() > 10, "only {} files were found", files.len());
    for path in files {
        let code = code(&path);
        for (_, rest) in code
            .match_indices("crate::")
            .map(|(at, word)| code.split_at(at + word.len()))
        {
            let import = rest.lines().next().unwrap_or_default();
            assert!(
                import.starts_with("runtime"),
                "{}: crate::{import}",
                path.display()
            );
        }
        for module in ["cartpole", "policy", "experiment"] {
            for import in [format!("{module}::"), format!("::{module}")] {
                assert!(!code.contains(&import), "{}: {import}", path.display());
            }
        }
    }
}

/// Lines that a file may have. What needs more is more than one idea; for
/// functions clippy holds the line, see `clippy.toml`.
const LONGEST_FILE: usize = 400;

/// Lines that an example may have: it is to be read whole.
const LONGEST_EXAMPLE: usize = 60;

fn none_is_longer(files: Vec<PathBuf>, least: usize, longest: usize) {
    assert!(
        files.len() >= least,
        "only {} files were found",
        files.len()
    );
    for path in files {
        let lines = fs::read_to_string(&path).expect("source").lines().count();
        assert!(
            lines <= longest,
            "{} has {lines} lines: split it by idea into files of {longest} at most",
            path.display()
        );
    }
}

#[test]
fn no_file_is_too_long_to_be_read_at_one_go() {
    none_is_longer(all_rust_files(), 250, LONGEST_FILE);
}

#[test]
fn every_example_fits_on_a_screen() {
    none_is_longer(rust_files(&root().join("examples")), 4, LONGEST_EXAMPLE);
}

#[test]
fn every_package_keeps_the_lints_of_the_house() {
    for package in [".", "exercises", "lab", "xtask"] {
        let manifest = root().join(package).join("Cargo.toml");
        let manifest = fs::read_to_string(manifest).expect("manifest");
        assert!(
            manifest.contains("[lints]\nworkspace = true"),
            "{package}/Cargo.toml keeps none"
        );
    }
}

/// The crates that `profile` optimises although others are not.
fn optimised(profile: &str) -> BTreeSet<String> {
    let manifest = fs::read_to_string(root().join("Cargo.toml")).expect("manifest");
    let manifest: toml::Table = manifest.parse().expect("TOML");
    let crates = manifest["profile"][profile]["package"].as_table();
    let crates = crates.expect("crates").iter();
    let fully = crates.filter(|(_, of)| of["opt-level"].as_integer() == Some(3));
    fully.map(|(name, _)| name.clone()).collect()
}

#[test]
fn an_installed_lab_is_made_of_the_same_optimised_crates() {
    let dev = optimised("dev");
    assert!(dev.len() > 10, "only {dev:?} were found");
    assert_eq!(dev, optimised("release"));
}
