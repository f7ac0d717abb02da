//! Ticks on messages, of one topic or of sets from several.

pub mod approximate;
pub mod matcher;
pub mod matching;
pub mod trigger;
