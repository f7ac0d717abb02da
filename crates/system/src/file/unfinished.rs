//! Files that get their final names when they are complete.
//!
//! Until then they have a hidden name beside the result, such as
//! `.metrics.json.x7Kq2P.ratelab-tmp`, and a lock that the operating system releases when
//! the program ends for any reason. A hidden file without a lock is therefore a leftover,
//! and the next run that writes to the folder removes it.

use std::{
    fs::{self, File, Permissions, TryLockError},
    io::{self, Write},
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
    sync::Mutex,
};

use ratelab::sync::lock;
use tempfile::{Builder, NamedTempFile};

use super::{TextError, folder_of, has_other_names, read_text_if_there, resolved};

/// Suffix of the hidden names.
const SUFFIX: &str = ".ratelab-tmp";

/// Number of characters from the result's name in the hidden one, whose length is
/// limited.
const LONGEST_STEM: usize = 40;

/// What this process has made and not completed, in the order in which it was made: files by
/// their hidden or final names, and folders.
static NAMES: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// A file without its final name. If it is dropped before that, it is removed.
pub struct Unfinished {
    file: NamedTempFile,
    target: PathBuf,
}

impl Unfinished {
    /// Creates a file that will become `target`; an existing `target` stays unchanged
    /// until then.
    ///
    /// # Errors
    /// The error of the operating system for the folder.
    pub fn create(target: &Path) -> io::Result<Self> {
        let folder = target.parent().unwrap_or(Path::new("/"));
        remove_leftovers(folder);
        let mut names = lock(&NAMES);
        let file = hidden(target, folder)?;
        names.push(file.path().to_owned());
        drop(names);
        if let Ok(about) = target.metadata() {
            file.as_file().set_permissions(about.permissions())?;
        }
        let target = target.to_owned();
        Ok(Self { file, target })
    }

    /// Returns a handle for writing.
    ///
    /// # Errors
    /// The error of the operating system.
    pub fn writer(&self) -> io::Result<File> {
        self.file.as_file().try_clone()
    }

    /// Gives it its final name, in place of an existing file.
    ///
    /// # Errors
    /// The error of the operating system.
    pub fn complete(self) -> io::Result<()> {
        let persisted = self.file.persist(self.target);
        persisted.map(drop).map_err(|error| error.error)
    }
}

/// A new file or folder under its final name. If it is dropped before it is [kept](Self::keep), or
/// the program ends at once before that, it is removed; a folder with files in it stays.
#[derive(Debug)]
pub struct Provisional(PathBuf);

impl Provisional {
    /// Lets `make` make what is to be at `path`, and returns that as well.
    ///
    /// # Errors
    /// The error of `make`: it must refuse a path where something is already.
    pub fn new<T>(path: &Path, make: impl FnOnce(&Path) -> io::Result<T>) -> io::Result<(Self, T)> {
        let mut names = lock(&NAMES);
        let made = make(path)?;
        names.push(path.to_owned());
        Ok((Self(path.to_owned()), made))
    }

    /// Keeps it.
    pub fn keep(self) {
        lock(&NAMES).retain(|name| *name != self.0);
    }
}

impl Drop for Provisional {
    fn drop(&mut self) {
        let mut names = lock(&NAMES);
        let before = names.len();
        names.retain(|name| *name != self.0);
        if names.len() < before {
            remove(&self.0);
        }
    }
}

/// Removes the file or the empty folder at `path`, if it is still there.
fn remove(path: &Path) {
    let _ = fs::remove_file(path).or_else(|_| fs::remove_dir(path));
}

/// Checks that a file at `path` may be replaced: the folder decides whether it
/// can be.
///
/// # Errors
/// The error of the operating system, and one for a read-only file, which whoever may do
/// everything could write to as well.
pub fn check_writable(path: &Path) -> io::Result<()> {
    let Ok(about) = path.metadata() else {
        return Ok(());
    };
    if about.permissions().readonly() {
        let why = "this file is read-only";
        return Err(io::Error::new(io::ErrorKind::PermissionDenied, why));
    }
    File::options().write(true).open(path).map(drop)
}

/// Removes all that is unfinished before an immediate exit. No file is created while the
/// caller keeps the result.
pub fn remove_unfinished() -> impl Sized {
    let names = lock(&NAMES);
    // A folder is older than the files in it.
    names.iter().rev().for_each(|name| remove(name));
    names
}

/// Returns a locked file with a hidden name beside `target`.
fn hidden(target: &Path, folder: &Path) -> io::Result<NamedTempFile> {
    let name = target.file_name().unwrap_or_default().to_string_lossy();
    let stem: String = name.chars().take(LONGEST_STEM).collect();
    loop {
        let file = Builder::new()
            .prefix(&format!(".{stem}."))
            .suffix(SUFFIX)
            // The permissions of any new file: the umask still applies.
            .permissions(Permissions::from_mode(0o666))
            .tempfile_in(folder)?;
        // Another process that removes leftovers may have been faster than the lock. On a
        // file system without locks leftovers are never removed.
        if file.as_file().lock().is_err() || file.path().exists() {
            return Ok(file);
        }
    }
}

/// Removes leftovers of killed processes in `folder`.
fn remove_leftovers(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let file = entry.file_name();
        let name = file.to_string_lossy();
        let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
        if name.starts_with('.') && name.ends_with(SUFFIX) && is_file {
            remove_unowned(&entry.path());
        }
    }
}

/// Removes the file at `path` unless a running process has locked it.
fn remove_unowned(path: &Path) {
    let Ok(file) = File::open(path) else {
        return;
    };
    match file.try_lock() {
        // Locked during the removal: see `hidden`.
        Ok(()) => {
            let _ = fs::remove_file(path); // On failure the next run tries again.
        }
        Err(TryLockError::WouldBlock | TryLockError::Error(_)) => {}
    }
}

/// A text file, or none yet, which no other program changes in this way meanwhile.
pub struct LockedFile {
    /// Its text; `None` if there is no file yet.
    pub text: Option<String>,
    new: Unfinished,
    /// The lock is on the folder: the file itself is another one after each change. The
    /// operating system releases it when this is closed.
    _folder: File,
}

impl LockedFile {
    /// Waits for other programs, and locks the file at `path`, of up to `most` bytes. Creates
    /// missing folders.
    ///
    /// # Errors
    /// [`TextError`] for a file that is not a text, is read-only or has several names (hard links),
    /// and for a folder that cannot be written to.
    pub fn lock(path: &Path, most: u64) -> Result<Self, TextError> {
        fs::create_dir_all(folder_of(path))?;
        let target = resolved(path)?;
        let folder = File::open(folder_of(&target))?;
        // On a file system without locks nobody waits.
        let _ = folder.lock();
        let text = read_text_if_there(&target, most)?;
        check_writable(&target)?;
        if has_other_names(&target) {
            let why = "this file has several names (hard links), and a new version would have one";
            return Err(io::Error::other(why).into());
        }
        Ok(Self {
            text,
            new: Unfinished::create(&target)?,
            _folder: folder,
        })
    }

    /// Replaces its text.
    ///
    /// # Errors
    /// The error of the operating system; the file is then as it was.
    pub fn replace(self, text: &str) -> io::Result<()> {
        self.new.writer()?.write_all(text.as_bytes())?;
        self.new.complete()
    }
}
