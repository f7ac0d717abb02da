//! Bins of the latency histogram, on the screen and in recordings.

/// Number of bins.
pub const BINS: usize = 24;

/// Available widths (ms).
const WIDTHS_MS: [u64; 10] = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];

/// Returns the narrowest width (ms) that `fits`, or else the widest.
pub fn width_ms(fits: impl Fn(u64) -> bool) -> u64 {
    let place = WIDTHS_MS.iter().position(|width| fits(*width));
    WIDTHS_MS[place.unwrap_or(WIDTHS_MS.len() - 1)]
}
