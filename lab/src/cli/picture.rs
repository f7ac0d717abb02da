//! What a picture can be asked for.

use std::path::PathBuf;

use clap::{
    Args,
    builder::{PathBufValueParser, TypedValueParser},
};
use ratatui::layout::Size;
use ratelab::Time;
use ratelab_screen::Look;

use super::{GraphArgs, graph_file, heading, values};

/// What is drawn, and how.
#[derive(Debug, Args)]
pub struct PictureArgs {
    /// The recording; without one, a run of the virtual clock with the options of the
    /// graph.
    #[arg(value_name = "FILE", value_parser = PathBufValueParser::new().try_map(graph_file::recording))]
    pub file: Option<PathBuf>,

    /// Run time (s) [default: the end of the recording, or 10]
    #[arg(long, value_name = "S", value_parser = values::duration, allow_hyphen_values = true, help_heading = heading::SCREEN)]
    pub at: Option<Time>,

    /// Draw the recording up to that moment as a moving picture, at this speed of its run
    /// time, such as 0.2.
    #[arg(long, value_name = "SPEED", num_args = 0..=1, default_missing_value = "1", requires = "file", value_parser = values::pace, allow_hyphen_values = true, help_heading = heading::SCREEN)]
    pub animate: Option<f64>,

    /// Colours for a dark background, a light one, or of high contrast.
    #[arg(long, value_enum, value_name = "THEME", default_value_t, help_heading = heading::SCREEN)]
    pub theme: Look,

    /// Columns and rows, 40x12 to 400x200.
    #[arg(long, value_name = "WxH", default_value = "120x35", value_parser = values::size, help_heading = heading::SCREEN)]
    pub size: Size,

    /// Draw with ASCII characters only.
    #[arg(long, help_heading = heading::SCREEN)]
    pub ascii: bool,

    /// Show the limits of the push age, which the course hides until a learner has
    /// predicted them.
    #[arg(long, help_heading = heading::SCREEN)]
    pub limits: bool,

    /// The picture to write.
    #[arg(short, long, value_name = "FILE", default_value = "lab.svg")]
    pub output: PathBuf,

    /// The graph.
    #[command(flatten)]
    pub graph: GraphArgs,
}
