//! Command lines: the command always ends in an orderly way, and refused input leaves no
//! files behind.

use std::{
    collections::BTreeMap,
    fs,
    os::unix::{ffi::OsStringExt, fs::symlink},
    path::{Path, PathBuf},
};

use rand::seq::IndexedRandom;
use tempfile::tempdir;

use crate::{cases::run, program::ratelab, root, syntax::syntaxes};

/// Fills `folder` with files that must survive, and with traps.
fn prepare(folder: &Path) {
    fs::create_dir(folder.join("folder")).expect("made");
    let copies = [
        ("recordings/fall-5hz.rrd", "run.rrd"),
        ("tests/fixtures/policies/actor.pt", "policy.pt"),
        ("tests/fixtures/policies/asks.pt", "asks.pt"),
        ("graphs/drive.csv", "bag.csv"),
    ];
    for (from, to) in copies {
        fs::copy(root().join(from), folder.join(to)).expect("copied");
    }
    let torn = &fs::read(folder.join("run.rrd")).expect("read")[..200_000];
    let texts = [
        ("rows.csv", "step,time_s\n1,0.0\n"),
        ("turns.knobs", "0.01 control-hz 10\n"),
    ];
    for (name, text) in texts {
        fs::write(folder.join(name), text).expect("written");
    }
    fs::write(folder.join("torn.rrd"), torn).expect("written");
    for (name, to) in [
        ("zero", "/dev/zero"),
        ("zero.pt", "/dev/zero"),
        ("full", "/dev/full"),
        ("loop", "loop"),
    ] {
        symlink(to, folder.join(name)).expect("linked");
    }
}

/// Paths, with the content of files and the targets of links.
type Inventory = BTreeMap<PathBuf, Vec<u8>>;

/// The content of a folder: files with their content, links, and folders.
fn inventory(folder: &Path) -> Inventory {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let kind = fs::symlink_metadata(&path).expect("a kind").file_type();
        if kind.is_dir() {
            found.extend(inventory(&path));
        }
        let content = if kind.is_file() {
            fs::read(&path).expect("read")
        } else if kind.is_symlink() {
            let target = fs::read_link(&path).expect("a link");
            target.into_os_string().into_vec()
        } else {
            Vec::new()
        };
        found.insert(path, content);
    }
    found
}

/// Paths that are missing, changed or new since `before`.
fn changes(before: &Inventory, after: &Inventory) -> Vec<PathBuf> {
    let names = before.keys().chain(after.keys());
    let changed = names.filter(|name| before.get(*name) != after.get(*name));
    changed.cloned().collect()
}

#[test]
fn command_lines() {
    let scratch = tempdir().expect("a folder");
    let syntaxes = syntaxes(scratch.path());
    run("command_lines", 250, |random, note| {
        let scratch = tempdir().expect("a folder");
        let [folder, home] = ["here", "home"].map(|name| scratch.path().join(name));
        for folder in [&folder, &home] {
            fs::create_dir(folder).expect("made");
        }
        prepare(&folder);
        let before = inventory(scratch.path());
        let line = syntaxes.choose(random).expect("a command").line(random);
        *note = format!("{line:?}");
        let output = ratelab(&line, &folder, &home);
        if output.status.code() == Some(2) {
            let changes = changes(&before, &inventory(scratch.path()));
            assert!(changes.is_empty(), "refused, and changed {changes:?}");
        }
    });
}
