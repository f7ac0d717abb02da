//! The arguments of a page for the browser.

use std::path::PathBuf;

use clap::Args;

/// The recordings, and the page.
#[derive(Debug, Args)]
pub struct ExportWebArgs {
    /// The recordings. Of several a slider chooses, in the order of the setting in which
    /// they differ.
    #[arg(value_name = "FILE", required = true)]
    pub files: Vec<PathBuf>,

    /// The page to write.
    #[arg(short, long, value_name = "FILE", default_value = "runs.html")]
    pub output: PathBuf,
}
