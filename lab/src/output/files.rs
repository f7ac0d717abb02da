//! The files of a command, all opened before the first is written.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use ratelab_system::file::{Provisional, folder_of, is_same};

use super::{OutputFile, file::OutputKind};
use crate::error::Error;

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
