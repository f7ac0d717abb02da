//! Many runs at once, and their survival.
//!
//! ```text
//! options ──► Sweep ──► cells on all cores ──► summary ──► map, Markdown, SVG, JSON, .rrd
//!                                        └──────────────► CSV
//! ```

pub mod cliff;
pub mod columns;
pub mod data;
pub mod map;
pub mod options;
pub mod record;
pub mod summary;
pub mod svg;
pub mod theory;
