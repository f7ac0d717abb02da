//! One table of keys for each screen: what they do, and their texts in the help, in the
//! footer and in `ratelab keys`.

mod tables;

use std::fmt::Write;

use crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

pub use tables::{BACK, LAB, MAP, REMOTE, REPLAY};

use super::App;
use crate::knobs::Direction;

/// A row of a table: keys that belong together.
pub struct KeyRow {
    /// The names of the keys, with blanks in between.
    keys: &'static str,
    does: Does,
    /// What they do in words, in the order of the keys.
    help: &'static str,
    /// Their text in the footer; empty if they are in the help only.
    footer: &'static str,
    needs: Need,
}

/// What the keys of a row do.
enum Does {
    /// All the same.
    This(fn(&mut App)),
    /// Down and up, in turn.
    DownUp(fn(&mut App, Direction)),
    /// Up and down, in turn.
    UpDown(fn(&mut App, Direction)),
    /// Each its own.
    Each(&'static [fn(&mut App)]),
}

/// What there must be for keys to have an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// Nothing.
    Nothing,
    /// The exercises of the course.
    Course,
    /// A knob that is known to break the system.
    Breakable,
    /// Messages to choose from.
    Choices,
    /// A second alias of a rate.
    SecondRate,
    /// A world of its own.
    OwnWorld,
}

/// The keys of a screen, in groups of rows.
pub struct KeyTable(&'static [&'static [KeyRow]]);

/// The keys that type nothing.
const NAMED: [(KeyCode, &str); 11] = [
    (KeyCode::Right, "→"),
    (KeyCode::Left, "←"),
    (KeyCode::Up, "↑"),
    (KeyCode::Down, "↓"),
    (KeyCode::Home, "Home"),
    (KeyCode::End, "End"),
    (KeyCode::PageUp, "PgUp"),
    (KeyCode::PageDown, "PgDn"),
    (KeyCode::Tab, "Tab"),
    (KeyCode::Enter, "Enter"),
    (KeyCode::Esc, "Esc"),
];

/// Returns the name of a key; that of a character, however it is typed: which characters need Shift
/// is the keyboard layout's business.
fn name(key: &KeyEvent) -> String {
    let known = NAMED.iter().find(|(code, _)| *code == key.code);
    match (key.code, known) {
        (KeyCode::Char(character), _) => typed(character, key.modifiers),
        (_, Some((_, name))) => (*name).to_owned(),
        (_, None) => String::new(),
    }
}

fn typed(character: char, modifiers: KeyModifiers) -> String {
    let chord = modifiers - KeyModifiers::SHIFT;
    match character {
        _ if chord == KeyModifiers::CONTROL => format!("Ctrl-{}", character.to_ascii_uppercase()),
        _ if !chord.is_empty() => String::new(),
        ' ' => "Space".to_owned(),
        character => character.to_string(),
    }
}

/// Returns whether a key is pressed with Ctrl or Alt, and so types nothing.
pub fn is_chord(key: &KeyEvent) -> bool {
    !(key.modifiers - KeyModifiers::SHIFT).is_empty()
}

/// Returns whether `key` is to quit.
pub fn quits(key: &KeyEvent) -> bool {
    tables::QUIT.iter().any(|row| row.place(key).is_some())
}

impl KeyRow {
    fn names(&self) -> impl Iterator<Item = &'static str> {
        self.keys.split(' ')
    }

    /// Returns the place of `key` in the row.
    fn place(&self, key: &KeyEvent) -> Option<usize> {
        let name = name(key);
        self.names().position(|known| known == name)
    }

    /// Does what `key` does; returns whether it is in the row.
    fn obey(&self, app: &mut App, key: &KeyEvent) -> bool {
        let Some(place) = self.place(key) else {
            return false;
        };
        match self.does {
            Does::This(act) => act(app),
            Does::DownUp(act) => act(app, [Direction::Down, Direction::Up][place % 2]),
            Does::UpDown(act) => act(app, [Direction::Up, Direction::Down][place % 2]),
            Does::Each(acts) => acts[place](app),
        }
        true
    }

    /// Returns the text in the footer, after the keys that type something, or after all of a row
    /// without any.
    fn hint(&self) -> Option<(String, &'static str)> {
        let is_typed = |name: &&str| name.chars().count() == 1 && !"→←↑↓".contains(*name);
        let typed: Vec<&str> = self.names().filter(is_typed).collect();
        let keys = match typed[..] {
            [] => self.keys.to_owned(),
            _ => typed.join(" "),
        };
        (!self.footer.is_empty()).then_some((keys, self.footer))
    }
}

impl KeyTable {
    /// Does what `key` does; returns whether it is in the table.
    pub fn obey(&self, app: &mut App, key: &KeyEvent) -> bool {
        self.available(|_| true).any(|row| row.obey(app, key))
    }

    /// Returns the rows for which there is what they need.
    fn available(&self, has: impl Fn(Need) -> bool) -> impl Iterator<Item = &'static KeyRow> {
        let rows = self.0.iter().flat_map(|group| *group);
        rows.filter(move |row| has(row.needs))
    }

    /// Returns the keys and what they do, where there is what they need.
    pub fn rows(&self, has: impl Fn(Need) -> bool) -> Vec<(&'static str, &'static str)> {
        self.available(has)
            .map(|row| (row.keys, row.help))
            .collect()
    }

    /// Returns the keys and what the footer says of them.
    pub fn hints(&self, has: impl Fn(Need) -> bool) -> Vec<(String, &'static str)> {
        self.available(has).filter_map(KeyRow::hint).collect()
    }

    /// Returns the same of the rows that begin with `first`, in this order.
    pub fn hints_of(&self, first: &[&str]) -> Vec<(String, &'static str)> {
        let row = |key: &&str| {
            let mut rows = self.available(|_| true);
            rows.find(|row| row.names().next() == Some(*key))
        };
        first
            .iter()
            .filter_map(row)
            .filter_map(KeyRow::hint)
            .collect()
    }

    /// Returns the rows, as `ratelab keys` prints them.
    pub fn text(&self, has: impl Fn(Need) -> bool) -> String {
        self.rows(has)
            .into_iter()
            .fold(String::new(), |mut text, (keys, help)| {
                let _ = writeln!(text, "{keys:<15} {help}");
                text
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::{EDGES, KEY_GAP};

    const TABLES: &[KeyTable] = &[LAB, MAP, REPLAY, REMOTE];

    #[test]
    fn no_key_of_a_screen_has_two_meanings() {
        for table in TABLES {
            let names: Vec<&str> = table.available(|_| true).flat_map(KeyRow::names).collect();
            for (index, name) in names.iter().enumerate() {
                assert!(!names[..index].contains(name), "{name} is taken");
            }
        }
    }

    #[test]
    fn every_row_of_keys_fits_80_columns_and_the_first_ones_have_a_text_in_the_footer() {
        for table in TABLES {
            let rows = table.rows(|_| true);
            let keys = rows.iter().map(|(keys, _)| keys.chars().count()).max();
            let room = 80 - EDGES - KEY_GAP - keys.unwrap_or_default();
            for (keys, help) in rows {
                let wide = help.chars().count();
                assert!(wide <= room, "{keys}: {wide} of {room} columns");
            }
        }
        assert_eq!(LAB.hints_of(&BACK).len(), BACK.len());
    }

    #[test]
    fn every_key_of_a_row_is_one_that_can_be_pressed_and_does_something() {
        let mut keys: Vec<KeyEvent> = NAMED
            .map(|(code, _)| KeyEvent::new(code, KeyModifiers::NONE))
            .into();
        for letter in ' '..='~' {
            keys.push(KeyEvent::new(KeyCode::Char(letter), KeyModifiers::SHIFT));
            keys.push(KeyEvent::new(KeyCode::Char(letter), KeyModifiers::CONTROL));
        }
        for row in TABLES.iter().flat_map(|table| table.available(|_| true)) {
            for (place, name) in row.names().enumerate() {
                let pressed = keys.iter().any(|key| row.place(key) == Some(place));
                assert!(pressed, "{name} of {}", row.help);
            }
            if let Does::Each(acts) = row.does {
                assert_eq!(acts.len(), row.names().count(), "{}", row.help);
            }
        }
    }
}
