//! Numbers in their units, and numbers drawn for a learner.

/// A unit: a multiple of the base unit of a quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Unit {
    quantity: UnitQuantity,
    /// Its size as a fraction of whole numbers, so that 700 ms are exactly 0.7 s.
    size: (f64, f64),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum UnitQuantity {
    Count,
    Rate,
    Time,
    /// A quantity without exercises.
    Other,
}

/// The names of each unit, its quantity and its size.
const UNITS: [(&str, UnitQuantity, (f64, f64)); 9] = [
    ("hz hertz", UnitQuantity::Rate, (1.0, 1.0)),
    ("khz", UnitQuantity::Rate, (1e3, 1.0)),
    ("s sec secs second seconds", UnitQuantity::Time, (1.0, 1.0)),
    (
        "ms msec millisecond milliseconds",
        UnitQuantity::Time,
        (1.0, 1e3),
    ),
    (
        "us µs microsecond microseconds",
        UnitQuantity::Time,
        (1.0, 1e6),
    ),
    ("min minute minutes", UnitQuantity::Time, (60.0, 1.0)),
    ("h hour hours", UnitQuantity::Time, (3_600.0, 1.0)),
    (
        "run runs start starts message messages",
        UnitQuantity::Count,
        (1.0, 1.0),
    ),
    (OTHERS, UnitQuantity::Other, (1.0, 1.0)),
];

/// The names of units of quantities without exercises.
const OTHERS: &str = "m cm mm km kg g deg degrees rad % percent ° rpm fps steps";

impl Unit {
    /// Finds the unit called `name`, in letters of any case; an empty name is a count.
    pub(super) fn named(name: &str) -> Option<Self> {
        let name = name.to_lowercase();
        let mut units = UNITS.into_iter();
        let (_, quantity, size) = match &*name {
            "" => ("", UnitQuantity::Count, (1.0, 1.0)),
            name => units.find(|(names, ..)| names.split(' ').any(|of| of == name))?,
        };
        Some(Self { quantity, size })
    }

    /// Converts `number` from this unit to another; `None` for another quantity.
    pub(super) fn convert(self, number: f64, to: Self) -> Option<f64> {
        let (many, parts) = (self.size.0 * to.size.1, self.size.1 * to.size.0);
        (self.quantity == to.quantity).then(|| number * many / parts)
    }
}

/// Returns `number` with its `unit`, which may be empty.
pub(super) fn in_unit(number: f64, unit: &str) -> String {
    let unit = match unit {
        "messages" if number == 1.0 => "message",
        unit => unit,
    };
    format!("{number} {unit}").trim_end().to_owned()
}

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
