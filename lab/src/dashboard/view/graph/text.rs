//! Texts of the graph and their widths.

use crate::dashboard::view::pane;

/// Minimum room for text on a line.
pub(super) const NARROW: usize = 13;

/// Length of a dangling edge with its name.
pub(super) fn dangling_width(name: &str) -> usize {
    pane::width(name) + 4
}

/// Length of such a line in `room` columns: with its name, with or without blanks around
/// it, or without.
pub(super) fn dangling(name: &str, room: usize) -> Option<usize> {
    let full = dangling_width(name);
    match room {
        0..2 => None,
        _ if room >= full => Some(full),
        _ if room >= full - 2 => Some(full - 2),
        _ => Some(room.min(4)),
    }
}

/// A count in at most five columns.
pub(super) fn count(count: u64) -> String {
    match count {
        0..100_000 => count.to_string(),
        100_000..10_000_000 => format!("{}k", count / 1_000),
        10_000_000..10_000_000_000 => format!("{}M", count / 1_000_000),
        _ => format!("{}G", (count / 1_000_000_000).min(9_999)),
    }
}
