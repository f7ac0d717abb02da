//! The figures that the pages tell in prose, each with its source.
//!
//! `docs/figures.toml` quotes every one of them: the words around it, with the
//! figure in brackets, and where it comes from, so that no figure can be changed,
//! on a page or in the program, without the other being looked at.

use std::{
    collections::HashMap,
    fs,
    ops::Range,
    path::Path,
    sync::{Mutex, PoisonError},
};

use serde::Deserialize;

use crate::{page::Page, shell::Shell};

/// All figures of all pages.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Figures {
    /// Names with digits in them, which are no figures.
    names: Vec<String>,
    figure: Vec<Claim>,
}

/// Words of a page, and a command or a file that says so too.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Claim {
    page: String,
    /// Words of the page, each figure in brackets.
    says: String,
    /// A command, whose output holds what `shows` says.
    run: Option<String>,
    /// A file of the clone, which holds what `shows` says.
    file: Option<String>,
    /// What the source holds; `{}` stands for one figure after the other.
    shows: Vec<String>,
}

/// What commands have printed so far, for all pages.
static PRINTED: Mutex<Option<HashMap<String, String>>> = Mutex::new(None);

impl Figures {
    pub fn read(root: &Path) -> Self {
        let text = fs::read_to_string(root.join("docs/figures.toml")).expect("figures");
        toml::from_str(&text).unwrap_or_else(|error| panic!("docs/figures.toml: {error}"))
    }

    /// What is wrong with the figures of `page`, outside of `checked`.
    pub fn check(&self, page: &Page, root: &Path, checked: &Range<usize>) -> Vec<String> {
        let text = Words::of(&page.text);
        let mut sourced = vec![checked.clone()];
        let mut faults = Vec::new();
        for claim in self.figure.iter().filter(|claim| claim.page == page.name) {
            let quote = Quote::of(&claim.says);
            let found = text.find(&quote.words);
            if found.is_empty() {
                faults.push(format!("the page does not say: {}", claim.says));
            }
            for start in found {
                let figures = quote.figures.iter();
                sourced.extend(figures.map(|figure| text.place(start, figure)));
            }
            if let Err(fault) = claim.holds(&quote, root) {
                faults.push(format!("{}\n  {fault}", claim.says));
            }
        }
        for name in &self.names {
            let found = text.find(name).into_iter();
            sourced.extend(found.map(|start| text.place(start, &(0..name.len()))));
        }
        for figure in numbers(page) {
            if !sourced
                .iter()
                .any(|s| s.start <= figure.start && figure.end <= s.end)
            {
                faults.push(format!("no source: {}", around(&page.text, &figure)));
            }
        }
        faults
    }

    /// The pages that have figures.
    pub fn pages(&self) -> impl Iterator<Item = &str> {
        self.figure.iter().map(|claim| claim.page.as_str())
    }
}

impl Claim {
    /// Whether its source says so too.
    fn holds(&self, quote: &Quote, root: &Path) -> Result<(), String> {
        let (source, text) = match (&self.run, &self.file) {
            (Some(command), None) => (command, printed(command, root)?),
            (None, Some(file)) => match fs::read_to_string(root.join(file)) {
                Ok(text) => (file, text),
                Err(error) => return Err(format!("{file}: {error}")),
            },
            _ => return Err("a source is either a command to run or a file".to_owned()),
        };
        let mut figures = quote
            .figures
            .iter()
            .map(|figure| &quote.words[figure.clone()]);
        let mut rest = text.as_str();
        for shown in &self.shows {
            let mut pieces = shown.split("{}");
            let mut expected = pieces.next().unwrap_or_default().to_owned();
            for piece in pieces {
                expected += figures.next().ok_or("there are more {} than figures")?;
                expected += piece;
            }
            rest = after(rest, &expected)
                .ok_or_else(|| format!("{expected:?} is not in {source}, or not in this order"))?;
        }
        match figures.next() {
            Some(figure) => Err(format!("no {{}} stands for {figure}")),
            None => Ok(()),
        }
    }
}

/// What comes after `expected` in `text`, where no figure goes on at its ends.
fn after<'t>(text: &'t str, expected: &str) -> Option<&'t str> {
    let goes_on = |c: char| c.is_ascii_digit() || c == '.';
    let whole = |at: usize| {
        let (before, rest) = (&text[..at], &text[at + expected.len()..]);
        let begins = !expected.starts_with(goes_on) || !before.ends_with(goes_on);
        let follows = rest.strip_prefix('.').unwrap_or(rest);
        let ends =
            !expected.ends_with(goes_on) || !follows.starts_with(|c: char| c.is_ascii_digit());
        (begins && ends).then_some(rest)
    };
    text.match_indices(expected).find_map(|(at, _)| whole(at))
}

/// What `command` prints in a fresh clone; it is run once.
fn printed(command: &str, root: &Path) -> Result<String, String> {
    let mut printed = PRINTED.lock().unwrap_or_else(PoisonError::into_inner);
    let printed = printed.get_or_insert_default();
    if let Some(known) = printed.get(command) {
        return Ok(known.clone());
    }
    let output = Shell::new(root).run(command, true)?;
    printed.insert(command.to_owned(), output.clone());
    Ok(output)
}

/// A text with single spaces, which still knows where each byte came from.
struct Words {
    text: String,
    places: Vec<usize>,
}

impl Words {
    fn of(text: &str) -> Self {
        let mut words = Self {
            text: String::new(),
            places: Vec::new(),
        };
        for (place, c) in text.char_indices() {
            let c = if c.is_whitespace() { ' ' } else { c };
            if c == ' ' && words.text.ends_with(' ') {
                continue;
            }
            words.text.push(c);
            words.places.extend((0..c.len_utf8()).map(|i| place + i));
        }
        words
    }

    /// Where it has `quote`.
    fn find(&self, quote: &str) -> Vec<usize> {
        self.text.match_indices(quote).map(|(at, _)| at).collect()
    }

    /// Where a part of the quote at `start` is in the original text.
    fn place(&self, start: usize, part: &Range<usize>) -> Range<usize> {
        self.places[start + part.start]..self.places[start + part.end - 1] + 1
    }
}

/// Words with figures in them.
struct Quote {
    words: String,
    figures: Vec<Range<usize>>,
}

impl Quote {
    /// Reads `it falls at [0.840] s`.
    fn of(says: &str) -> Self {
        let (mut words, mut figures, mut start) = (String::new(), Vec::new(), 0);
        for c in says.chars() {
            match c {
                '[' => start = words.len(),
                ']' => figures.push(start..words.len()),
                c => words.push(c),
            }
        }
        Self { words, figures }
    }
}

/// The figures that a page tells in its prose.
fn numbers(page: &Page) -> Vec<Range<usize>> {
    let prose = page.prose.iter().cloned();
    prose
        .flat_map(|part| numbers_in(&page.text, part))
        .collect()
}

/// Digits with what they have inside, such as `0.840`. Those in names are figures
/// until the name is known.
fn numbers_in(text: &str, part: Range<usize>) -> Vec<Range<usize>> {
    let bytes = text.as_bytes();
    let digit = |at: usize| bytes.get(at).is_some_and(u8::is_ascii_digit);
    let inner = |at: usize| matches!(bytes.get(at), Some(b'.' | b',')) && digit(at + 1);
    let mut numbers = Vec::new();
    let mut at = part.start;
    while at < part.end {
        let start = at;
        while digit(at) || (at > start && inner(at)) {
            at += 1;
        }
        if at == start {
            at += 1;
        } else {
            numbers.push(start..at);
        }
    }
    numbers
}

/// The line that a figure is in.
fn around(text: &str, figure: &Range<usize>) -> String {
    let start = text[..figure.start].rfind('\n').map_or(0, |at| at + 1);
    let line = text[start..].lines().next().unwrap_or_default();
    let number = text[..start].lines().count() + 1;
    format!("{} in line {number}: {line}", &text[figure.clone()])
}
