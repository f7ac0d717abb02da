//! Names of locks as numbers.

use std::sync::{Arc, LazyLock, Mutex, PoisonError};

/// The name of a lock: the same number for the same name, within this process.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LockName(u32);

/// All names so far. No part of a model: a thread holds it for a look only.
static NAMES: LazyLock<Mutex<Vec<Arc<str>>>> = LazyLock::new(Mutex::default);

impl LockName {
    /// The number of `name`.
    pub fn of(name: &str) -> Self {
        let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
        let known = names.iter().position(|known| &**known == name);
        let index = known.unwrap_or_else(|| {
            names.push(name.into());
            names.len() - 1
        });
        Self(index as u32)
    }

    /// The name.
    pub fn text(self) -> Arc<str> {
        let names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
        names.get(self.0 as usize).cloned().unwrap_or_default()
    }

    /// The number, for an atomic.
    pub(crate) fn number(self) -> u32 {
        self.0
    }

    /// The name with this number.
    pub(crate) fn from_number(number: u32) -> Self {
        Self(number)
    }
}
