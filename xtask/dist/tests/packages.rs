//! The contents of tarball and wheel, and their reproducibility. Small files stand in for
//! the program, because building it takes a quarter of an hour.

#![cfg(unix)]
#![allow(clippy::unwrap_used)]

use std::{
    env,
    ffi::OsString,
    fs,
    io::{Cursor, Read},
    os::unix::fs::PermissionsExt,
    path::Path,
    process::Command,
};

use base64::{Engine, engine::general_purpose::URL_SAFE_NO_PAD};
use dist::{Error, Tree, Wheel, tarball, wheel, wheel_tag};
use flate2::read::GzDecoder;
use rand::{RngCore, SeedableRng, rngs::SmallRng, seq::SliceRandom};
use sha2::{Digest, Sha256};
use zip::ZipArchive;

const TIME: u64 = 1_700_000_000;
const PROGRAM: &str = "#!/bin/sh\nls \"$(dirname \"$0\")/../lib/ratelab\"\n";
const LICENCES: &str = "share/licenses/ratelab";

/// A tree as in a package, with files added in an order given by `seed`.
fn tree(seed: u64) -> Tree {
    let mut random = SmallRng::seed_from_u64(seed);
    let mut library = vec![0; 100_000];
    // The library is the same for any order.
    SmallRng::seed_from_u64(0).fill_bytes(&mut library);
    let mut files = vec![
        ("bin/ratelab", PROGRAM.as_bytes()),
        ("lib/ratelab/libmujoco.so.1", &library),
        ("share/licenses/ratelab/LICENSE", b"a licence"),
        ("share/licenses/ratelab/mujoco/LICENSE", b"another"),
        ("share/man/man1/ratelab.1", b".TH RATELAB 1\n"),
        ("share/ratelab/recordings/fall.rrd", &[0, 255, 10, 13]),
    ];
    files.shuffle(&mut random);
    let mut tree = Tree::default();
    for (path, bytes) in files {
        match path {
            "bin/ratelab" => tree.add_program(path, bytes),
            _ => tree.add(path, bytes),
        }
    }
    tree
}

fn about() -> Wheel {
    Wheel {
        version: "1.2.3".to_owned(),
        platform: wheel_tag(&[b"needs no glibc"]),
        viewer: "0.1.2".to_owned(),
    }
}

/// The files of a zip archive, in its order.
fn unzipped(bytes: &[u8]) -> Vec<(String, Vec<u8>)> {
    let mut archive = ZipArchive::new(Cursor::new(bytes)).unwrap();
    let count = archive.len();
    let mut file = |at| {
        let mut file = archive.by_index(at).unwrap();
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).unwrap();
        (file.name().unwrap().into_owned(), bytes)
    };
    (0..count).map(&mut file).collect()
}

/// The text of the file in a wheel whose name ends in `end`.
fn text(files: &[(String, Vec<u8>)], end: &str) -> String {
    let (_, bytes) = files.iter().find(|(name, _)| name.ends_with(end)).unwrap();
    String::from_utf8(bytes.clone()).unwrap()
}

#[test]
fn the_same_files_in_any_order_are_the_same_bytes() {
    let pack = |seed| {
        let tree = tree(seed);
        let packed = tarball(&tree, "ratelab", TIME).unwrap();
        (packed, wheel(&tree, &about()).unwrap())
    };
    let first = pack(0);
    for seed in 1..20 {
        assert!(pack(seed) == first, "seed {seed}");
    }
}

#[test]
fn a_tarball_has_fixed_owners_dates_and_modes_below_one_folder() {
    let tree = tree(3);
    let packed = tarball(&tree, "ratelab-1.2.3", TIME).unwrap();
    let mut archive = tar::Archive::new(GzDecoder::new(&packed[..]));
    let mut found = Tree::default();
    for entry in archive.entries().unwrap() {
        let mut entry = entry.unwrap();
        let header = entry.header().clone();
        let owner = (header.uid().unwrap(), header.gid().unwrap());
        assert_eq!((owner, header.mtime().unwrap()), ((0, 0), TIME));
        let whole = entry.path().unwrap().display().to_string();
        let path = whole.strip_prefix("ratelab-1.2.3/").expect("in the folder");
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).unwrap();
        match header.mode().unwrap() {
            0o755 => found.add_program(path, bytes),
            0o644 => found.add(path, bytes),
            mode => panic!("{path}: {mode:o}"),
        }
    }
    assert!(found == tree, "{found:?}");
}

#[test]
fn a_wheel_lists_each_of_its_files_with_hash_and_size() {
    let files = unzipped(&wheel(&tree(0), &about()).unwrap());
    let record = text(&files, "/RECORD");
    assert_eq!(record.lines().count(), files.len());
    for (name, bytes) in &files {
        let hash = URL_SAFE_NO_PAD.encode(Sha256::digest(bytes));
        let line = if name.ends_with("/RECORD") {
            format!("{name},,")
        } else {
            format!("{name},sha256={hash},{}", bytes.len())
        };
        assert!(record.lines().any(|listed| listed == line), "{line}");
    }
    let about = text(&files, "/METADATA");
    for line in [
        "Version: 1.2.3",
        "License-File: mujoco/LICENSE",
        "Requires-Dist: rerun-sdk==0.1.2; extra == 'viewer'",
    ] {
        assert!(about.lines().any(|found| found == line), "{about}");
    }
}

#[test]
fn pip_installs_the_wheel_as_the_original_tree() {
    let folder = tempfile::tempdir().unwrap();
    let (file, prefix) = (
        folder.path().join(about().file_name()),
        folder.path().join("prefix"),
    );
    let tree = tree(0);
    fs::write(&file, wheel(&tree, &about()).unwrap()).unwrap();
    pip(
        &["install", "--no-index", "--no-deps", "--prefix"],
        &[&prefix, &file],
    );
    for (path, expected) in tree.files().filter(|(path, _)| !path.starts_with(LICENCES)) {
        let path = prefix.join(path);
        assert_eq!(fs::read(&path).unwrap(), expected.bytes, "{path:?}");
        let mode = fs::metadata(&path).unwrap().permissions().mode();
        assert_eq!(mode & 0o100 != 0, expected.is_program, "{path:?}");
    }
    let program = Command::new(prefix.join("bin/ratelab")).output().unwrap();
    assert_eq!(program.stdout, b"libmujoco.so.1\n");
}

fn pip(words: &[&str], paths: &[&Path]) {
    let python = env::var_os("PYTHON")
        .filter(|python| !python.is_empty())
        .unwrap_or_else(|| OsString::from("python3"));
    let mut pip = Command::new(python);
    pip.args(["-m", "pip", "--disable-pip-version-check", "--no-cache-dir"]);
    let output = pip.args(words).args(paths).output().unwrap();
    assert!(output.status.success(), "{output:?}");
}

#[test]
fn a_folder_of_the_builder_in_a_file_is_refused_by_name() {
    let folders = ["/build/clone", "/home/me/.cargo", "/root"].map(str::to_owned);
    assert!(tree(0).check_names_none_of(&folders).is_ok());
    for (text, is_refused) in [
        ("panic at /home/me/.cargo/registry/x.rs:1", true),
        ("\0/build/clone\0", true),
        ("panicked in textat /root/x.rs", true),
        ("the home is /root.", true),
        ("/build/clones, /home/me/.cargoes, /home/me", false),
        // A key of zenoh, and other longer names.
        ("transport/link/tls/root_ca_certificate", false),
        ("/root-ca /root+x /root.pem /roots", false),
    ] {
        let mut tree = tree(0);
        tree.add_program("bin/ratelab", text);
        let checked = tree.check_names_none_of(&folders);
        assert_eq!(checked.is_err(), is_refused, "{text:?}");
        if let Err(why) = checked {
            assert!(matches!(why, Error::Unfit(_)));
            assert!(why.to_string().starts_with("bin/ratelab names /"), "{why}");
        }
    }
}

#[cfg(target_os = "linux")]
#[test]
fn the_platform_of_a_wheel_is_the_newest_glibc_that_a_file_in_it_needs() {
    let arch = env::consts::ARCH;
    let old = b"\0GLIBC_2.4\0GLIBC_2.27\0GLIBC_PRIVATE\0GLIBC_2.2.5\0";
    let new = b"GLIBC_2.34";
    assert_eq!(wheel_tag(&[old]), format!("manylinux_2_27_{arch}"));
    assert_eq!(wheel_tag(&[old, new]), format!("manylinux_2_34_{arch}"));
    assert_eq!(wheel_tag(&[]), format!("manylinux_2_17_{arch}"));
}
