//! Units of predictions.

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
