//! Files that take their names when they are whole.
//!
//! Until then they have a hidden name beside that of the result, such as
//! `.metrics.json.x7Kq2P.ratelab-tmp`, and a lock that the system takes away from
//! a program that is gone, however it ended. So one without a lock is a leftover,
//! and is removed by the next run that writes to the folder.

use std::{
    fs::{self, File, Permissions, TryLockError},
    io::{self, Write},
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

use tempfile::{Builder, NamedTempFile};

/// End of the hidden names.
const SUFFIX: &str = ".ratelab-tmp";

/// Characters of the result's name in the hidden one, whose length is limited.
const LONGEST_STEM: usize = 40;

/// Hidden names that this program has used.
static NAMES: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// A file on its way to its name. Dropped before, it is gone.
pub struct Unfinished {
    file: NamedTempFile,
    target: PathBuf,
}

impl Unfinished {
    /// A file that will replace `target`, which stays as it is until then.
    ///
    /// # Errors
    /// The error of the system about the folder.
    pub fn create(target: &Path) -> io::Result<Self> {
        let folder = target.parent().unwrap_or(Path::new("/"));
        remove_leftovers(folder);
        let file = hidden(target, folder)?;
        names().push(file.path().to_owned());
        if let Ok(about) = target.metadata() {
            file.as_file().set_permissions(about.permissions())?;
        }
        let target = target.to_owned();
        Ok(Self { file, target })
    }

    /// Writes `text` and a line's end.
    ///
    /// # Errors
    /// The error of the system.
    pub fn write_line(&self, text: &str) -> io::Result<()> {
        writeln!(self.file.as_file(), "{text}")
    }

    /// The file, to be written to.
    ///
    /// # Errors
    /// The error of the system.
    pub fn writer(&self) -> io::Result<File> {
        self.file.as_file().try_clone()
    }

    /// Gives it its name, in the place of a file that has it.
    ///
    /// # Errors
    /// The error of the system.
    pub fn complete(self) -> io::Result<()> {
        let persisted = self.file.persist(self.target);
        persisted.map(drop).map_err(|error| error.error)
    }
}

/// Removes what is unfinished, for a program that ends at once.
pub fn remove_unfinished() {
    for name in names().iter() {
        let _ = fs::remove_file(name); // It may have become a result by now.
    }
}

fn names() -> std::sync::MutexGuard<'static, Vec<PathBuf>> {
    NAMES.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A locked file with a hidden name beside `target`.
fn hidden(target: &Path, folder: &Path) -> io::Result<NamedTempFile> {
    let name = target.file_name().unwrap_or_default().to_string_lossy();
    let stem: String = name.chars().take(LONGEST_STEM).collect();
    loop {
        let file = Builder::new()
            .prefix(&format!(".{stem}."))
            .suffix(SUFFIX)
            // Those of any new file: the umask is applied to them.
            .permissions(Permissions::from_mode(0o666))
            .tempfile_in(folder)?;
        // Another program that removes leftovers may have been faster than the lock.
        // On a file system without locks nothing is removed.
        if file.as_file().lock().is_err() || file.path().exists() {
            return Ok(file);
        }
    }
}

/// Removes what runs that were killed have left in `folder`.
fn remove_leftovers(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
        if name.starts_with('.') && name.ends_with(SUFFIX) && is_file {
            remove_unowned(&entry.path());
        }
    }
}

/// Removes the file at `path` unless a living program has locked it.
fn remove_unowned(path: &Path) {
    let Ok(file) = File::open(path) else {
        return;
    };
    match file.try_lock() {
        // Locked until it is gone: see `hidden`.
        Ok(()) => {
            let _ = fs::remove_file(path); // Left for the next one.
        }
        Err(TryLockError::WouldBlock | TryLockError::Error(_)) => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names_in(folder: &Path) -> Vec<String> {
        let entries = folder.read_dir().expect("a folder");
        let names = entries.map(|entry| entry.expect("an entry").file_name());
        let mut names: Vec<_> = names.map(|name| name.to_string_lossy().into()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_has_its_name_when_it_is_whole_and_its_permissions_as_before() {
        let folder = tempfile::tempdir().expect("a folder");
        let target = folder.path().join("rows.csv");
        fs::write(&target, "old").expect("written");
        fs::set_permissions(&target, Permissions::from_mode(0o640)).expect("set");
        let file = Unfinished::create(&target).expect("created");
        file.writer()
            .expect("open")
            .write_all(b"new")
            .expect("written");
        assert_eq!(fs::read(&target).expect("there"), b"old");
        file.complete().expect("named");
        assert_eq!(fs::read(&target).expect("there"), b"new");
        let mode = target.metadata().expect("there").permissions().mode();
        assert_eq!(mode & 0o777, 0o640);
        assert_eq!(names_in(folder.path()), ["rows.csv"]);
    }

    #[test]
    fn a_new_file_has_the_permissions_of_any_other() {
        let folder = tempfile::tempdir().expect("a folder");
        let [ours, other] = ["ours", "other"].map(|name| folder.path().join(name));
        Unfinished::create(&ours)
            .expect("created")
            .complete()
            .expect("named");
        fs::write(&other, "").expect("written");
        let mode = |path: &Path| path.metadata().expect("there").permissions().mode();
        assert_eq!(mode(&ours), mode(&other));
    }

    #[test]
    fn leftovers_are_removed_and_files_of_the_living_are_not() {
        let folder = tempfile::tempdir().expect("a folder");
        let target = folder.path().join("metrics.json");
        let leftover = folder.path().join(".metrics.json.abcdef.ratelab-tmp");
        fs::write(&leftover, "half").expect("written");
        let first = Unfinished::create(&target).expect("created");
        assert!(!leftover.exists(), "nobody owns it");
        let second = Unfinished::create(&target).expect("created");
        assert_eq!(names_in(folder.path()).len(), 2, "both are owned");
        first.complete().expect("named");
        second.complete().expect("named");
        assert_eq!(names_in(folder.path()), ["metrics.json"]);
    }

    #[test]
    fn a_name_of_any_length_and_spelling_can_be_had() {
        use std::os::unix::ffi::OsStrExt;
        let folder = tempfile::tempdir().expect("a folder");
        for name in ["€".repeat(80).as_bytes(), b"\xff.csv"] {
            let target = folder.path().join(std::ffi::OsStr::from_bytes(name));
            let file = Unfinished::create(&target).expect("created");
            file.complete().expect("named");
            assert!(target.exists());
        }
    }
}
