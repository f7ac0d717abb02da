//! The files of a command, all opened before the first is written, and what kinds there are.

use std::{
    fs::{self, File},
    io::{self, Read, Write},
    path::{Path, PathBuf},
};

use ratelab_system::file::{
    Provisional, Unfinished, check_writable, folder_of, has_other_names, is_same, read, resolved,
};

use super::{
    pipe::{Live, PatientFile, must_be_live},
    print::write_error,
};
use crate::{error::Error, trace::is_trace};

/// A file of results: a regular file is replaced when it is complete; pipes, devices, files with
/// several names (hard links) and files in read-only folders are written into.
pub struct OutputFile {
    path: PathBuf,
    target: Target,
}

enum Target {
    Whole(Unfinished),
    Live(Live),
}

impl OutputFile {
    /// Opens the file at `path`, which `option` named, without changing its content.
    ///
    /// # Errors
    /// [`Error::BadInput`] if it is not writable.
    pub fn open(option: &str, path: &Path) -> Result<Self, Error> {
        Self::at(path).map_err(|why| Error::unwritable(option, path, &why))
    }

    /// Opens the file at `path` without changing its content.
    ///
    /// # Errors
    /// The error of the operating system.
    pub fn at(path: &Path) -> io::Result<Self> {
        let (target, path) = (Target::to(path)?, path.to_owned());
        Ok(Self { path, target })
    }

    /// Returns the file to write to, emptied.
    ///
    /// # Errors
    /// [`Error::Write`] with the error of the operating system.
    pub fn begin(&mut self) -> Result<PatientFile, Error> {
        let file = match &mut self.target {
            Target::Whole(file) => file.writer().map(PatientFile),
            Target::Live(file) => file.begin(),
        };
        file.map_err(|why| write_error(&self.path, why))
    }

    /// Gives the file its final name if everything was `written`.
    ///
    /// # Errors
    /// [`Error::Write`] with the cause.
    pub fn complete<T>(self, written: io::Result<T>) -> Result<T, Error> {
        let named = written.and_then(|written| match self.target {
            Target::Whole(file) => file.complete().map(|()| written),
            Target::Live(_) => Ok(written),
        });
        named.map_err(|why| write_error(&self.path, why))
    }

    /// Writes all of the file.
    ///
    /// # Errors
    /// [`Error::Write`] with the cause.
    pub fn write(mut self, bytes: &[u8]) -> Result<(), Error> {
        let written = self.begin()?.write_all(bytes);
        self.complete(written)
    }
}

impl Target {
    fn to(path: &Path) -> io::Result<Self> {
        if must_be_live(path) {
            return Live::open(path).map(Self::Live);
        }
        let target = resolved(path)?;
        check_writable(&target)?;
        if has_other_names(&target) {
            return Live::open(&target).map(Self::Live);
        }
        match Unfinished::create(&target) {
            Err(why) if target.exists() && why.kind() == io::ErrorKind::PermissionDenied => {
                Live::open(&target).map(Self::Live)
            }
            created => created.map(Self::Whole),
        }
    }
}

impl OutputKind<'_> {
    /// Opens the file at `path`, which `option` named, to replace one of this kind only.
    ///
    /// # Errors
    /// [`Error::BadInput`] if nothing can be written there, or there is another file.
    pub fn open(self, option: &str, path: &Path) -> Result<OutputFile, Error> {
        self.check(option, path)?;
        OutputFile::open(option, path)
    }

    /// Writes `bytes` to that file. It is none of the files that are `read`.
    ///
    /// # Errors
    /// As of [`open`](Self::open), and [`Error::Write`] with what went wrong.
    pub fn write(
        self,
        option: &str,
        path: &Path,
        read: &[PathBuf],
        bytes: &[u8],
    ) -> Result<(), Error> {
        if read.iter().any(|read| is_same(path, read)) {
            return Err(Error::BadInput(format!(
                "{option} {}: this is the file that is read: choose another name",
                path.display()
            )));
        }
        self.open(option, path)?.write(bytes)
    }
}

/// Refuses an existing file at `path`, which `option` named; a broken link counts as a file.
///
/// # Errors
/// [`Error::BadInput`] if the file exists.
pub fn refuse_existing(option: &str, path: &Path) -> Result<(), Error> {
    if fs::symlink_metadata(path).is_err() {
        return Ok(());
    }
    Err(Error::BadInput(format!(
        "{option} {}: there is such a file: choose another name",
        path.display()
    )))
}

/// A kind of result. It replaces an earlier file of its kind, and nothing else.
#[derive(Clone, Copy)]
pub enum OutputKind<'a> {
    /// Rows below this header.
    Rows(&'a str),
    /// The figures of runs, as JSON.
    Figures,
    /// A drawing in SVG.
    Drawing,
    /// A page for the browser.
    Page,
    /// A trace for Perfetto.
    Trace,
    /// A recording as MCAP.
    Bag,
    /// Tests with their results, as JUnit has them.
    Tests,
    /// A page of the manual.
    Manual,
}

/// How the files of a kind are known.
struct KindMark<'a> {
    /// Their name, with its article.
    name: &'static str,
    /// Their first bytes.
    beginning: &'a [u8],
    /// What comes soon after that, in files of this program alone.
    mark: &'static str,
}

/// Bytes of a file in which its mark stands.
const SOON: u64 = 1 << 18;

/// The longest trace that is replaced (bytes): it is read as a whole, because what follows the
/// beginning of one may be something else.
const LONGEST: u64 = 1 << 30;

impl OutputKind<'_> {
    /// Refuses an existing file at `path`, which `option` named, that is of another kind.
    /// One that was cut off at its beginning, or is empty, is not.
    ///
    /// # Errors
    /// [`Error::BadInput`] if it is, or cannot be read.
    pub fn check(self, option: &str, path: &Path) -> Result<(), Error> {
        if !path.is_file() || must_be_live(path) {
            return Ok(());
        }
        let is_ours = self.is_file(path);
        if is_ours.map_err(|why| Error::unwritable(option, path, &why))? {
            return Ok(());
        }
        Err(Error::BadInput(format!(
            "{option} {}: there is such a file, and it is not {} of this command: choose another name",
            path.display(),
            self.mark().name
        )))
    }

    /// Returns whether the file at `path` is one of this kind.
    fn is_file(self, path: &Path) -> io::Result<bool> {
        let KindMark {
            beginning, mark, ..
        } = self.mark();
        let mut found = Vec::new();
        File::open(path)?.take(SOON).read_to_end(&mut found)?;
        let Some(rest) = found.strip_prefix(beginning) else {
            return Ok(beginning.starts_with(&found));
        };
        let marked = mark.is_empty() || String::from_utf8_lossy(rest).contains(mark);
        match self {
            Self::Trace => Ok(read(path, LONGEST).is_ok_and(|bytes| is_trace(&bytes))),
            _ => Ok(marked),
        }
    }

    /// Returns how its files are known.
    fn mark(&self) -> KindMark<'_> {
        let (name, beginning, mark): (_, &[u8], _) = match self {
            Self::Rows(header) => ("a CSV file", header.as_bytes(), ""),
            Self::Figures => ("a JSON file", b"{\n  \"", "\"cause_of_end\": \""),
            Self::Drawing => (
                "an SVG file",
                b"<svg xmlns=\"http://www.w3.org/2000/svg\" ",
                "font-family=\"DejaVu Sans Mono, Menlo, Consolas, monospace\"",
            ),
            Self::Page => (
                "a page",
                b"<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n",
                ": recorded runs</title>",
            ),
            Self::Tests => (
                "a JUnit file",
                b"<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuite ",
                "name=\"verdict\">",
            ),
            // The packet that describes the track of the nodes.
            Self::Trace => (
                "a trace",
                b"\x0a\x12\x50\x01\xe2\x03\x0d\x08\x01\x12\x05nodes",
                "",
            ),
            Self::Bag => ("an MCAP file", b"\x89MCAP0\r\n", "ratelab"),
            Self::Manual => (
                "a manual page",
                b".ie \\n(.g .ds Aq \\(aq\n.el .ds Aq '\n.TH ",
                "\"ratelab ",
            ),
        };
        KindMark {
            name,
            beginning,
            mark,
        }
    }
}

/// The files to write, and the files to read.
pub struct OutputPlan<'a> {
    /// The folder of `--out`.
    pub out: Option<&'a Path>,
    /// Name of the metrics file in it.
    pub metrics: &'static str,
    /// The file of `--csv`.
    pub csv: Option<&'a Path>,
    /// The file of `--svg`.
    pub svg: Option<&'a Path>,
    /// The first line of the CSV file.
    pub header: String,
    /// The file of `--record`, if it has a name.
    pub record: Option<&'a Path>,
    /// The files to read, by option.
    pub inputs: Vec<(String, PathBuf)>,
}

impl OutputPlan<'_> {
    /// Refuses files that are written twice, or both written and read, or that contain
    /// something else.
    fn check(&self) -> Result<(), Error> {
        let metrics = self.out.map(|folder| folder.join(self.metrics));
        let inputs = self
            .inputs
            .iter()
            .map(|(option, path)| (option.as_str(), path.as_path(), "reads"));
        let mut taken: Vec<(&str, &Path, &str)> = inputs.collect();
        let rows = OutputKind::Rows(&self.header);
        let outputs = [
            ("--out", metrics.as_deref(), Some(OutputKind::Figures)),
            ("--csv", self.csv, Some(rows)),
            ("--svg", self.svg, Some(OutputKind::Drawing)),
            ("--record", self.record, None),
        ];
        for (option, path, _) in outputs {
            let Some(path) = path else { continue };
            let before = taken.iter().find(|(_, other, _)| is_same(path, other));
            if let Some((other, _, does)) = before {
                return Err(Error::BadInput(format!(
                    "{option} {}: this is the file that {other} {does}: choose another name",
                    path.display()
                )));
            }
            taken.push((option, path, "writes"));
        }
        for (option, path, kind) in outputs {
            if let (Some(path), Some(kind)) = (path, kind) {
                kind.check(option, path)?;
            }
        }
        Ok(())
    }
}

/// Files opened before the run, so that no run is wasted. If they are dropped before they
/// are written, nothing is left behind.
pub struct Outputs {
    metrics: Option<OutputFile>,
    /// The file for rows.
    pub csv: Option<OutputFile>,
    /// The file for a drawing.
    pub svg: Option<OutputFile>,
    /// Dropped last, because the other files are in these folders.
    _folders: NewFolders,
}

impl Outputs {
    /// Opens the requested files without changing any.
    ///
    /// # Errors
    /// [`Error::BadInput`] if one of them is not writable.
    pub fn prepare(plan: &OutputPlan) -> Result<Self, Error> {
        let outputs = Self::beside_csv(plan)?;
        let csv = plan
            .csv
            .map(|path| OutputFile::open("--csv", path))
            .transpose()?;
        Ok(Self { csv, ..outputs })
    }

    /// Opens the requested files, except for rows, which the caller opens.
    ///
    /// # Errors
    /// [`Error::BadInput`] if a file is not writable.
    pub fn beside_csv(plan: &OutputPlan) -> Result<Self, Error> {
        let unwritable = |folder: &Path, why| Error::unwritable("--out", folder, &why);
        let folders = plan.out.map_or(Ok(NewFolders::default()), |folder| {
            NewFolders::leading_to(folder).map_err(|why| unwritable(folder, why))
        })?;
        plan.check()?;
        let metrics = plan.out.map(|folder| {
            let file = OutputFile::at(&folder.join(plan.metrics));
            file.map_err(|why| unwritable(folder, why))
        });
        let svg = plan.svg.map(|path| OutputFile::open("--svg", path));
        Ok(Self {
            metrics: metrics.transpose()?,
            csv: None,
            svg: svg.transpose()?,
            _folders: folders,
        })
    }

    /// Writes `metrics`, if there is a file for them.
    ///
    /// # Errors
    /// [`Error::Write`] with the cause.
    pub fn write(self, metrics: &str) -> Result<(), Error> {
        let Some(file) = self.metrics else {
            return Ok(());
        };
        file.write(format!("{metrics}\n").as_bytes())
    }
}

/// New folders, which are removed again if they stay empty: the last one first.
#[derive(Default)]
pub struct NewFolders(Vec<Provisional>);

impl NewFolders {
    /// Creates `folder` with all that lead to it, unless they are there.
    ///
    /// # Errors
    /// The error of the operating system.
    pub fn leading_to(folder: &Path) -> io::Result<Self> {
        let is_missing = |folder: &&Path| *folder != Path::new("") && !folder.exists();
        let missing: Vec<&Path> = folder.ancestors().take_while(is_missing).collect();
        let mut made = Self::default();
        for folder in missing.into_iter().rev() {
            let (folder, ()) = Provisional::new(folder, |folder| fs::create_dir_all(folder))?;
            made.0.insert(0, folder);
        }
        // Another file may be where the folder should be.
        fs::create_dir_all(folder)?;
        Ok(made)
    }
}

/// Checks that a file can be made at `path`, which `option` named and where there is none; missing
/// folders are no hindrance. Nothing is left of the trial.
///
/// # Errors
/// [`Error::BadInput`] if it cannot be made.
pub fn try_new(option: &str, path: &Path) -> Result<(), Error> {
    let tried = NewFolders::leading_to(folder_of(path)).and_then(|folders| {
        let (file, _) = Provisional::new(path, |path| fs::File::create_new(path))?;
        drop(file);
        drop(folders);
        Ok(())
    });
    tried.map_err(|why| Error::unwritable(option, path, &why))
}
