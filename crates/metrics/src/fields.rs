//! Payloads as rows of numbers, for recorders, tables and plots, which are independent of
//! the payload type.

use ratelab::{Head, Message, Time};

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

/// Messages of one topic, each a row with the same number of values.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rows {
    heads: Vec<Head>,
    width: usize,
    values: Vec<f64>,
}

impl Rows {
    /// Creates an empty list; each message will have `width` numbers.
    pub fn new(width: usize) -> Self {
        Self {
            width,
            ..Self::default()
        }
    }

    /// Adds a message. Returns `false` and ignores the message if its number of values is
    /// wrong.
    #[must_use]
    pub fn push(&mut self, head: Head, row: impl IntoIterator<Item = f64>) -> bool {
        let before = self.values.len();
        self.values.extend(row);
        let fits = self.values.len() == before + self.width;
        if fits {
            self.heads.push(head);
        } else {
            self.values.truncate(before);
        }
        fits
    }

    /// Returns the number of messages.
    pub fn len(&self) -> usize {
        self.heads.len()
    }

    /// Returns whether there are no messages.
    pub fn is_empty(&self) -> bool {
        self.heads.is_empty()
    }

    /// Numbers per message.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Returns the messages without their payloads, oldest first.
    pub fn heads(&self) -> &[Head] {
        &self.heads
    }

    /// Returns the numbers of all messages, one after the other.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Returns the numbers of message `index`; empty without such a message.
    pub fn row(&self, index: usize) -> &[f64] {
        let start = index * self.width;
        let row = self.values.get(start..start + self.width);
        row.unwrap_or_default()
    }

    /// Returns all messages, oldest first.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = (&Head, &[f64])> {
        self.heads
            .iter()
            .enumerate()
            .map(|(index, head)| (head, self.row(index)))
    }

    /// Returns the newest message.
    pub fn last(&self) -> Option<(&Head, &[f64])> {
        self.iter().next_back()
    }

    /// Message `index` as it was published; `None` if it does not exist or its payload is
    /// invalid.
    pub fn message<T: Fields>(&self, index: usize) -> Option<Message<T>> {
        let head = self.heads.get(index)?;
        Some(Message::from_head(head, T::from_row(self.row(index))?))
    }

    /// Takes the messages up to the last one that was published by run time `until` out of
    /// these. Those of several publishers may be out of the order of time.
    pub fn take_until(&mut self, until: Time) -> Self {
        let last = self.heads.iter().rposition(|head| head.at <= until);
        let count = last.map_or(0, |last| last + 1);
        let later = Self {
            heads: self.heads.split_off(count),
            width: self.width,
            values: self.values.split_off(count * self.width),
        };
        std::mem::replace(self, later)
    }

    /// Drops the messages that were published after `until`.
    pub fn cut(&mut self, until: Time) {
        *self = self.take_until(until);
    }

    /// Drops all messages and keeps the memory.
    pub fn clear(&mut self) {
        self.heads.clear();
        self.values.clear();
    }
}
