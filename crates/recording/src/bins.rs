//! Bins of the latency histogram, on the screen and in recordings.

/// Number of bins.
pub const BINS: usize = 24;

/// Available widths (ms).
const WIDTHS_MS: [u64; 10] = [1, 2, 5, 10, 20, 50, 100, 200, 500, WIDEST_MS];

/// The largest width (ms).
pub const WIDEST_MS: u64 = 1000;

/// The narrowest width (ms) that `fits`, or else the widest.
pub fn width_ms(fits: impl Fn(u64) -> bool) -> u64 {
    let mut widths = WIDTHS_MS.into_iter();
    widths.find(|width| fits(*width)).unwrap_or(WIDEST_MS)
}
