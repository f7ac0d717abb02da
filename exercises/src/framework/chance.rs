//! Reproducible chance for exercises that draw their runs.

/// Draws that follow from a seed and a purpose alone (SplitMix64: Steele, Lea and Flood,
/// *Fast splittable pseudorandom number generators*, OOPSLA 2014).
pub(crate) struct SplitMix(u64);

impl SplitMix {
    const GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;

    /// Creates the draws of the learner's number `seed` for item `item` of a `purpose`.
    pub(crate) fn new(seed: u64, purpose: u64, item: u64) -> Self {
        let words = [seed, purpose, item].into_iter();
        Self(words.fold(0, |state, word| Self(state ^ word).next()))
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(Self::GAMMA);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ mixed >> 31
    }

    /// Returns a number within `from` to `to`, uniform.
    pub(crate) fn within(&mut self, from: f64, to: f64) -> f64 {
        let unit = (self.next() >> 11) as f64 / (1_u64 << 53) as f64;
        from + unit * (to - from)
    }

    /// Returns a whole number below `count`, which is small.
    pub(crate) fn below(&mut self, count: usize) -> usize {
        (self.within(0.0, count as f64) as usize).min(count.saturating_sub(1))
    }
}
