//! Text that fits: measured, cut, padded, broken, and in ASCII where the theme asks for that.

use std::borrow::Cow;

use ratatui::{
    style::Style,
    text::{Line, Span},
};
use textwrap::{Options, WordSplitter};

use crate::theme::Theme;

/// The program's own symbols in ASCII; any other is a question mark.
const SPELLINGS: [(&str, &str); 27] = [
    ("×✖", "x"),
    ("⚠", "!"),
    ("±", "+-"),
    ("→", "->"),
    ("←", "<-"),
    ("↑", "up"),
    ("↓", "down"),
    ("−–—─▄▃▅", "-"),
    ("│┊", "|"),
    ("┐┘┌└┤├┬┴┼✓◆", "+"),
    ("╌░", ":"),
    ("µμ", "u"),
    ("°", " deg"),
    ("≥", ">="),
    ("…", "..."),
    ("“”", "\""),
    ("‘’", "'"),
    ("█■▆▇", "#"),
    ("▒◔◷", "~"),
    ("▓━‖", "="),
    ("▁▂▏", "_"),
    ("▶▷►▸", ">"),
    ("◀", "<"),
    ("▲", "^"),
    ("●", "*"),
    ("•○", "o"),
    ("·", "."),
];

/// Returns `text` in ASCII if the theme asks for that.
pub fn plain<'a>(text: &'a str, theme: &Theme) -> Cow<'a, str> {
    if !theme.ascii || text.is_ascii() {
        return Cow::Borrowed(text);
    }
    let mut out = String::new();
    for letter in text.chars() {
        let spelling = SPELLINGS.iter().find(|(signs, _)| signs.contains(letter));
        match spelling {
            Some((_, ascii)) => out.push_str(ascii),
            None if letter.is_ascii() => out.push(letter),
            None => out.push('?'),
        }
    }
    Cow::Owned(out)
}

/// Returns the width of `text` (columns).
pub fn width(text: &str) -> usize {
    Span::raw(text).width()
}

/// Returns `text` cut to `room` columns, with a sign at the cut.
pub fn clip(text: &str, room: usize, theme: &Theme) -> String {
    let text = plain(text, theme);
    let text = if width(&text) > room {
        text.trim_end()
    } else {
        &text
    };
    if width(text) <= room {
        return text.to_owned();
    }
    let sign = plain("…", theme);
    let sign = if width(&sign) <= room { &*sign } else { "" };
    let mut cut = String::new();
    for letter in text.chars() {
        cut.push(letter);
        if width(&cut) + width(sign) > room {
            cut.pop();
            break;
        }
    }
    cut + sign
}

/// Returns `text` cut or padded to `room` columns.
pub fn pad(text: &str, room: usize, theme: &Theme) -> String {
    let text = clip(text, room, theme);
    let blank = room.saturating_sub(width(&text));
    text + &" ".repeat(blank)
}

/// Returns the end of `text`, in `room` characters.
pub fn tail(text: &str, room: usize) -> String {
    let hidden = text.chars().count().saturating_sub(room);
    text.chars().skip(hidden).collect()
}

/// Returns `text` in lines of `room` columns, wrapped between words if possible.
pub fn broken(text: &str, room: usize, theme: &Theme) -> Vec<String> {
    let text = plain(text, theme);
    let options = Options::new(room.max(1)).word_splitter(WordSplitter::NoHyphenation);
    textwrap::wrap(&text, options)
        .into_iter()
        .map(Cow::into_owned)
        .collect()
}

/// Returns the first of `texts` that fits into `room`; empty if none fits.
pub fn fitting(texts: impl IntoIterator<Item = String>, room: usize) -> String {
    texts
        .into_iter()
        .find(|text| width(text) <= room)
        .unwrap_or_default()
}

/// Returns a line of texts, each with its style.
pub fn line<T: Into<String>>(parts: impl IntoIterator<Item = (T, Style)>) -> Line<'static> {
    let spans = parts.into_iter();
    Line::from_iter(spans.map(|(text, style)| Span::styled(text.into(), style)))
}

/// Returns the first of `parts` that fit side by side into `room`, with `gap` blanks in between.
pub fn side_by_side(
    parts: impl IntoIterator<Item = Line<'static>>,
    gap: usize,
    room: usize,
    theme: &Theme,
) -> Line<'static> {
    let mut joined = Line::default();
    for part in parts {
        let before = if joined.spans.is_empty() { 0 } else { gap };
        let spans = part
            .spans
            .into_iter()
            .map(|span| (plain(&span.content, theme).into_owned(), span.style));
        let part = line(spans);
        if joined.width() + before + part.width() > room {
            break;
        }
        joined.push_span(" ".repeat(before));
        joined.spans.extend(part.spans);
    }
    joined
}

/// Returns `value` with at most some `decimals`, one or more, and as many as needed.
pub fn short(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Returns a signed number in `room` columns with a minus sign as wide as a plus.
pub fn signed(value: f64, room: usize, decimals: usize) -> String {
    // A value that rounds to zero would otherwise flicker between +0 and −0.
    let scale = 10_f64.powi(i32::try_from(decimals).unwrap_or(0));
    let rounded = (value * scale).round() / scale + 0.0;
    format!("{rounded:+room$.decimals$}").replace('-', "−")
}

/// Returns a count in at most `room` columns: in thousands, millions and so on where it is large.
pub fn count(count: u64, room: usize) -> String {
    let texts = ["", "k", "M", "G", "T", "P", "E"]
        .into_iter()
        .zip(0..)
        .map(|(unit, power)| format!("{}{unit}", count / 1_000_u64.pow(power)));
    fitting(texts, room)
}

#[cfg(test)]
mod tests {
    use super::{
        super::testing::{POOR, RICH},
        *,
    };

    #[test]
    fn cuts_are_marked_and_never_too_long() {
        for (room, theme, cut) in [
            (10, RICH, "/image_raw"),
            (6, RICH, "/imag…"),
            (6, POOR, "/im..."),
            (2, POOR, "/i"),
            (0, RICH, ""),
        ] {
            assert_eq!(clip("/image_raw", room, &theme), cut);
        }
        assert_eq!(pad("/obs", 6, &RICH), "/obs  ");
    }

    #[test]
    fn signs_have_ascii_spellings() {
        assert_eq!(plain("sense→act 3 µs 10×", &POOR), "sense->act 3 us 10x");
        assert_eq!(plain("日", &POOR), "?");
        assert_eq!(plain("日", &RICH), "日");
    }

    #[test]
    fn numbers_fit_their_columns_and_zero_has_one_sign() {
        assert_eq!(signed(-0.001, 6, 2), " +0.00");
        assert_eq!(signed(-1.5, 6, 2), " −1.50");
        assert_eq!(count(999_999, 6), "999999");
        assert_eq!(count(12_345_678, 6), "12345k");
        assert_eq!(count(u64::MAX, 6), "18446P");
        let rates = [50.0, 33.3, 0.001].map(|hz| short(hz, 3));
        assert_eq!(rates, ["50", "33.3", "0.001"]);
    }
}
