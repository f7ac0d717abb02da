//! The version of the release is in several files, which must agree.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;

use xtask::mujoco::{Platform, VERSION};

const TARGETS: [(&str, &str, &str); 3] = [
    ("linux", "x86_64", "gnu"),
    ("linux", "aarch64", "gnu"),
    ("macos", "aarch64", ""),
];

fn checked_in(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("mujoco");
    fs::read_to_string(folder.join(name)).unwrap()
}

#[test]
fn the_pin_names_the_version_and_a_hash_for_every_platform() {
    let pin = checked_in("requirements.txt");
    assert!(pin.contains(&format!("\nmujoco=={VERSION} ")));
    assert_eq!(pin.matches("--hash=sha256:").count(), TARGETS.len());
}

#[test]
fn the_linker_script_leads_to_the_fetched_library() {
    let library = Platform::find("linux", "x86_64", "gnu").unwrap().places[0];
    assert_eq!(checked_in("libmujoco.so"), format!("INPUT({library})\n"));
}

#[test]
fn every_platform_uses_the_pinned_version_of_its_wheel() {
    for (os, arch, libc) in TARGETS {
        let platform = Platform::find(os, arch, libc).unwrap();
        assert!(platform.member.contains(VERSION), "{platform:?}");
        assert!(platform.places[0].contains(VERSION), "{platform:?}");
    }
}

#[test]
fn a_platform_without_a_pin_is_refused_by_name() {
    for (os, arch, libc) in [("windows", "x86_64", "msvc"), ("linux", "x86_64", "musl")] {
        let message = Platform::find(os, arch, libc).unwrap_err().to_string();
        assert!(message.contains(&format!("no library is known for {os} {arch} {libc}.")));
    }
}
