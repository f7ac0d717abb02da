//! A page over everything else: the keys, the words, an explanation, an exercise, a step of
//! the tour.

/// A page.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Page {
    /// Its title.
    pub title: String,
    /// Paragraphs, to be wrapped.
    pub text: String,
    /// In their place keys and their actions, the most important first, or words and their
    /// meanings: in two columns if one is too high.
    pub rows: Vec<(&'static str, &'static str)>,
    /// The text of the input line, if any.
    pub typed: Option<String>,
    /// Keys and their actions, below it.
    pub hint: &'static str,
    /// As spans of the bottom line of the screen.
    pub keys: &'static [(&'static str, &'static str)],
    /// Number of lines scrolled past.
    pub scroll: usize,
    /// Whether it is at the bottom, so that something of the area stays in sight, and not
    /// in the middle.
    pub aside: bool,
}

impl Page {
    /// Creates a page of paragraphs.
    pub fn text(title: impl Into<String>, text: String, hint: &'static str) -> Self {
        Self {
            title: title.into(),
            text,
            hint,
            ..Self::default()
        }
    }

    /// Creates a page of keys or words.
    pub fn rows(title: &str, rows: Vec<(&'static str, &'static str)>) -> Self {
        Self {
            title: title.to_owned(),
            rows,
            ..Self::default()
        }
    }
}
