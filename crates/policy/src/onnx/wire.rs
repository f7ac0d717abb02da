//! The wire format of protocol buffers, in which ONNX files are written: fields with a number, of
//! one of four kinds.

/// A field of a message.
pub(super) struct WireField<'a> {
    /// Its number.
    pub(super) number: u64,
    pub(super) value: WireValue<'a>,
    /// All its bytes, with number and length.
    pub(super) bytes: &'a [u8],
}

/// The value of a field.
pub(super) enum WireValue<'a> {
    /// An integer.
    Varint(u64),
    /// A text, a message or bytes.
    Bytes(&'a [u8]),
    /// A number of 4 or 8 bytes.
    Fixed,
}

/// The fields of the message in some bytes; `None` for bytes that are not a field, after which
/// nothing follows.
pub(super) struct WireFields<'a>(Option<&'a [u8]>);

impl<'a> WireFields<'a> {
    pub(super) fn new(message: &'a [u8]) -> Self {
        Self(Some(message))
    }
}

impl<'a> Iterator for WireFields<'a> {
    type Item = Option<WireField<'a>>;

    fn next(&mut self) -> Option<Self::Item> {
        let message = self.0.take().filter(|rest| !rest.is_empty())?;
        let field = field(message);
        self.0 = field.as_ref().map(|field| &message[field.bytes.len()..]);
        Some(field)
    }
}

/// Returns the first field of a message.
fn field(message: &[u8]) -> Option<WireField<'_>> {
    let mut rest = message;
    let tag = varint(&mut rest)?;
    let value = match tag & 7 {
        0 => WireValue::Varint(varint(&mut rest)?),
        1 => take(&mut rest, 8).map(|_| WireValue::Fixed)?,
        2 => {
            let length = varint(&mut rest)?;
            WireValue::Bytes(take(&mut rest, length)?)
        }
        5 => take(&mut rest, 4).map(|_| WireValue::Fixed)?,
        // Groups, which ONNX has never had.
        _ => return None,
    };
    Some(WireField {
        number: tag >> 3,
        value,
        bytes: &message[..message.len() - rest.len()],
    })
}

/// Takes the first `count` of `bytes`.
fn take<'a>(bytes: &mut &'a [u8], count: u64) -> Option<&'a [u8]> {
    let (taken, rest) = bytes.split_at_checked(usize::try_from(count).ok()?)?;
    *bytes = rest;
    Some(taken)
}

/// Takes an integer from the beginning of `bytes`: seven bits in each byte, the lowest first.
fn varint(bytes: &mut &[u8]) -> Option<u64> {
    let mut value = 0;
    for shift in (0..64).step_by(7) {
        let (byte, rest) = bytes.split_first()?;
        *bytes = rest;
        value |= u64::from(byte & 0x7f) << shift;
        if *byte < 0x80 {
            return Some(value);
        }
    }
    None
}

/// Writes field `number` with these bytes.
pub(super) fn put_bytes(message: &mut Vec<u8>, number: u64, bytes: &[u8]) {
    put_varint(message, number << 3 | 2);
    put_varint(message, bytes.len() as u64);
    message.extend_from_slice(bytes);
}

fn put_varint(message: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        message.push(value as u8 | 0x80);
        value >>= 7;
    }
    message.push(value as u8);
}
