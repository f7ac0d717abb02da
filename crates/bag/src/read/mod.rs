//! Reads bags: files of MCAP or tables of events, alone or in a folder.

mod csv;
mod mcap;
mod schema;
#[cfg(feature = "sqlite")]
mod sqlite;

use std::{
    fs::{self, File},
    io::{self, Read, Seek},
    ops::ControlFlow,
    path::{Path, PathBuf},
};

use thiserror::Error;

use crate::bag::{Bag, Gathering, MAX_MESSAGES, RawMessage};

/// An error while reading a bag.
#[derive(Debug, Error)]
pub enum BagError {
    /// Something else than a bag.
    #[error(
        "{file}: expected a bag: an MCAP file, a folder of them, or a table of events with the \
         columns {columns}; found {found}",
        columns = csv::COLUMNS.join(",")
    )]
    NoBag {
        /// The file.
        file: String,
        /// What is there.
        found: String,
    },
    /// A bag in which nothing is whole.
    #[error("{file}: no message can be read{why}")]
    Empty {
        /// The file.
        file: String,
        /// The first damage.
        why: String,
    },
    /// An error of the operating system.
    #[error("{file}: {why}")]
    Unreadable {
        /// The file.
        file: String,
        /// The error.
        why: io::Error,
    },
    /// A text that does not name an edge.
    #[error("expected an edge between two topics of the bag, such as \"/plan > /cmd\"")]
    NoEdge,
    /// A topic that the bag does not have.
    #[error("the bag has no topic {0}: choose one that ratelab look prints")]
    NoTopic(String),
    /// Somebody asked for a stop.
    #[error("stopped")]
    Stopped,
}

/// What hears how many bytes of all are read, and may stop.
pub type Watch<'a> = &'a mut dyn FnMut(u64, u64) -> ControlFlow<()>;

/// A file as it is read.
struct FileReading<'a> {
    bag: &'a mut Gathering,
    watch: Watch<'a>,
    name: String,
    /// Bytes of the file.
    length: u64,
    /// Bytes of the files before, and of all.
    before: u64,
    all: u64,
    is_stopped: bool,
    refused: u64,
}

impl FileReading<'_> {
    /// Tells that the file is read up to byte `at`.
    fn progress(&mut self, at: u64) -> io::Result<()> {
        if (self.watch)(self.before + at, self.all).is_break() {
            self.is_stopped = true;
            return Err(io::ErrorKind::Interrupted.into());
        }
        Ok(())
    }

    fn damaged(&mut self, what: String) {
        self.bag.damaged(&self.name, what);
    }

    fn add(&mut self, topic: usize, raw: RawMessage) {
        self.refused += u64::from(!self.bag.add(topic, raw));
    }

    /// Returns whether no more messages are kept, which is then noted.
    fn is_full(&mut self, at: u64) -> bool {
        let is_full = self.bag.is_full();
        if is_full {
            self.damaged(format!(
                "more than {MAX_MESSAGES} messages: what is behind byte {at} is left out"
            ));
        }
        is_full
    }
}

/// Reads the bag at `path`, a file or a folder, and tells `watch` how far it is.
///
/// # Errors
/// [`BagError`] for a path without a bag, and for a bag without a whole message.
pub fn read(path: &Path, watch: Watch<'_>) -> Result<Bag, BagError> {
    let name = path.display().to_string();
    let (files, missing) = if path.is_dir() {
        files_of(path)?
    } else {
        (vec![path.to_owned()], Vec::new())
    };
    let mut opened = Vec::new();
    let mut bag = Gathering::default();
    for file in missing {
        bag.damaged(&file, "this file of the bag is missing");
    }
    for file in files {
        let (source, length) = open(&file)?;
        opened.push((file, source, length));
    }
    let all = opened.iter().map(|(.., length)| length).sum();
    let mut before = 0;
    for (file, source, length) in opened {
        bag.begin_file();
        let mut reading = FileReading {
            bag: &mut bag,
            watch: &mut *watch,
            name: file.display().to_string(),
            length,
            before,
            all,
            is_stopped: false,
            refused: 0,
        };
        read_file(source, &mut reading)?;
        before += length;
    }
    let bag = bag.finish();
    if bag.topics.is_empty() {
        let why = bag
            .damage
            .first()
            .map_or(String::new(), |damage| format!(": {}", damage.what));
        return Err(BagError::Empty { file: name, why });
    }
    Ok(bag)
}

/// Opens a regular file: a pipe or a device may block, or never end.
fn open(path: &Path) -> Result<(File, u64), BagError> {
    let unreadable = |why| unreadable(path, why);
    let about = fs::metadata(path).map_err(unreadable)?;
    if !about.is_file() {
        return Err(no_bag(path, "a pipe or a device"));
    }
    let file = File::open(path).map_err(unreadable)?;
    Ok((file, about.len()))
}

fn unreadable(path: &Path, why: io::Error) -> BagError {
    let file = path.display().to_string();
    BagError::Unreadable { file, why }
}

fn no_bag(path: &Path, found: impl Into<String>) -> BagError {
    let (file, found) = (path.display().to_string(), found.into());
    BagError::NoBag { file, found }
}

/// Reads a file by what it begins with.
fn read_file(mut source: File, reading: &mut FileReading<'_>) -> Result<(), BagError> {
    const HEAD: u64 = 4_096;
    let path = PathBuf::from(&reading.name);
    let mut head = Vec::new();
    source
        .by_ref()
        .take(HEAD)
        .read_to_end(&mut head)
        .and_then(|_| source.rewind())
        .map_err(|why| unreadable(&path, why))?;
    let read = if mcap::is_mcap(&head) {
        mcap::read(&mut source, reading)
    } else if csv::is_table(&head) {
        csv::read(&mut source, reading)
    } else if let Some(read) = from_sqlite(&head, reading) {
        read
    } else {
        return Err(no_bag(&path, found(&head, reading.length)));
    };
    if reading.is_stopped {
        return Err(BagError::Stopped);
    }
    if reading.refused > 0 {
        let count = reading.refused;
        reading.damaged(format!(
            "{count} messages are left out: times that cannot be, or too many messages"
        ));
    }
    read.map_err(|why| unreadable(&path, why))
}

/// Reads a file of SQLite, if `head` is of one.
#[cfg(feature = "sqlite")]
fn from_sqlite(head: &[u8], reading: &mut FileReading<'_>) -> Option<io::Result<()>> {
    head.starts_with(SQLITE).then(|| sqlite::read(reading))
}

/// Reads no file of SQLite without the feature.
#[cfg(not(feature = "sqlite"))]
fn from_sqlite(_: &[u8], _: &mut FileReading<'_>) -> Option<io::Result<()>> {
    None
}

/// What a file of SQLite begins with.
const SQLITE: &[u8] = b"SQLite format 3\0";

/// Returns what a file is instead of a bag.
fn found(head: &[u8], length: u64) -> String {
    if head.starts_with(SQLITE) {
        return "an SQLite file: build ratelab with --features sqlite, or ros2 bag convert makes an \
                MCAP file of it"
            .to_owned();
    }
    if head.starts_with(b"#ROSBAG V2.0") {
        return "a bag of ROS 1: mcap convert makes an MCAP file of it".to_owned();
    }
    format!("{length} bytes of something else")
}

/// Returns the files of the bag in `folder`, in the order of its metadata or else of their names,
/// and those that are missing.
fn files_of(folder: &Path) -> Result<(Vec<PathBuf>, Vec<String>), BagError> {
    const MOST: u64 = 16 << 20;
    let mut listed = Vec::new();
    if let Ok((file, _)) = open(&folder.join("metadata.yaml")) {
        let mut text = String::new();
        let read = file.take(MOST).read_to_string(&mut text);
        read.map_err(|why| unreadable(folder, why))?;
        listed = listed_files(&text);
    }
    let (mut files, mut missing) = (Vec::new(), Vec::new());
    for name in listed {
        // Only names within the folder.
        let file = Path::new(&name).file_name().map(|name| folder.join(name));
        match file {
            Some(file) if file.is_file() => files.push(file),
            _ => missing.push(name),
        }
    }
    if files.is_empty() {
        let entries = fs::read_dir(folder).map_err(|why| unreadable(folder, why))?;
        let paths = entries.flatten().map(|entry| entry.path());
        let is_bag = |path: &PathBuf| {
            let ending = path.extension().and_then(|ending| ending.to_str());
            path.is_file() && matches!(ending, Some("mcap" | "csv" | "db3"))
        };
        files = paths.filter(is_bag).collect();
        files.sort();
    }
    if files.is_empty() {
        return Err(no_bag(folder, "a directory without bags in it"));
    }
    Ok((files, missing))
}

/// Returns the files that a `metadata.yaml` lists.
fn listed_files(text: &str) -> Vec<String> {
    let items = text
        .lines()
        .map(str::trim)
        .skip_while(|line| *line != "relative_file_paths:")
        .skip(1)
        .map_while(|line| line.strip_prefix("- "));
    items
        .map(|item| item.trim().trim_matches(['"', '\'']))
        .map(str::to_owned)
        .collect()
}
