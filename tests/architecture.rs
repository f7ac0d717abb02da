//! The runtime knows no robot: nothing below `src/runtime` imports another part of
//! the library. No files import each other in a circle. What the library may depend on is in `dependencies.rs`.

#[path = "support/clone.rs"]
mod clone;
#[path = "support/imports.rs"]
mod imports;

use std::{
    fs,
    path::{Path, PathBuf},
};

use imports::{Sources, circles, imports};

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

/// The modules of the crate in `folder`, without tests.
fn sources(folder: &str) -> Sources {
    let root = clone::root().join(folder);
    let files = rust_files(&root).into_iter().map(|path| {
        let inside = path.with_extension("");
        let names = inside.strip_prefix(&root).expect("below").iter();
        let names = names.map(|name| name.to_string_lossy().into_owned());
        let names = names.filter(|name| !["mod", "lib", "main"].contains(&name.as_str()));
        let module = std::iter::once(folder.to_owned()).chain(names).collect();
        let code = code(&path);
        let code = code.split("#[cfg(test)]\nmod tests {").next();
        (module, code.unwrap_or_default().to_owned())
    });
    let mut files: Sources = files.collect();
    files.retain(|module, _| !module.contains(&"tests".to_owned()));
    files
}

#[test]
fn no_source_files_import_each_other_in_a_circle() {
    let mut found = Vec::new();
    for folder in ["src", "lab/src"] {
        let mut imports = imports(&sources(folder));
        // A part of a module may use what the module itself defines.
        for (from, to) in &mut imports {
            to.retain(|to| !from.starts_with(to));
        }
        let count = imports.values().flatten().count();
        assert!(count > 10, "only {count} imports were found in {folder}");
        for circle in circles(&imports) {
            for from in &circle {
                let to = imports[*from].iter().filter(|to| circle.contains(to));
                found.extend(to.map(|to| format!("{} -> {}", from.join("/"), to.join("/"))));
            }
            found.push(String::new());
        }
    }
    assert!(found.is_empty(), "circles:\n{}", found.join("\n"));
}
