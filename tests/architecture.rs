//! The runtime knows no robot: nothing below `src/runtime` imports another part of
//! the library. What the library may depend on is in `dependencies.rs`.

#[path = "support/clone.rs"]
mod clone;

use std::{
    fs,
    path::{Path, PathBuf},
};

/// The Rust files below `folder`.
fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).expect("folder") {
        let path = entry.expect("entry").path();
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
    let files = rust_files(&clone::root().join("src/runtime"));
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
