//! Payloads as rows of numbers, for tables and records.

/// A payload that can be written down as numbers and read back to the bit.
///
/// What keeps a log of a topic learns from this what there is to write, so it
/// need not know the payload.
pub trait Fields: Sized {
    /// What the numbers are: a name each, with its unit where it has one.
    const FIELDS: &'static [&'static str];

    /// Appends the numbers to `row`, in the order of [`Fields::FIELDS`].
    fn append_to(&self, row: &mut Vec<f64>);

    /// The payload with these numbers; `None` if there is no such payload.
    fn from_row(row: &[f64]) -> Option<Self>;
}
