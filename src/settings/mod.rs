//! The values of settings: what ticks take, when they start, what links and clocks do.
//!
//! Each is a type with a text form, which is parsed once, where it enters the program.

pub(crate) mod chance;
pub(crate) mod digest;
pub(crate) mod draw;
pub(crate) mod error;
pub(crate) mod link;
pub(crate) mod local_clock;
pub(crate) mod release;

/// Settings in files: as their text.
pub(crate) mod as_text {
    use std::{fmt::Display, str::FromStr};

    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    /// Writes a setting as its text.
    pub(crate) fn serialize<T: Display, S: Serializer>(
        setting: &T,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        serializer.collect_str(setting)
    }

    /// Reads a setting from its text.
    pub(crate) fn deserialize<'de, T, D>(deserializer: D) -> Result<T, D::Error>
    where
        T: FromStr<Err: Display>,
        D: Deserializer<'de>,
    {
        let text = String::deserialize(deserializer)?;
        text.parse().map_err(D::Error::custom)
    }
}
