//! The unread bytes of a pickle.

use super::error::{PickleResult, nonsense};

/// The unread bytes.
#[derive(Default)]
pub(super) struct Bytes<'a>(pub(super) &'a [u8]);

impl<'a> Bytes<'a> {
    /// Returns the next `count` bytes.
    pub(super) fn take(&mut self, count: usize) -> PickleResult<&'a [u8]> {
        match self.0.split_at_checked(count) {
            Some((taken, rest)) => {
                self.0 = rest;
                Ok(taken)
            }
            None => nonsense("it ends in the middle"),
        }
    }

    /// Returns the next byte.
    pub(super) fn byte(&mut self) -> PickleResult<u8> {
        self.array().map(|[byte]| byte)
    }

    /// Returns the next `N` bytes.
    pub(super) fn array<const N: usize>(&mut self) -> PickleResult<[u8; N]> {
        let taken = self.take(N)?;
        taken
            .try_into()
            .or_else(|_| nonsense("it ends in the middle"))
    }

    /// Returns the text up to the end of the line.
    pub(super) fn line(&mut self) -> PickleResult<&'a str> {
        let end = self.0.iter().position(|byte| *byte == b'\n');
        let line = self.take(end.map_or(usize::MAX, |end| end + 1))?;
        utf8(&line[..line.len() - 1])
    }
}

/// These bytes as a text.
pub(super) fn utf8(bytes: &[u8]) -> PickleResult<&str> {
    std::str::from_utf8(bytes).or_else(|_| nonsense("a string that is not UTF-8"))
}
