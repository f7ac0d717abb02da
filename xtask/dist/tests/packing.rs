//! `cargo xtask dist`, run from outside, up to the point of building.

#![allow(clippy::unwrap_used)]

use std::process::{Command, Output};

/// Runs it without any tool on the search path.
fn dist(options: &[&str]) -> Output {
    let mut dist = Command::new(env!("CARGO_BIN_EXE_dist"));
    dist.env("PATH", "").args(options).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn an_unknown_option_prints_the_usage_and_returns_2() {
    for options in [&["--fast"][..], &["--native", "now"]] {
        let output = dist(options);
        assert_eq!(output.status.code(), Some(2));
        assert!(text(&output.stderr).starts_with("Usage: cargo xtask dist"));
    }
    let help = dist(&["--help"]);
    assert!(help.status.success());
    assert!(text(&help.stdout).contains("--native"));
}

#[cfg(target_os = "linux")]
#[test]
fn without_zig_it_names_the_tool_and_both_remedies_before_it_builds() {
    let output = dist(&[]);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    for part in [
        "cargo-zigbuild is missing",
        "python3 -m pip install cargo-zigbuild",
        "--native",
    ] {
        assert!(said.contains(part), "{said}");
    }
}
