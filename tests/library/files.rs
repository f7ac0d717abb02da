//! Files are read within bounds and written whole.

use std::{
    fs::{self, Permissions},
    io::Write,
    os::unix::{
        ffi::OsStrExt,
        fs::{PermissionsExt, symlink},
    },
    path::Path,
    sync::Barrier,
    thread,
};

use ratelab_system::file::{LockedFile, Provisional, Unfinished, is_same, read_text};

fn mode(path: &Path) -> u32 {
    path.metadata().expect("there").permissions().mode() & 0o777
}

#[test]
fn all_paths_of_a_file_are_the_same_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("sub")).expect("made");
    fs::write(at("file"), "").expect("written");
    fs::hard_link(at("file"), at("hard")).expect("linked");
    symlink("file", at("soft")).expect("linked");
    symlink("new", at("dangling")).expect("linked");
    for (one, other) in [
        ("file", "sub/../file"),
        ("file", "./file"),
        ("file", "soft"),
        ("file", "hard"),
        ("new", "new"),
        ("new", "sub/../new"),
        ("new", "dangling"),
    ] {
        assert!(is_same(&at(one), &at(other)), "{one} and {other}");
    }
    for (one, other) in [("file", "new"), ("file", "sub"), ("no/new", "no/new")] {
        assert!(!is_same(&at(one), &at(other)), "{one} and {other}");
    }
}

#[test]
fn a_complete_file_has_its_name_and_its_old_permissions() {
    let folder = tempfile::tempdir().expect("a folder");
    let target = folder.path().join("rows.csv");
    fs::write(&target, "old").expect("written");
    fs::set_permissions(&target, Permissions::from_mode(0o640)).expect("set");
    let file = Unfinished::create(&target).expect("created");
    let mut writer = file.writer().expect("open");
    writer.write_all(b"new").expect("written");
    assert_eq!(fs::read(&target).expect("there"), b"old");
    file.complete().expect("named");
    assert_eq!(fs::read(&target).expect("there"), b"new");
    let mode = target.metadata().expect("there").permissions().mode();
    assert_eq!(mode & 0o777, 0o640);
    let left = folder.path().read_dir().expect("a folder").count();
    assert_eq!(left, 1, "more than the file");
}

#[test]
fn a_new_file_has_the_default_permissions() {
    let folder = tempfile::tempdir().expect("a folder");
    let [ours, other] = ["ours", "other"].map(|name| folder.path().join(name));
    let new = Unfinished::create(&ours).expect("created");
    new.complete().expect("named");
    fs::write(&other, "").expect("written");
    let mode = |path: &Path| path.metadata().expect("there").permissions().mode();
    assert_eq!(mode(&ours), mode(&other));
}

#[test]
fn a_name_may_have_any_length_and_spelling() {
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["€".repeat(80).as_bytes(), b"\xff.csv"] {
        let target = folder.path().join(std::ffi::OsStr::from_bytes(name));
        let file = Unfinished::create(&target).expect("created");
        file.complete().expect("named");
        assert!(target.exists());
    }
}

#[test]
fn what_was_made_goes_again_unless_it_is_kept() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let (deep, ()) = Provisional::new(&path("deep"), |path| fs::create_dir(path)).expect("made");
    let make = |name: &str| Provisional::new(&path(name), |path| fs::File::create_new(path));
    let (file, _) = make("deep/file").expect("made");
    assert!(make("deep/file").is_err(), "it is there");
    assert!(path("deep/file").exists(), "of a refused one nothing goes");
    drop(file);
    assert!(!path("deep/file").exists());
    make("deep/kept").expect("made").0.keep();
    drop(deep);
    assert!(path("deep/kept").exists(), "its folder stays as well");
}

#[test]
fn two_that_change_a_file_at_once_lose_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("deep/kept");
    let (threads, turns) = (8, 20);
    let together = Barrier::new(threads);
    let append = || {
        together.wait();
        for _ in 0..turns {
            let locked = LockedFile::lock(&file, 1 << 20).expect("locked");
            let text = locked.text.clone().unwrap_or_default() + "line\n";
            locked.replace(&text).expect("replaced");
        }
    };
    thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(append);
        }
    });
    let text = read_text(&file, 1 << 20).expect("a text");
    assert_eq!(text.lines().count(), threads * turns);
    let left = file.parent().expect("a folder").read_dir().expect("read");
    assert_eq!(left.count(), 1, "more than the file");
}

#[test]
fn a_file_that_is_changed_keeps_its_permissions_its_links_and_itself_where_nothing_comes_of_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let [file, link] = ["file", "link"].map(|name| folder.path().join(name));
    fs::write(&file, "old").expect("written");
    fs::set_permissions(&file, Permissions::from_mode(0o600)).expect("set");
    symlink("file", &link).expect("linked");
    drop(LockedFile::lock(&link, 3).expect("locked"));
    assert_eq!(read_text(&file, 3).expect("there"), "old");
    let locked = LockedFile::lock(&link, 3).expect("locked");
    locked.replace("new").expect("replaced");
    assert_eq!(read_text(&file, 3).expect("there"), "new");
    assert_eq!(mode(&file), 0o600);
    assert!(link.is_symlink());
    let refused = LockedFile::lock(&link, 2).err().expect("too long");
    assert!(refused.to_string().ends_with("found 3 bytes"), "{refused}");
    let other = folder.path().join("other");
    fs::hard_link(&file, &other).expect("linked");
    let refused = LockedFile::lock(&link, 3).err().expect("two names");
    assert!(refused.to_string().contains("several names"), "{refused}");
    fs::remove_file(other).expect("removed");
    fs::set_permissions(&file, Permissions::from_mode(0o444)).expect("set");
    let refused = LockedFile::lock(&file, 3).err().expect("read-only");
    assert!(refused.to_string().contains("read-only"), "{refused}");
    assert_eq!(folder.path().read_dir().expect("read").count(), 2);
}
