//! A difference and its place.

use std::fmt;

use ratelab::Time;

/// The first thing that is not the same.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Run time of it.
    pub at: Time,
    /// The item.
    pub what: String,
    /// The recorded value.
    pub recorded: String,
    /// The value of the new run.
    pub computed: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            at,
            what,
            recorded,
            computed,
        } = self;
        write!(
            f,
            "differs at {at}: {what}: recorded {recorded}, computed {computed}"
        )
    }
}

/// One message of a topic, or one tick of a node.
#[derive(Clone, Copy, Debug)]
pub struct SeriesItem<'a> {
    /// The topic or the node.
    pub of: &'a str,
    /// Which of the two it is: `message` or `tick`.
    pub kind: &'static str,
    /// Its number, counted from the beginning of the run.
    pub number: u64,
    /// Its run time.
    pub at: Time,
}

impl SeriesItem<'_> {
    /// It came and was not recorded.
    pub fn not_recorded(&self) -> Difference {
        self.differs("", "none".to_owned(), format!("a {}", self.kind))
    }

    /// It was recorded and did not come.
    pub fn not_computed(&self) -> Difference {
        self.differs("", format!("a {}", self.kind), "none".to_owned())
    }

    /// It is another one in `part`; in whole if that is empty.
    pub fn differs(&self, part: &str, recorded: String, computed: String) -> Difference {
        let Self {
            of, kind, number, ..
        } = self;
        let comma = if part.is_empty() { "" } else { ", " };
        Difference {
            at: self.at,
            what: format!("{of} {kind} {number}{comma}{part}"),
            recorded,
            computed,
        }
    }
}
