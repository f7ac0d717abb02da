//! The summary of a run, as text and as JSON. A new figure is a row in each.

pub mod ages;
pub mod json;
pub mod text;
