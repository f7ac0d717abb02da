//! The terminal's background, as the terminal itself reports it.
//!
//! The reply to the query arrives among the keys, at once, later or never.

use crossterm::event::{Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};

use crate::theme::Look;

/// The query for the colour of the background (OSC 11).
pub const QUERY: &str = "\x1b]11;?\x1b\\";

/// The reply after its first key, up to the colour; some terminals add an alpha.
const BEGINS: [&str; 2] = ["11;rgb:", "11;rgba:"];

/// Separates the reply from the keys.
#[derive(Default)]
pub struct Reply {
    /// The keys of a reply that has begun, from its first on.
    held: Vec<Event>,
    /// Their text after the first.
    text: String,
}

/// The result of a key.
#[derive(Debug, PartialEq)]
pub enum Sifted {
    /// It belongs to a reply that is not complete.
    Held,
    /// These keys belong to no reply.
    Keys(Vec<Event>),
    /// It completes the reply: a background for this look.
    Look(Look),
}

impl Reply {
    /// Sifts the next event.
    pub fn next(&mut self, event: Event) -> Sifted {
        let key = match &event {
            Event::Key(key) if key.kind != KeyEventKind::Release => Some(key),
            _ => None,
        };
        if self.held.is_empty() {
            return match key {
                Some(key) if is_alt(key, ']') => {
                    self.held.push(event);
                    Sifted::Held
                }
                _ => Sifted::Keys(vec![event]),
            };
        }
        if let Some(look) = key.filter(|key| is_end(key)).and(look(&self.text)) {
            *self = Self::default();
            return Sifted::Look(look);
        }
        let letter = key.and_then(letter).filter(|letter| self.goes_on(*letter));
        self.held.push(event);
        match letter {
            Some(letter) => {
                self.text.push(letter);
                Sifted::Held
            }
            None => Sifted::Keys(std::mem::take(self).held),
        }
    }

    /// Returns whether `letter` continues a reply.
    fn goes_on(&self, letter: char) -> bool {
        let text = format!("{}{letter}", self.text);
        let colour = |text: &str| text.chars().all(|c| c == '/' || c.is_ascii_hexdigit());
        BEGINS
            .iter()
            .any(|begin| begin.starts_with(&text) || text.strip_prefix(begin).is_some_and(colour))
    }
}

/// Returns the character of a key pressed alone or with Shift.
fn letter(key: &KeyEvent) -> Option<char> {
    match key.code {
        KeyCode::Char(letter) if (key.modifiers - KeyModifiers::SHIFT).is_empty() => Some(letter),
        _ => None,
    }
}

fn is_alt(key: &KeyEvent, letter: char) -> bool {
    key.code == KeyCode::Char(letter) && key.modifiers == KeyModifiers::ALT
}

/// Returns whether `key` is an end of a reply: ESC \ or BEL.
fn is_end(key: &KeyEvent) -> bool {
    let bell = key.code == KeyCode::Char('g') && key.modifiers == KeyModifiers::CONTROL;
    bell || is_alt(key, '\\')
}

/// Returns the look for the colour in a reply: red, green and blue with one to four hexadecimal
/// digits each.
fn look(reply: &str) -> Option<Look> {
    let colour = BEGINS.iter().find_map(|begin| reply.strip_prefix(begin))?;
    let mut parts = colour.split('/').map(|part| {
        let most = 16_u32
            .checked_pow(part.len().try_into().ok()?)?
            .checked_sub(1)?;
        let value = u32::from_str_radix(part, 16).ok()?;
        (most > 0).then(|| f64::from(value) / f64::from(most))
    });
    let mut next = || parts.next().flatten();
    let (red, green, blue) = (next()?, next()?, next()?);
    // The luma of BT.601.
    let light = 0.299 * red + 0.587 * green + 0.114 * blue > 0.5;
    Some(if light { Look::Light } else { Look::Dark })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn press(letter: char, modifiers: KeyModifiers) -> Event {
        Event::Key(KeyEvent::new(KeyCode::Char(letter), modifiers))
    }

    fn typed(text: &str) -> impl Iterator<Item = Event> {
        text.chars().map(|letter| press(letter, KeyModifiers::NONE))
    }

    /// Returns a reply as crossterm reads it.
    fn reply(colour: &str, end: Event) -> Vec<Event> {
        let begin = press(']', KeyModifiers::ALT);
        let text = format!("11;{colour}");
        let middle = typed(&text).collect::<Vec<_>>();
        [vec![begin], middle, vec![end]].concat()
    }

    /// Returns the keys and the looks in `events`.
    fn sifted(events: impl IntoIterator<Item = Event>) -> (Vec<Event>, Vec<Look>) {
        let (mut reply, mut keys, mut looks) = (Reply::default(), Vec::new(), Vec::new());
        for event in events {
            match reply.next(event) {
                Sifted::Held => {}
                Sifted::Keys(some) => keys.extend(some),
                Sifted::Look(look) => looks.push(look),
            }
        }
        (keys, looks)
    }

    #[test]
    fn a_reply_gives_the_look_and_no_keys() {
        let string_end = press('\\', KeyModifiers::ALT);
        let bell = press('g', KeyModifiers::CONTROL);
        for (colour, look) in [
            ("rgb:ffff/ffff/ffff", Look::Light),
            ("rgb:FDFD/F6F6/E3E3", Look::Light),
            ("rgb:ff/ff/dd", Look::Light),
            ("rgba:ffff/ffff/ffff/ffff", Look::Light),
            ("rgb:0000/0000/0000", Look::Dark),
            ("rgb:1/1/2", Look::Dark),
            ("rgb:3000/0a0a/2424", Look::Dark),
        ] {
            for end in [&string_end, &bell] {
                let events = reply(colour, end.clone());
                assert_eq!(sifted(events), (Vec::new(), vec![look]), "{colour}");
            }
        }
    }

    #[test]
    fn what_is_no_reply_is_keys_in_their_order() {
        for text in ["11r", "q", "11;rgb:zz", "", "11;rgb:///"] {
            let begin = press(']', KeyModifiers::ALT);
            let end = press('\\', KeyModifiers::ALT);
            let events: Vec<Event> = [begin]
                .into_iter()
                .chain(typed(text))
                .chain([end])
                .collect();
            assert_eq!(sifted(events.clone()), (events, Vec::new()), "{text:?}");
        }
    }
}
