//! `ratelab replay`, as used on the command line: in the rerun viewer, or in a terminal.

mod support;

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use tempfile::TempDir;

use support::{command, complaint, folder, ratelab, reference};

/// A folder `bin` with a command `rerun` that prints `version` on request, and otherwise
/// writes its arguments to `given`.
#[cfg(unix)]
fn viewer(folder: &TempDir, version: &str) -> PathBuf {
    use std::os::unix::fs::PermissionsExt;
    let bin = folder.path().join("bin");
    fs::create_dir_all(&bin).expect("a folder");
    let given = folder.path().join("given");
    let script = format!(
        "#!/bin/sh\nif [ \"$1\" = --version ]; then echo '{version}'; else echo \"$@\" > {}; fi\n",
        given.display()
    );
    let command = bin.join("rerun");
    fs::write(&command, script).expect("written");
    fs::set_permissions(&command, fs::Permissions::from_mode(0o755)).expect("executable");
    bin
}

#[cfg(unix)]
#[test]
fn replay_opens_the_viewer_or_prints_how_to_install_it() {
    let folder = folder();
    let file = reference("fall-5hz.rrd");
    let replay = |path: &Path| {
        let path = std::env::join_paths([path, Path::new("/bin"), Path::new("/usr/bin")]);
        let path = path.expect("a search path");
        command()
            .env("PATH", path)
            .args(["replay", &file])
            .output()
            .expect("ratelab starts")
    };
    let ours = rerun::build_info().version;
    let bin = viewer(&folder, &format!("rerun-cli {ours} [rustc 1.92.0]"));
    let output = replay(&bin);
    assert!(
        output.status.success() && output.stderr.is_empty(),
        "{output:?}"
    );
    let given = fs::read_to_string(folder.path().join("given")).expect("opened");
    assert_eq!(given.trim(), file);
    // Another version is opened too, with a note.
    let output = replay(&viewer(&folder, "rerun-cli 0.30.0"));
    let said = complaint(&output, 0);
    assert!(
        said.contains("0.30.0") && said.contains(&format!("pip install rerun-sdk=={ours}")),
        "{said}"
    );
    let said = complaint(&replay(&viewer(&folder, "usage: something else")), 1);
    assert!(said.contains("not the rerun viewer"), "{said}");
    fs::remove_dir_all(bin).expect("removed");
    let said = complaint(&replay(folder.path()), 1);
    assert!(
        said.contains("was not found") && said.contains("pip install"),
        "{said}"
    );
}

/// As installed by pip, in an environment that is not activated.
#[cfg(unix)]
#[test]
fn replay_finds_the_viewer_beside_the_program_through_links_and_without_a_path() {
    // A link to the program, because a copy might still be open for writing.
    let folder = TempDir::new_in(env!("CARGO_TARGET_TMPDIR")).expect("a folder");
    let ours = rerun::build_info().version;
    let bin = viewer(&folder, &format!("rerun-cli {ours} [rustc 1.92.0]"));
    let program = bin.join("ratelab");
    fs::hard_link(env!("CARGO_BIN_EXE_ratelab"), &program).expect("linked");
    let link = folder.path().join("ratelab");
    std::os::unix::fs::symlink(&program, &link).expect("linked");
    let file = reference("fall-5hz.rrd");
    for program in [&program, &link] {
        let mut command = Command::new(program);
        let command = command.env("PATH", "").args(["replay", &file]);
        let output = command.output().expect("ratelab starts");
        assert!(output.status.success(), "{output:?}");
        let given = fs::read_to_string(folder.path().join("given")).expect("opened");
        assert_eq!(given.trim(), file);
        fs::remove_file(folder.path().join("given")).expect("removed");
    }
}

#[test]
fn replay_in_a_terminal_needs_one() {
    let output = ratelab(&["replay", "--terminal", &reference("fall-5hz.rrd")]);
    assert!(
        complaint(&output, 2).contains("try ratelab info"),
        "{output:?}"
    );
}
