//! Texts with their places in a graph file.

/// A text with its place in the file.
#[derive(Clone, Debug)]
pub(super) struct Placed {
    pub(super) text: String,
    pub(super) at: usize,
}

impl Placed {
    pub(super) fn new(text: &str, at: usize) -> Self {
        let text = text.to_owned();
        Self { text, at }
    }

    /// Whether it names a topic and no node.
    pub(super) fn is_topic(&self) -> bool {
        self.text.starts_with('/')
    }
}

/// Whether `list` has the text `text`.
pub(super) fn holds(list: &[Placed], text: &str) -> bool {
    list.iter().any(|known| known.text == text)
}
