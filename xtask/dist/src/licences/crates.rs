//! The crates linked into the program, with their licences in one file.

use std::{
    collections::BTreeSet,
    env,
    fmt::Write,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use cargo_metadata::{Metadata, MetadataCommand, Package};

use super::standard;
use crate::{Error, Machine, platform::said, program::PACKAGE, share::names};

/// Depth of the search below a crate's folder: some crates contain C libraries with
/// licences of their own.
const DEPTH: usize = 4;

/// Minimum length of a licence text (bytes): shorter files only name a licence.
const SHORTEST: usize = 400;

/// Beginnings of names of licence files, in lower case.
const NAMES: [&str; 6] = [
    "license",
    "licence",
    "copying",
    "copyright",
    "notice",
    "unlicense",
];

const HEAD: &str = "\
The crates in the program ratelab. Of each: its name and version, its licence, its
authors, where its source is, and the numbers of its texts, which follow below. All
texts that a crate brings are here, also those of parts of it that the program leaves
out. A text is a standard one where the crate brings none.
";

/// Returns the list of all crates in the program for this machine, followed by the licence texts,
/// without duplicates.
///
/// # Errors
/// If cargo fails, or a crate has no licence.
pub fn list(machine: &Machine) -> Result<String, Error> {
    let mut texts: Vec<String> = Vec::new();
    let mut page = format!("{HEAD}\n");
    for package in linked(machine)? {
        let mut numbers = BTreeSet::new();
        for text in texts_of(&package, &machine.root)? {
            let known = texts.iter().position(|known| *known == text);
            numbers.insert(known.unwrap_or(texts.len()) + 1);
            if known.is_none() {
                texts.push(text);
            }
        }
        page += &entry(&package, &numbers);
    }
    for (number, text) in (1..).zip(texts) {
        let line = "=".repeat(30);
        let _ = write!(page, "\n{line} {number} {line}\n\n{text}\n");
    }
    Ok(page)
}

fn entry(package: &Package, numbers: &BTreeSet<usize>) -> String {
    let Package { name, version, .. } = package;
    let numbers: Vec<_> = numbers.iter().map(usize::to_string).collect();
    let source = match &package.source {
        Some(_) => format!("https://crates.io/crates/{name}/{version}"),
        None => "part of ratelab".to_owned(),
    };
    let licence = package.license.as_deref().unwrap_or("as in its text");
    format!(
        "{name} {version} | {licence} | {} | {source} | {}\n",
        package.authors.join(", "),
        numbers.join(" ")
    )
}

/// Returns the version of the rerun viewer for the recordings: that of the crate.
///
/// # Errors
/// If cargo fails.
pub fn viewer(machine: &Machine) -> Result<String, Error> {
    let metadata = metadata(machine)?;
    let rerun = metadata.packages.iter().find(|p| p.name == "rerun");
    rerun
        .map(|package| package.version.to_string())
        .ok_or_else(|| Error::silent("cargo metadata", "version of rerun"))
}

fn metadata(machine: &Machine) -> Result<Metadata, Error> {
    let mut command = MetadataCommand::new();
    let target = format!("--filter-platform={}", machine.target);
    command.manifest_path(machine.root.join("Cargo.toml"));
    command.other_options(["--locked".to_owned(), target]);
    Ok(command.exec()?)
}

/// Returns the metadata covers all crates of the workspace; the tree covers the crates of this
/// program.
fn linked(machine: &Machine) -> Result<Vec<Package>, Error> {
    let tree = tree(machine).ok_or_else(|| Error::silent("cargo tree", "crates"))?;
    let in_tree: BTreeSet<_> = tree.lines().filter_map(name_and_version).collect();
    let mut packages = metadata(machine)?.packages;
    packages.retain(|p| in_tree.contains(&(p.name.as_str(), &*p.version.to_string())));
    packages.sort_by(|a, b| (&a.name, &a.version).cmp(&(&b.name, &b.version)));
    Ok(packages)
}

/// Crates that only run during compilation are excluded, because they are not part of the
/// program.
fn tree(machine: &Machine) -> Option<String> {
    let cargo = env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut tree = Command::new(cargo);
    tree.args(["tree", "--locked"])
        .args(PACKAGE)
        .args(["--target", &machine.target, "--prefix", "none"])
        .args(["--edges", "normal,no-proc-macro"])
        .current_dir(&machine.root);
    said(&mut tree)
}

/// Parses a line such as `serde v1.0.0 (*)`.
fn name_and_version(line: &str) -> Option<(&str, &str)> {
    let mut words = line.split_whitespace();
    Some((words.next()?, words.next()?.strip_prefix('v')?))
}

/// Returns the texts in `package`, or else standard ones. The crates of this workspace share one.
fn texts_of(package: &Package, root: &Path) -> Result<Vec<String>, Error> {
    let mut files = Vec::new();
    match (&package.source, package.manifest_path.parent()) {
        (Some(_), Some(folder)) => find(folder.as_std_path(), DEPTH, &mut files)?,
        _ => files.push(root.join("LICENSE")),
    }
    files.extend(package.license_file().map(PathBuf::from));
    let read = |file: &PathBuf| fs::read(file).map_err(Error::io("read", file));
    let texts: Vec<_> = files.iter().map(read).collect::<Result<_, _>>()?;
    let text = |bytes: &Vec<u8>| plain(&String::from_utf8_lossy(bytes));
    let mut texts: Vec<_> = texts.iter().map(text).collect();
    if texts.iter().all(|text| text.len() < SHORTEST) {
        let expression = package.license.clone().unwrap_or_default();
        let standard = standard(&expression)
            .filter(|texts| !texts.is_empty())
            .ok_or_else(|| {
                let (name, unknown) = (&package.name, "is not known by SPDX");
                let why = format!("no licence text is in the crate, and {expression:?} {unknown}");
                Error::Unfit(format!("{name}: {why}"))
            })?;
        texts.extend(standard.into_iter().map(plain));
    }
    Ok(texts)
}

/// Returns the text with normalised line endings.
fn plain(text: &str) -> String {
    text.replace("\r\n", "\n")
        .trim_matches('\n')
        .trim_end()
        .to_owned()
}

/// Collects the licence files below `folder`.
fn find(folder: &Path, depth: usize, found: &mut Vec<PathBuf>) -> Result<(), Error> {
    for name in names(folder)? {
        let path = folder.join(&name);
        if path.is_dir() {
            if depth > 0 {
                find(&path, depth - 1, found)?;
            }
        } else if is_licence(&name) {
            found.push(path);
        }
    }
    Ok(())
}

fn is_licence(name: &str) -> bool {
    let name = name.to_lowercase();
    let is_code = [".rs", ".c", ".h", ".py", ".sh", ".toml", ".json"];
    NAMES.iter().any(|begin| name.starts_with(begin))
        && !is_code.iter().any(|end| name.ends_with(end))
}
