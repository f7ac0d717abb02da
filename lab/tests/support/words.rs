//! Command lines in tests.

/// The words of a command line; `'` around a word keeps its blanks.
pub fn words(line: &str) -> impl Iterator<Item = &str> {
    let parts = line.split('\'').zip([false, true].into_iter().cycle());
    parts.flat_map(|(part, quoted)| match quoted {
        true => vec![part],
        false => part.split_whitespace().collect(),
    })
}
