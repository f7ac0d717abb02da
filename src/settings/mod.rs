//! The values of settings: what ticks take, when they start, what links and clocks do.
//!
//! Each is a type with a text form, which is parsed once, where it enters the program.

pub(crate) mod as_text;
pub(crate) mod chance;
pub(crate) mod cost;
pub(crate) mod digest;
pub(crate) mod draw;
pub(crate) mod error;
pub(crate) mod link;
pub(crate) mod local_clock;
pub(crate) mod matching;
pub(crate) mod overrun;
