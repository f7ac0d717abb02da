//! MuJoCo's library in the clone: a check for it, and its download.
//!
//! It comes from MuJoCo's Python wheel, because pip checks the wheel against a pinned
//! hash and works with the user's index or proxy.

mod error;
mod source;
mod wheel;

use std::fs::{self, File};
use std::io;
use std::path::Path;

pub use error::Error;
pub use source::{DYNAMIC_LINK_DIR, Platform, STATIC_LINK_DIR, Source};

use error::Scratch;
use wheel::Python;

/// The MuJoCo release that mujoco-rs binds.
pub const VERSION: &str = "3.17.0";

/// The checked-in file that pins the wheel's version and hashes.
const REQUIREMENTS: &str = "requirements.txt";

/// The files with licences in MuJoCo's wheel.
const LICENCES: [&str; 2] = ["LICENSE", "LICENSES_THIRD_PARTY.md"];

/// Result of [`ensure`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SetupResult {
    /// The library was present already.
    InPlace,
    /// The library was fetched just now.
    Fetched,
}

/// Ensures that `folder` contains the library for `platform`.
///
/// The library appears there atomically, and several set-ups may run in parallel. If it
/// is present, no network is used.
///
/// # Errors
/// With the cause and a remedy.
pub fn ensure(folder: &Path, platform: &Platform) -> Result<SetupResult, Error> {
    if is_in_place(folder, platform) {
        return Ok(SetupResult::InPlace);
    }
    let requirements = lock(&folder.join(REQUIREMENTS))?;
    // Another process may have fetched it while this one waited for the lock.
    if is_in_place(folder, platform) {
        return Ok(SetupResult::InPlace);
    }
    fetch(folder, platform, &requirements)?;
    Ok(SetupResult::Fetched)
}

/// Returns a file of another size is damaged, and counts as missing. A hash on every build would
/// be too slow, and pip has checked it.
fn is_in_place(folder: &Path, platform: &Platform) -> bool {
    let whole = |place| fs::metadata(folder.join(place)).is_ok_and(|m| m.len() == platform.size);
    platform.places.iter().all(whole)
}

/// Allows one set-up at a time. The operating system releases the lock when its process
/// ends, so a killed set-up blocks no other; the pin itself is the lock file, so no extra
/// file is left.
fn lock(requirements: &Path) -> Result<File, Error> {
    let locked = File::options()
        .read(true)
        .write(true)
        .open(requirements)
        .and_then(|file| file.lock().map(|()| file));
    locked.map_err(Error::io("write to", requirements))
}

fn fetch(folder: &Path, platform: &Platform, requirements: &File) -> Result<(), Error> {
    let scratch = Scratch::new(folder)?;
    let python = Python::find(scratch.path())?;
    let wheel = wheel::download(&python, &folder.join(REQUIREMENTS), platform.tag, &scratch)?;
    let library = wheel::unpack(&python, &wheel, platform.member, &scratch)?;
    check_size(&library, platform)?;
    for place in platform.places {
        let staged = scratch.path().join("staged");
        copy(&library, &staged, requirements).map_err(Error::io("write", &staged))?;
        publish(&staged, &folder.join(place))?;
    }
    Ok(())
}

/// MuJoCo's licence, and the licences of the parts of its package, each with its file name.
///
/// They are in the wheel beside the library and are not kept in `folder`: the wheel is
/// downloaded again, or comes from pip's cache.
///
/// # Errors
/// With the cause and a remedy.
pub fn licences(folder: &Path, platform: &Platform) -> Result<Vec<(&'static str, Vec<u8>)>, Error> {
    let requirements = folder.join(REQUIREMENTS);
    let _lock = lock(&requirements)?;
    let scratch = Scratch::new(folder)?;
    let python = Python::find(scratch.path())?;
    let wheel = wheel::download(&python, &requirements, platform.tag, &scratch)?;
    let licence = |name: &'static str| {
        let member = format!("mujoco-{VERSION}.dist-info/licenses/{name}");
        let file = wheel::unpack(&python, &wheel, &member, &scratch)?;
        let text = fs::read(&file).map_err(Error::io("read", &file))?;
        Ok((name, text))
    };
    LICENCES.into_iter().map(licence).collect()
}

fn check_size(library: &Path, platform: &Platform) -> Result<(), Error> {
    let metadata = fs::metadata(library).map_err(Error::io("read", library))?;
    let (found, wanted) = (metadata.len(), platform.size);
    if found == wanted {
        return Ok(());
    }
    let cause = format!("its library has {found} bytes, not {wanted}.");
    Err(Error::new(cause, error::remedy::SPACE))
}

/// Copies the library, and gives the copy the date of the pin: cargo repeats a build
/// script when a file it watches is newer than the script's last start, so a library
/// fetched by this very run must look older.
fn copy(library: &Path, to: &Path, requirements: &File) -> io::Result<()> {
    fs::copy(library, to)?;
    let date = requirements.metadata()?.modified()?;
    File::options().write(true).open(to)?.set_modified(date)
}

/// Publishes the library with one atomic rename.
fn publish(staged: &Path, place: &Path) -> Result<(), Error> {
    let parent = place.parent().unwrap_or(place);
    fs::create_dir_all(parent).map_err(Error::io("create", parent))?;
    fs::rename(staged, place).map_err(Error::io("write", place))
}
