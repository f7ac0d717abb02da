//! Comments in lists of knobs: from a `#` at the start of a line or after white space to
//! the end of the line. In a path such a `#` is written `\#`.

/// Returns the possible starts of comments in `line`, ignoring backslashes before the `#`: the
/// position of each, and its number of backslashes.
fn hashes(line: &str) -> impl Iterator<Item = (usize, usize)> {
    line.match_indices('#').filter_map(|(place, _)| {
        let before = line.get(..place).unwrap_or_default();
        let bare = before.trim_end_matches('\\');
        let begins = bare.is_empty() || bare.ends_with(char::is_whitespace);
        begins.then(|| (place, before.len() - bare.len()))
    })
}

/// `line` without its comment.
pub(super) fn uncommented(line: &str) -> &str {
    let comment = hashes(line).find(|(_, backslashes)| *backslashes == 0);
    comment
        .and_then(|(place, _)| line.get(..place))
        .unwrap_or(line)
}

/// `text` with one more backslash before each `#` that would begin a comment.
pub(super) fn escaped(text: &str) -> String {
    let mut escaped = text.to_owned();
    let places: Vec<usize> = hashes(text).map(|(place, _)| place).collect();
    for place in places.into_iter().rev() {
        escaped.insert(place, '\\');
    }
    escaped
}

/// `text` with one backslash less before each `#` that would begin a comment.
pub(super) fn unescaped(text: &str) -> String {
    let mut unescaped = text.to_owned();
    let places: Vec<usize> = hashes(text)
        .filter(|(_, backslashes)| *backslashes > 0)
        .map(|(place, _)| place - 1)
        .collect();
    for place in places.into_iter().rev() {
        unescaped.remove(place);
    }
    unescaped
}
