//! Texts that a [`System`](crate::system::System) names for good: a program reads few graph
//! files, and leaks theirs.

use crate::system::VerdictKind;

pub(super) fn leaked(text: &str) -> &'static str {
    Box::leak(text.to_owned().into_boxed_str())
}

pub(super) fn leaked_list(texts: impl IntoIterator<Item = String>) -> &'static [&'static str] {
    let texts = texts.into_iter();
    texts.map(|text| leaked(&text)).collect::<Vec<_>>().leak()
}

pub(super) fn leaked_kind(name: &str, lost: bool, text: &str) -> &'static VerdictKind {
    Box::leak(Box::new(VerdictKind {
        name: leaked(name),
        lost,
        text: leaked(text),
    }))
}
