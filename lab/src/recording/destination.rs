//! Which file a recording goes to.

use std::path::{Path, PathBuf};

use ratelab::experiment::Config;

/// Folder of recordings that were given no name.
const FOLDER: &str = "recordings";

/// Where recordings go: to a file of that name, or to one named after the run.
/// Files that exist are never written to.
#[derive(Clone, Debug, Default)]
pub struct Destination {
    named: Option<PathBuf>,
    /// Whether the name was used.
    used: bool,
}

impl Destination {
    /// To `file`, or to where a run without a name goes.
    pub fn new(file: Option<PathBuf>) -> Self {
        Self {
            named: file,
            used: false,
        }
    }

    /// The file for the next recording of a run of `config`. A name that was
    /// used once is numbered from then on.
    pub fn next(&mut self, config: &Config) -> PathBuf {
        match &self.named {
            Some(file) if !std::mem::replace(&mut self.used, true) => file.clone(),
            Some(file) => free(file),
            None => free(&Path::new(FOLDER).join(name(config))),
        }
    }
}

/// A name after when and what is run, such as
/// `2026-03-14T15-09-26_virtual_50Hz_seed0.rrd`.
fn name(config: &Config) -> String {
    let now = jiff::Zoned::now().strftime("%Y-%m-%dT%H-%M-%S");
    let hz = config.control_hz.get();
    format!("{now}_{}_{hz}Hz_seed{}.rrd", config.clock, config.seed)
}

/// `file`, or the first of `file-2`, `file-3` and so on that does not exist.
fn free(file: &Path) -> PathBuf {
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    let extension = file.extension().unwrap_or_default().to_string_lossy();
    let numbered = (2_u32..).map(|n| file.with_file_name(format!("{stem}-{n}.{extension}")));
    let mut names = std::iter::once(file.to_owned()).chain(numbered);
    names
        .find(|name| name.symlink_metadata().is_err())
        .unwrap_or_else(|| file.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_that_is_taken_is_numbered() {
        let folder = tempfile::tempdir().expect("folder");
        let file = folder.path().join("run.rrd");
        let mut destination = Destination::new(Some(file.clone()));
        let config = Config::default();
        assert_eq!(destination.next(&config), file);
        std::fs::write(&file, "").expect("written");
        let second = folder.path().join("run-2.rrd");
        assert_eq!(destination.next(&config), second);
        std::fs::write(&second, "").expect("written");
        assert_eq!(destination.next(&config), folder.path().join("run-3.rrd"));
    }

    #[test]
    fn a_run_without_a_name_is_named_after_what_it_is() {
        let path = Destination::default().next(&Config::default());
        let name = path.to_string_lossy();
        assert!(name.starts_with("recordings/20"), "{name}");
        assert!(name.ends_with("_virtual_50Hz_seed0.rrd"), "{name}");
    }
}
