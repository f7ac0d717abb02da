//! One table of keys for each screen: their actions, and their texts in the help, in the
//! footer and in `ratelab keys`.

mod lab;
mod map;
mod panes;
#[cfg(feature = "network")]
mod remote;
mod replay;

use std::fmt::Write;

use crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::overlay::OverlayContent;
pub use lab::{LAB, LabAction};
pub use map::{MAP, MapAction};
pub use panes::PaneAction;
#[cfg(feature = "network")]
pub use remote::REMOTE;
pub use replay::{REPLAY, ReplayAction};

/// Keys and what they mean.
pub struct KeyTable<A: 'static>(&'static [Binding<A>]);

/// A row of the table: keys that belong together.
pub struct Binding<A: 'static> {
    /// Each key and what it does.
    pub keys: &'static [(Key, A)],
    /// Their actions in words, in the order of the keys.
    pub help: &'static str,
    /// Their text in the footer; rows without one are in the help only.
    pub footer: Option<&'static str>,
}

/// A key by what it types, or by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Key {
    /// A character, however it is typed.
    Char(char),
    /// A character with Ctrl.
    Ctrl(char),
    /// A key that types nothing.
    Named(KeyCode, &'static str),
}

const RIGHT: Key = Key::Named(KeyCode::Right, "→");
const LEFT: Key = Key::Named(KeyCode::Left, "←");
const UP: Key = Key::Named(KeyCode::Up, "↑");
const DOWN: Key = Key::Named(KeyCode::Down, "↓");
const HOME: Key = Key::Named(KeyCode::Home, "Home");
const END: Key = Key::Named(KeyCode::End, "End");
const TAB: Key = Key::Named(KeyCode::Tab, "Tab");

const fn row<A>(
    keys: &'static [(Key, A)],
    help: &'static str,
    footer: Option<&'static str>,
) -> Binding<A> {
    Binding { keys, help, footer }
}

/// The keys of a screen with panes, those first that are needed most: help and quit, its
/// own rows before the `;`, those of the panes, and its other rows. Its actions are in
/// scope, `Panes` and `Quit` among them.
macro_rules! screen_with_panes {
    ($($first:expr),+; $($row:expr),+ $(,)?) => {
        $crate::dashboard::keys::KeyTable(&[
            row(&[(Char('?'), Panes(PaneAction::Open(OverlayContent::Keys)))], "show or hide this help", Some("keys")),
            row(
                &[(Char('i'), Panes(PaneAction::Open(OverlayContent::Explained)))],
                "explain the pane in focus, with its figures",
                Some("explain"),
            ),
            row(
                &[(Char('G'), Panes(PaneAction::Open(OverlayContent::Glossary)))],
                "the words on the screen, in one line each",
                None,
            ),
            row(&[(Char('q'), Quit), (Ctrl('c'), Quit)], "quit", Some("quit")),
            $($first,)+
            row(
                &[
                    (TAB, Panes(PaneAction::Next)),
                    (Char('1'), Panes(PaneAction::Focus(Pane::Graph))),
                    (Char('2'), Panes(PaneAction::Focus(Pane::Plant))),
                    (Char('3'), Panes(PaneAction::Focus(Pane::Signal))),
                    (Char('4'), Panes(PaneAction::Focus(Pane::Figures))),
                    (Char('5'), Panes(PaneAction::Focus(Pane::Events))),
                    (Char('6'), Panes(PaneAction::Focus(Pane::Timeline))),
                ],
                "next pane; graph, plant, signal, figures, events, timeline",
                None,
            ),
            row(
                &[
                    (Char('('), Panes(PaneAction::Push(false))),
                    (Char(')'), Panes(PaneAction::Push(true))),
                ],
                "timeline: select the push before, the next one",
                None,
            ),
            row(
                &[
                    (Char('v'), Panes(PaneAction::Span(true))),
                    (Char('V'), Panes(PaneAction::Span(false))),
                ],
                "timeline: a shorter stretch, a longer one",
                None,
            ),
            row(
                &[(Char('z'), Panes(PaneAction::Zoom))],
                "give the focused pane the whole screen, or take it back",
                Some("zoom"),
            ),
            $($row,)+
        ])
    };
}
use screen_with_panes;

impl Key {
    /// The label of the key.
    pub fn label(self) -> String {
        match self {
            Self::Char(' ') => "Space".to_owned(),
            Self::Char(character) => character.to_string(),
            Self::Ctrl(character) => format!("Ctrl-{}", character.to_ascii_uppercase()),
            Self::Named(_, name) => name.to_owned(),
        }
    }

    /// Whether `event` is this key. Shift does not count: which characters need
    /// it is the keyboard layout's business.
    fn is(self, event: &KeyEvent) -> bool {
        let chord = event.modifiers - KeyModifiers::SHIFT;
        match self {
            Self::Char(character) => {
                event.code == KeyCode::Char(character) && chord == KeyModifiers::NONE
            }
            Self::Ctrl(character) => {
                event.code == KeyCode::Char(character) && chord == KeyModifiers::CONTROL
            }
            Self::Named(code, _) => event.code == code,
        }
    }
}

/// Whether a key is pressed with Ctrl or Alt, and so types nothing.
pub fn is_chord(key: &KeyEvent) -> bool {
    !(key.modifiers - KeyModifiers::SHIFT).is_empty()
}

impl<A> Binding<A> {
    fn labels(&self) -> Vec<String> {
        self.keys.iter().map(|(key, _)| key.label()).collect()
    }
}

impl<A: Copy> KeyTable<A> {
    /// The action of `event`.
    pub fn action(&self, event: &KeyEvent) -> Option<A> {
        let mut keys = self.0.iter().flat_map(|binding| binding.keys);
        keys.find(|(key, _)| key.is(event))
            .map(|(_, action)| *action)
    }

    /// The rows of which at least one action can be `done`.
    fn of(&self, done: impl Fn(&A) -> bool) -> impl Iterator<Item = &'static Binding<A>> {
        let bindings = self.0.iter();
        bindings.filter(move |binding| binding.keys.iter().any(|(_, action)| done(action)))
    }

    /// Keys that can be `done` and what they do.
    pub fn rows(&self, done: impl Fn(&A) -> bool) -> Vec<(String, String)> {
        let row = |binding: &Binding<A>| (binding.labels().join(" "), binding.help.to_owned());
        self.of(done).map(row).collect()
    }

    /// What the footer says of those that can be `done`: keys that type something,
    /// or those of a row without any, and what for.
    pub fn hints(&self, done: impl Fn(&A) -> bool) -> Vec<(String, &'static str)> {
        let hint = |binding: &Binding<A>| {
            let typed = binding.keys.iter().map(|(key, _)| key);
            let typed = typed.filter(|key| matches!(key, Key::Char(_)));
            let mut labels: Vec<String> = typed.map(|key| key.label()).collect();
            if labels.is_empty() {
                labels = binding.labels();
            }
            binding.footer.map(|text| (labels.join(" "), text))
        };
        self.of(done).filter_map(hint).collect()
    }

    /// Those that can be `done`, as `ratelab keys` prints them.
    pub fn text(&self, done: impl Fn(&A) -> bool) -> String {
        let rows = self.rows(done).into_iter();
        rows.fold(String::new(), |mut text, (keys, help)| {
            let _ = writeln!(text, "{keys:<15} {help}");
            text
        })
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Debug;

    use super::*;

    fn no_key_has_two_meanings<A>(table: &KeyTable<A>) {
        let keys = table.0.iter().flat_map(|binding| binding.keys);
        let keys: Vec<Key> = keys.map(|(key, _)| *key).collect();
        for (index, key) in keys.iter().enumerate() {
            assert!(!keys[..index].contains(key), "{} is taken", key.label());
        }
    }

    fn every_action_can_be_reached<A: Copy + Debug + PartialEq>(table: &KeyTable<A>) {
        for binding in table.0 {
            assert!(!binding.keys.is_empty(), "{} has no key", binding.help);
            for (key, done) in binding.keys {
                let event = match *key {
                    Key::Char(c) => KeyEvent::new(KeyCode::Char(c), KeyModifiers::SHIFT),
                    Key::Ctrl(c) => KeyEvent::new(KeyCode::Char(c), KeyModifiers::CONTROL),
                    Key::Named(code, _) => KeyEvent::new(code, KeyModifiers::NONE),
                };
                assert_eq!(table.action(&event), Some(*done), "{}", key.label());
            }
        }
    }

    #[test]
    fn no_key_of_a_screen_has_two_meanings() {
        no_key_has_two_meanings(&LAB);
        no_key_has_two_meanings(&MAP);
        no_key_has_two_meanings(&REPLAY);
        #[cfg(feature = "network")]
        no_key_has_two_meanings(&REMOTE);
    }

    #[test]
    fn every_action_can_be_reached_by_each_of_its_keys() {
        every_action_can_be_reached(&LAB);
        every_action_can_be_reached(&MAP);
        every_action_can_be_reached(&REPLAY);
        #[cfg(feature = "network")]
        every_action_can_be_reached(&REMOTE);
    }
}
