//! Names from graph files for as long as the program runs, as a [`VerdictKind`] has them: each
//! is kept once, however often its file is read.

use ratelab::sync::{Mutex, lock};

use super::VerdictKind;

/// Those that are kept so far.
type Kept<T> = Mutex<Vec<&'static T>>;

fn kept<T: PartialEq>(known: &Kept<T>, value: T) -> &'static T {
    let mut known = lock(known);
    if let Some(kept) = known.iter().find(|kept| ***kept == value) {
        return kept;
    }
    let kept = Box::leak(Box::new(value));
    known.push(kept);
    kept
}

pub(crate) fn kept_text(text: &str) -> &'static str {
    static KNOWN: Kept<String> = Mutex::new(Vec::new());
    kept::<String>(&KNOWN, text.to_owned())
}

pub(crate) fn kept_list<T: AsRef<str>>(
    texts: impl IntoIterator<Item = T>,
) -> &'static [&'static str] {
    static KNOWN: Kept<Vec<&'static str>> = Mutex::new(Vec::new());
    let texts = texts.into_iter().map(|text| kept_text(text.as_ref()));
    kept::<Vec<_>>(&KNOWN, texts.collect())
}

pub(crate) fn kept_kind(name: &str, lost: bool, text: &str) -> &'static VerdictKind {
    static KNOWN: Kept<VerdictKind> = Mutex::new(Vec::new());
    let (name, text) = (kept_text(name), kept_text(text));
    kept(&KNOWN, VerdictKind { name, lost, text })
}
