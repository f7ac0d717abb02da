//! Resolution of paths.

use std::{
    fs, io,
    os::unix::fs::MetadataExt,
    path::{Path, PathBuf, is_separator},
};

/// Resolves all links in `path`; the file need not exist yet.
///
/// # Errors
/// If it cannot be a file, or its folder does not exist.
pub fn resolved(path: &Path) -> io::Result<PathBuf> {
    let named_as_folder = path.to_string_lossy().ends_with(is_separator);
    match fs::metadata(path) {
        Ok(about) if about.is_dir() => return Err(io::ErrorKind::IsADirectory.into()),
        _ if named_as_folder => return Err(io::ErrorKind::IsADirectory.into()),
        Err(why) if why.kind() != io::ErrorKind::NotFound => return Err(why),
        _ => {}
    }
    let mut path = path.to_owned();
    while let Ok(target) = fs::read_link(&path) {
        path = folder_of(&path).join(target);
    }
    let name = path.file_name().ok_or(io::ErrorKind::NotFound)?;
    Ok(fs::canonicalize(folder_of(&path))?.join(name))
}

/// Returns the folder that the file at `path` is in.
pub fn folder_of(path: &Path) -> &Path {
    let folder = path.parent().filter(|folder| *folder != Path::new(""));
    folder.unwrap_or(Path::new("."))
}

/// Returns whether both paths lead to one file.
pub fn is_same(one: &Path, other: &Path) -> bool {
    let linked = || {
        let both = one.is_file() && other.is_file();
        both && same_file::is_same_file(one, other).unwrap_or(false)
    };
    match (resolved(one), resolved(other)) {
        (Ok(first), Ok(second)) => first == second || linked(),
        _ => false,
    }
}

/// Returns whether the file at `path` has other names (hard links), which a new file in its place
/// would leave behind.
pub fn has_other_names(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|about| about.is_file() && about.nlink() > 1)
}
