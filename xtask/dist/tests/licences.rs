//! The licences of the crates in the program, from this workspace.

#![allow(clippy::unwrap_used)]

use std::path::Path;

use dist::{Machine, Tree, licences};

fn machine() -> Machine {
    // Read at run time: the clone may have moved since compilation.
    let package = std::env::var_os("CARGO_MANIFEST_DIR").unwrap();
    Machine::ask(&Path::new(&package).join("../..")).unwrap()
}

/// The text with this number.
fn text<'a>(page: &'a str, number: &str) -> &'a str {
    let line = "=".repeat(30);
    let (_, text) = page
        .split_once(&format!("\n{line} {number} {line}\n"))
        .unwrap_or_else(|| panic!("no text {number}"));
    text.split(&format!("\n{line} ")).next().unwrap()
}

#[test]
fn every_crate_in_the_program_and_no_other_is_listed_with_a_text() {
    let machine = machine();
    let page = licences::list(&machine).unwrap();
    let crates: Vec<_> = page.lines().filter(|line| line.contains(" | ")).collect();
    let lists = |name: &str| {
        let begins = format!("{name} ");
        crates.iter().any(|line| line.starts_with(&begins))
    };
    for name in ["mujoco-rs", "rerun", "ratelab", "option-ext", "zenoh"] {
        assert!(lists(name), "{name} is linked in");
    }
    for name in ["insta", "serde_derive", "spdx", "dist"] {
        assert!(!lists(name), "{name} is not linked in");
    }
    for line in &crates {
        let (_, texts) = line.rsplit_once(" | ").unwrap();
        let texts = texts.split(' ').map(|number| text(&page, number));
        let longest = texts.map(str::len).max().unwrap();
        assert!(longest > 500, "its texts only name a licence: {line}");
    }
    let mut tree = Tree::default();
    tree.add("crates.txt", page);
    tree.check_names_none_of(&machine.folders()).unwrap();
}

#[test]
fn a_crate_without_a_text_gets_the_standard_ones_of_all_licences_it_names() {
    let first = |expression| licences::standard(expression).map(|texts| texts.len());
    assert_eq!(first("MIT OR Apache-2.0"), Some(2));
    assert_eq!(first("MIT/Apache-2.0"), Some(2));
    assert_eq!(first("Apache-2.0 WITH LLVM-exception"), Some(2));
    assert_eq!(first("LicenseRef-ours"), None);
    assert_eq!(first(""), None);
    let mit = licences::standard("MIT").unwrap().concat();
    assert!(mit.contains("Permission is hereby granted"), "{mit}");
}

#[test]
fn the_viewer_has_the_version_of_the_recordings() {
    let manifest = include_str!("../../../Cargo.toml");
    let version = licences::viewer(&machine()).unwrap();
    let pinned = format!("rerun = {{ version = \"={version}\"");
    assert!(manifest.contains(&pinned), "{version}");
}
