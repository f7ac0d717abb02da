//! A fresh clone with a target folder of its own, gone when it was measured and
//! when a step failed. What Ctrl-C breaks off is left in the system's folder for
//! temporary files: a handler is not worth a crate that every build would wait for.

use std::{
    env,
    ffi::OsStr,
    fs,
    path::{Path, PathBuf},
    process::{self, Command},
};

use xtask::mujoco::{DYNAMIC_LINK_DIR, Source};

/// The clone, and how to run something in it.
pub(super) struct Fresh {
    folder: PathBuf,
    /// Whether builds link a library of the user's own.
    own_library: bool,
}

impl Fresh {
    /// Names a folder; nothing is in it yet.
    pub(super) fn of(root: &Path) -> Self {
        let name = format!("ratelab-costs-{}", process::id());
        Self {
            folder: env::temp_dir().join(name),
            own_library: Source::of_build(&root.join("xtask/mujoco")) != Source::Fetched,
        }
    }

    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    pub(super) fn target(&self) -> PathBuf {
        self.folder.join("target")
    }

    /// A program from here or, if it is `ratelab`, the one that was built.
    pub(super) fn command(&self, program: &str) -> Command {
        let built = self.target().join("debug/ratelab");
        let program = match program {
            "ratelab" => built.as_os_str(),
            other => OsStr::new(other),
        };
        let mut command = Command::new(program);
        command
            .current_dir(&self.folder)
            .env("CARGO_TARGET_DIR", self.target());
        if !self.own_library {
            // cargo set it for this program, to the library of another clone.
            command.env_remove(DYNAMIC_LINK_DIR);
        }
        command
    }
}

impl Drop for Fresh {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.folder);
    }
}
