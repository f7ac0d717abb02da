//! The files that the program adds to a package, with a shell script in its place. A
//! single test, because a newly written program cannot start while another thread starts
//! one.

#![cfg(unix)]
#![allow(clippy::unwrap_used)]

use std::path::Path;

use dist::{Tree, share};

/// Runs only beside its library, like the program.
const PROGRAM: &str = r#"#!/bin/sh
set -e
read -r library < "$(dirname "$0")/../lib/ratelab/libmujoco.so"
case $1 in
man) mkdir -p "$2" && echo "with $library" > "$2/ratelab.1" && echo > "$2/ratelab-run.1" ;;
completions) echo "for $2" ;;
esac
"#;

#[test]
fn the_unpacked_program_writes_its_pages_and_shared_files_are_included() {
    let scratch = tempfile::tempdir().unwrap();
    let package = std::env::var_os("CARGO_MANIFEST_DIR").unwrap();
    let root = Path::new(&package).join("../..");
    let mut tree = Tree::default();
    tree.add_program("bin/ratelab", PROGRAM);
    tree.add("lib/ratelab/libmujoco.so", "the library\n");
    share(&mut tree, &root, &scratch.path().join("unpacked")).unwrap();
    let text = |path: &str| {
        let file = tree.files().find(|(found, _)| *found == path);
        let (_, file) = file.unwrap_or_else(|| panic!("{path} is missing"));
        String::from_utf8_lossy(&file.bytes).into_owned()
    };
    assert_eq!(text("share/man/man1/ratelab.1"), "with the library\n");
    assert_eq!(text("share/man/man1/ratelab-run.1"), "\n");
    for (place, shell) in [
        ("share/bash-completion/completions/ratelab", "bash"),
        ("share/fish/vendor_completions.d/ratelab.fish", "fish"),
        ("share/zsh/site-functions/_ratelab", "zsh"),
    ] {
        assert_eq!(text(place), format!("for {shell}\n"));
    }
    assert!(text("share/ratelab/recordings/fall-5hz.rrd").len() > 100_000);
    assert!(text("share/ratelab/exercises/accumulating.rs").contains("due[next] += "));
    assert_eq!(tree.files().count(), 12);
}
