//! Names from graph files for as long as the program runs, as a [`VerdictKind`] has them: each
//! is kept once, however often its file is read.

use std::sync::OnceLock;

use super::VerdictKind;

type Place<T> = OnceLock<Box<Kept<T>>>;

/// A value, with the place of the next one.
struct Kept<T> {
    value: T,
    next: Place<T>,
}

fn kept<T: Clone + PartialEq>(value: T, first: &'static Place<T>) -> &'static T {
    let mut place = first;
    loop {
        let kept = place.get_or_init(|| {
            Box::new(Kept {
                value: value.clone(),
                next: OnceLock::new(),
            })
        });
        if kept.value == value {
            return &kept.value;
        }
        place = &kept.next;
    }
}

pub(crate) fn kept_text(text: &str) -> &'static str {
    static FIRST: Place<String> = OnceLock::new();
    kept::<String>(text.to_owned(), &FIRST)
}

pub(crate) fn kept_list<T: AsRef<str>>(
    texts: impl IntoIterator<Item = T>,
) -> &'static [&'static str] {
    static FIRST: Place<Vec<&'static str>> = OnceLock::new();
    let texts = texts.into_iter().map(|text| kept_text(text.as_ref()));
    kept::<Vec<_>>(texts.collect(), &FIRST)
}

pub(crate) fn kept_kind(name: &str, lost: bool, text: &str) -> &'static VerdictKind {
    static FIRST: Place<VerdictKind> = OnceLock::new();
    let (name, text) = (kept_text(name), kept_text(text));
    kept(VerdictKind { name, lost, text }, &FIRST)
}
