//! Settings in files: as their text.

use std::{fmt::Display, str::FromStr};

use serde::{Deserialize, Deserializer, Serializer, de::Error};

/// Writes a setting as its text.
pub fn serialize<T: Display, S: Serializer>(setting: &T, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(setting)
}

/// Reads a setting from its text.
pub fn deserialize<'de, T, D>(deserializer: D) -> Result<T, D::Error>
where
    T: FromStr<Err: Display>,
    D: Deserializer<'de>,
{
    let text = String::deserialize(deserializer)?;
    text.parse().map_err(D::Error::custom)
}
