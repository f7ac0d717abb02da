//! `cargo xtask setup`, run from outside, with a shell script in Python's place: its
//! files and messages in all cases. Needs no network.

#![cfg(target_os = "linux")]

#[path = "../../tests/support/script.rs"]
mod script;

use std::{path::Path, process::Command};

use xtask::mujoco::Platform;

/// A separate file, because a program cannot start while a child of any thread still has
/// it open for writing.
const PYTHON: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python.sh");

/// Behaves like pip and Python: `-m` creates a wheel, `-c` unpacks a file of it.
const GOOD: &str = r#"--version) ;;
    -m) for dir; do :; done; echo wheel > "$dir/some.whl" ;;
    -c) mkdir -p "$(dirname "$5/$4")"; truncate -s $SIZE "$5/$4" ;;
"#;

/// A line of the shell in an `xtask` folder, which is that of a clone after the first rows.
fn shell(folder: &Path, line: &str) -> Command {
    let platform = Platform::host().expect("a platform");
    let mut shell = Command::new("sh");
    shell
        .args(["-c", line])
        .current_dir(folder)
        .env("CARGO_MANIFEST_DIR", folder)
        .env("MUJOCO_DYNAMIC_LINK_DIR", folder.join("mujoco"))
        .env_remove("MUJOCO_STATIC_LINK_DIR")
        .env("XTASK", env!("CARGO_BIN_EXE_xtask"))
        .env("PYTHON", PYTHON)
        .env("ANSWERS", GOOD)
        .env("LIBRARY", platform.places[0])
        .env("SIZE", platform.size.to_string());
    shell
}

#[test]
fn a_set_up_is_as_its_script_says() {
    script::play(include_str!("setup.txt"), shell);
}
