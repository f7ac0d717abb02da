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
pub mod figures;
pub mod json;
pub mod map;
pub mod markdown;
pub mod options;
pub mod parts;
pub mod record;
pub mod summary;
pub mod svg;
pub mod theory;
