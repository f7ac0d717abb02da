//! The parts of a knob's value, from text and to it.

use std::{str::FromStr, time::Duration};

use crate::{
    millis,
    qos::{Depth, ReadOrder},
    settings::{
        draw::{Cost, Draw},
        link::Link,
        local_clock::ClockError,
        release::Overrun,
    },
    time::Hz,
};

/// A part of the value of a knob.
pub(super) trait KnobPart: Sized {
    /// Whether it may contain spaces.
    const IS_TEXT: bool = false;

    /// Reads it from text; an error without a text of its own is about the whole knob.
    fn read(text: &str) -> Result<Self, Option<String>>;

    /// Returns its text.
    fn to_text(&self) -> String;
}

impl KnobPart for String {
    const IS_TEXT: bool = true;

    fn read(text: &str) -> Result<Self, Option<String>> {
        Ok(text.to_owned())
    }

    fn to_text(&self) -> String {
        self.clone()
    }
}

impl KnobPart for Duration {
    fn read(text: &str) -> Result<Self, Option<String>> {
        millis::parse(text).map_err(|error| Some(error.to_string()))
    }

    fn to_text(&self) -> String {
        millis::to_millis(*self).to_string()
    }
}

impl KnobPart for u64 {
    fn read(text: &str) -> Result<Self, Option<String>> {
        text.parse().map_err(|_| None)
    }

    fn to_text(&self) -> String {
        self.to_string()
    }
}

impl KnobPart for Hz {
    fn read(text: &str) -> Result<Self, Option<String>> {
        parsed(text)
    }

    fn to_text(&self) -> String {
        self.get().to_string()
    }
}

/// Types whose own text is the part, each with whether that may contain spaces.
macro_rules! parts {
    ($($type:ty: $is_text:literal,)+) => {$(
        impl KnobPart for $type {
            const IS_TEXT: bool = $is_text;

            fn read(text: &str) -> Result<Self, Option<String>> {
                parsed(text)
            }

            fn to_text(&self) -> String {
                self.to_string()
            }
        }
    )+};
}

parts! {
    Depth: false,
    ReadOrder: false,
    Cost: true,
    Draw: true,
    Overrun: true,
    Link: true,
    ClockError: true,
}

/// Returns a part whose type has an error of its own.
fn parsed<P: FromStr<Err: ToString>>(text: &str) -> Result<P, Option<String>> {
    text.parse()
        .map_err(|error: P::Err| Some(error.to_string()))
}
