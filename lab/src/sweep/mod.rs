//! Many runs at once, and their survival.
//!
//! ```text
//! options ──► Sweep ──► cells on all cores ──► summary ──► map, Markdown, SVG, JSON, .rrd
//!                                        └──────────────► CSV
//! ```

pub mod by_age;
pub mod cliff;
pub mod columns;
pub mod csv;
pub mod json;
pub mod map;
pub mod options;
pub mod record;
pub mod summary;
pub mod svg;
pub mod theory;
