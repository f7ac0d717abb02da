//! Text in lines of limited width, wrapped between words. Longer words, such as paths,
//! stay whole.

use std::io::{self, IsTerminal};

use textwrap::{Options, WordSplitter, core::display_width};

/// Width of texts to read (columns).
const READABLE: usize = 80;

/// Maximum indentation of a wrapped line: the names of a summary are shorter.
const MAX_INDENT: usize = 16;

/// Units that stay beside their number.
const UNITS: [&str; 9] = ["s", "ms", "µs", "Hz", "%", "msg/s", "B", "kB", "MB"];

/// Returns `text` with lines of at most `room` columns, if there is a limit. The rest of a line
/// continues below its second column, or its first letter.
pub fn fitted(text: &str, room: Option<usize>) -> String {
    let Some(room) = room else {
        return text.to_owned();
    };
    let lines: Vec<String> = text
        .split('\n')
        .map(|line| fitted_line(line, room))
        .collect();
    lines.join("\n")
}

fn fitted_line(line: &str, room: usize) -> String {
    if display_width(line) <= room {
        return line.to_owned();
    }
    let indent = " ".repeat(Some(indent(line)).filter(|n| *n < room / 2).unwrap_or(0));
    let options = options(room).break_words(false).subsequent_indent(&indent);
    textwrap::fill(&with_units(line), options).replace(GLUE, " ")
}

/// Stands for a blank where a line must not break; no text contains it.
const GLUE: &str = "\u{fdd0}";

/// Returns `line` with units glued to their numbers, and bars to what they follow.
fn with_units(line: &str) -> String {
    let mut glued = String::with_capacity(line.len());
    for word in line.split_inclusive(' ') {
        let bare = word.trim_end_matches([' ', ',', ')', ':']);
        let before = glued.strip_suffix(' ').filter(|before| {
            let is_number = before.ends_with(|c: char| c.is_ascii_digit());
            bare == "|" || (is_number && UNITS.contains(&bare))
        });
        if let Some(before) = before {
            glued = format!("{before}{GLUE}");
        }
        glued.push_str(word);
    }
    glued
}

/// Returns the second column of `line` if it is near, or else its first letter.
fn indent(line: &str) -> usize {
    let text = line.trim_start();
    let first = line.len() - text.len();
    let second = text.split_once("  ").map_or(first, |(name, text)| {
        let gap = 2 + text.len() - text.trim_start().len();
        first + display_width(name) + gap
    });
    if second > MAX_INDENT { first } else { second }
}

/// Options for lines of `room` columns that are broken at blanks only.
pub fn options<'a>(room: usize) -> Options<'a> {
    Options::new(room.max(1)).word_splitter(WordSplitter::NoHyphenation)
}

/// Returns `text` in lines that are easy to read, on any terminal.
pub fn readable(text: &str) -> String {
    let room = room(&io::stdout()).map_or(READABLE, |room| room.min(READABLE));
    textwrap::fill(text, options(room))
}

/// Returns the number of columns of the terminal that `output` is; `None` if it is none.
pub fn room(output: &impl IsTerminal) -> Option<usize> {
    let size = output.is_terminal().then(crossterm::terminal::size)?;
    let (columns, _) = size.ok()?;
    (columns > 0).then(|| usize::from(columns))
}

#[cfg(test)]
mod tests {
    use super::{display_width, fitted};

    const LINE: &str = "latency   sense→act mean 85.1 ms, p50 80.0 ms, p99 180.0 ms, max 180.0 ms \
                        (control period 200.0 ms)";

    #[test]
    fn a_long_line_goes_on_below_its_second_column() {
        for (text, lines) in [
            (
                LINE,
                &[
                    "latency   sense→act mean 85.1 ms, p50 80.0 ms, p99 180.0 ms, max 180.0 ms",
                    "          (control period 200.0 ms)",
                ][..],
            ),
            (
                "verdict   FELL at 0.840 s (pole beyond ±12°): 43 plant steps in 0.84 s sim (0.00 s wall)",
                &[
                    "verdict   FELL at 0.840 s (pole beyond ±12°): 43 plant steps in 0.84 s sim",
                    "          (0.00 s wall)",
                ],
            ),
            ("error: a b", &["error: a b"]),
            ("short  a\n\nlast", &["short  a", "", "last"]),
        ] {
            assert_eq!(fitted(text, Some(80)), lines.join("\n"));
            assert_eq!(fitted(text, None), text);
        }
        let bars = format!(
            "        20  200 of 200  {}        24.0      34.0",
            "█".repeat(14)
        );
        assert_eq!(fitted(&bars, Some(60)), bars);
        assert_eq!(fitted("a 5 Hz | b 50 Hz", Some(8)), "a 5 Hz |\nb 50 Hz");
        assert_eq!(fitted("error: one two", Some(10)), "error: one\ntwo");
        assert_eq!(fitted("    ✖ one two", Some(10)), "    ✖ one\n    two");
    }

    #[test]
    fn no_width_breaks_a_word_or_a_value() {
        let long = format!("error: --knob {LINE} --control-hz /{}", "x".repeat(90));
        for text in [LINE, &long] {
            for room in 24..130 {
                let lines = fitted(text, Some(room));
                let words = |text: &str| {
                    let words = text.split_whitespace().map(str::to_owned);
                    words.collect::<Vec<_>>()
                };
                assert_eq!(words(&lines), words(text));
                for line in lines.lines() {
                    let fits = display_width(line) <= room;
                    assert!(fits || !line.trim().contains(' '), "{room}: {line}");
                }
            }
        }
    }
}
