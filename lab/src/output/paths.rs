//! Resolution of paths.

use std::{
    fs, io,
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

fn folder_of(path: &Path) -> &Path {
    let folder = path.parent().filter(|folder| *folder != Path::new(""));
    folder.unwrap_or(Path::new("."))
}

/// Whether both paths lead to one file.
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

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

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
}
