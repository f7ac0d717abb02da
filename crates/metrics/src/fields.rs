//! Payloads as rows of numbers, for tables and records.

/// A payload that can be written as numbers and read back bit for bit.
///
/// A log of a topic uses this to write any payload without knowing its type. A number has one field,
/// `value`:
///
/// ```
/// use ratelab_metrics::Fields;
///
/// assert_eq!(f64::FIELDS, ["value"]);
/// assert_eq!(f64::from_row(&[-0.5]), Some(-0.5));
/// assert_eq!(f32::from_row(&[0.1]), None, "0.1 is not an f32");
/// assert_eq!(u8::from_row(&[7.0]), Some(7));
/// assert_eq!(u8::from_row(&[256.0]), None);
/// assert_eq!(i32::from_row(&[1.0, 2.0]), None);
/// ```
pub trait Fields: Sized {
    /// Names of the numbers, with units where they have one.
    const FIELDS: &'static [&'static str];

    /// Appends the numbers to `row`, in the order of [`Fields::FIELDS`].
    fn append_to(&self, row: &mut Vec<f64>);

    /// Builds the payload from these numbers; `None` if they form no valid payload.
    fn from_row(row: &[f64]) -> Option<Self>;
}

/// A number is a payload with one field; integers up to 32 bits, which a double holds exactly.
macro_rules! number {
    ($($number:ty)+) => {$(
        impl Fields for $number {
            const FIELDS: &'static [&'static str] = &["value"];

            fn append_to(&self, row: &mut Vec<f64>) {
                row.push(f64::from(*self));
            }

            fn from_row(row: &[f64]) -> Option<Self> {
                let &[value] = row else {
                    return None;
                };
                let number = value as $number;
                (f64::from(number).to_bits() == value.to_bits()).then_some(number)
            }
        }
    )+};
}

number!(f64 f32 i8 i16 i32 u8 u16 u32);

/// Implements [`Fields`](crate::Fields) for a struct whose fields are all `f64`:
/// with the name of each in tables, and its unit.
///
/// ```
/// use ratelab_metrics::{Fields, fields};
///
/// #[derive(Debug, PartialEq)]
/// struct Wheels {
///     left: f64,
///     right: f64,
/// }
/// fields!(Wheels { left: "left (rad/s)", right: "right (rad/s)" });
///
/// assert_eq!(Wheels::FIELDS, ["left (rad/s)", "right (rad/s)"]);
/// let wheels = Wheels::from_row(&[1.0, 2.0]);
/// assert_eq!(wheels, Some(Wheels { left: 1.0, right: 2.0 }));
/// ```
#[macro_export]
macro_rules! fields {
    ($payload:ident { $($field:ident: $name:literal),+ $(,)? }) => {
        impl $crate::Fields for $payload {
            const FIELDS: &'static [&'static str] = &[$($name),+];

            fn append_to(&self, row: &mut Vec<f64>) {
                row.extend([$(self.$field),+]);
            }

            fn from_row(row: &[f64]) -> Option<Self> {
                let &[$($field),+] = row else {
                    return None;
                };
                Some(Self { $($field),+ })
            }
        }
    };
}
