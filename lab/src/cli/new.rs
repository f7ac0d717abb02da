//! The arguments of a new graph file.

use std::path::PathBuf;

use clap::Args;

/// The file to write, or the schema.
#[derive(Debug, Args)]
pub struct NewArgs {
    /// The graph file, which must be new and end in .toml.
    #[arg(value_name = "GRAPH", required_unless_present = "schema")]
    pub file: Option<PathBuf>,

    /// Print the JSON Schema of graph files, with which editors complete them.
    #[arg(long, conflicts_with = "file")]
    pub schema: bool,
}
