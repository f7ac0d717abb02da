//! The figures of a run, as text and as JSON. A new one is a row in each.

pub mod metrics;
pub mod report;
