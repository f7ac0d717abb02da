//! One table of keys: what they do, what the help and the footer say of them,
//! what `ratelab keys` prints and the README shows.

use std::fmt::Write;

use crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::{app::Pane, ladder::Way};

/// What a person can do in the lab.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Change the control rate by a rung.
    ControlRate(Way),
    /// Change the sensor rate by a rung.
    SensorRate(Way),
    /// Change the queue depth by a rung.
    Depth(Way),
    /// Type a knob and an exact value.
    Type,
    /// Slow the policy to 5 Hz.
    Break,
    /// Stop run time, or let it go on.
    Pause,
    /// Run one tick, or look one picture forward.
    StepForward,
    /// Look one picture back.
    StepBack,
    /// Look at the oldest picture.
    Oldest,
    /// Look at the newest picture.
    Newest,
    /// Stop looking back.
    Live,
    /// Change the speed of virtual time by a rung.
    Speed(Way),
    /// Real-time speed.
    SpeedOne,
    /// Hand the running graph to the other clock.
    OtherClock,
    /// Start again with the same seed.
    Restart,
    /// Start again with a neighbouring seed.
    Seed(Way),
    /// Start again with a neighbouring policy.
    Policy(Way),
    /// Focus the next pane.
    NextPane,
    /// Focus a pane.
    Focus(Pane),
    /// Give the focused pane the whole screen, or take it back.
    Zoom,
    /// Show or hide the keys.
    Help,
    /// Leave.
    Quit,
}

/// A row of the table: keys that belong together.
pub struct Binding {
    /// Each key and what it does.
    pub keys: &'static [(Key, Action)],
    /// What they do, in words, in the order of the keys.
    pub help: &'static str,
    /// What the footer says of them; rows without are in the help only.
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
const HOME: Key = Key::Named(KeyCode::Home, "Home");
const END: Key = Key::Named(KeyCode::End, "End");
const TAB: Key = Key::Named(KeyCode::Tab, "Tab");

/// All keys of the lab, the way out first.
pub const BINDINGS: [Binding; 18] = [
    row(
        &[(Key::Char('?'), Action::Help)],
        "show or hide this help",
        Some("keys"),
    ),
    row(
        &[
            (Key::Char('q'), Action::Quit),
            (Key::Ctrl('c'), Action::Quit),
        ],
        "quit",
        Some("quit"),
    ),
    row(
        &[
            (Key::Char('['), Action::ControlRate(Way::Down)),
            (Key::Char(']'), Action::ControlRate(Way::Up)),
        ],
        "control rate down, up",
        Some("control rate"),
    ),
    row(
        &[
            (Key::Char('<'), Action::Depth(Way::Down)),
            (Key::Char('>'), Action::Depth(Way::Up)),
        ],
        "queue depth down, up",
        Some("depth"),
    ),
    row(
        &[(Key::Char('b'), Action::Break)],
        "break it: the policy decides 5 times a second",
        Some("break"),
    ),
    row(
        &[(Key::Char('r'), Action::Restart)],
        "start again: same seed, knobs as they stand",
        Some("restart"),
    ),
    row(
        &[(Key::Char(' '), Action::Pause)],
        "pause, or go on",
        Some("pause"),
    ),
    row(
        &[
            (Key::Char('.'), Action::StepForward),
            (RIGHT, Action::StepForward),
        ],
        "one tick of one node; looking back, one picture forward",
        Some("step"),
    ),
    row(
        &[(Key::Char(','), Action::StepBack), (LEFT, Action::StepBack)],
        "look back one picture",
        Some("back"),
    ),
    row(
        &[
            (HOME, Action::Oldest),
            (END, Action::Newest),
            (Key::Char('f'), Action::Live),
        ],
        "look at the oldest picture kept, the newest, what is live",
        None,
    ),
    row(
        &[(Key::Char('c'), Action::OtherClock)],
        "hand the running graph to the other clock",
        Some("clock"),
    ),
    row(
        &[
            (Key::Char('+'), Action::Speed(Way::Up)),
            (Key::Char('-'), Action::Speed(Way::Down)),
            (Key::Char('0'), Action::SpeedOne),
        ],
        "virtual time faster, slower, as fast as the wall's",
        Some("speed"),
    ),
    row(
        &[
            (Key::Char('{'), Action::SensorRate(Way::Down)),
            (Key::Char('}'), Action::SensorRate(Way::Up)),
        ],
        "sensor rate down, up",
        Some("sensor rate"),
    ),
    row(
        &[(Key::Char(':'), Action::Type)],
        "type an exact value, such as control-hz 7.5",
        Some("type a value"),
    ),
    row(
        &[
            (Key::Char('n'), Action::Seed(Way::Up)),
            (Key::Char('N'), Action::Seed(Way::Down)),
        ],
        "start again with the next seed, the previous one",
        Some("seed"),
    ),
    row(
        &[
            (Key::Char('p'), Action::Policy(Way::Up)),
            (Key::Char('P'), Action::Policy(Way::Down)),
        ],
        "start again with the next policy, the previous one",
        Some("policy"),
    ),
    row(
        &[
            (TAB, Action::NextPane),
            (Key::Char('1'), Action::Focus(Pane::Graph)),
            (Key::Char('2'), Action::Focus(Pane::Plant)),
            (Key::Char('3'), Action::Focus(Pane::Angle)),
            (Key::Char('4'), Action::Focus(Pane::Figures)),
            (Key::Char('5'), Action::Focus(Pane::Events)),
        ],
        "focus the next pane; graph, cart-pole, angle, figures, events",
        None,
    ),
    row(
        &[(Key::Char('z'), Action::Zoom)],
        "give the focused pane the whole screen, or take it back",
        Some("zoom"),
    ),
];

const fn row(
    keys: &'static [(Key, Action)],
    help: &'static str,
    footer: Option<&'static str>,
) -> Binding {
    Binding { keys, help, footer }
}

impl Key {
    /// What is written on the key.
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

impl Binding {
    fn labels(&self) -> Vec<String> {
        self.keys.iter().map(|(key, _)| key.label()).collect()
    }
}

/// What `event` asks for.
pub fn action(event: &KeyEvent) -> Option<Action> {
    let mut keys = BINDINGS.iter().flat_map(|binding| binding.keys);
    keys.find(|(key, _)| key.is(event))
        .map(|(_, action)| *action)
}

/// Keys and what they do.
pub fn rows() -> Vec<(String, String)> {
    BINDINGS
        .iter()
        .map(|binding| (binding.labels().join(" "), binding.help.to_owned()))
        .collect()
}

/// What the footer says: keys that type something, and what for.
pub fn hints() -> Vec<(String, &'static str)> {
    let hint = |binding: &Binding| {
        let typed = binding.keys.iter().map(|(key, _)| key);
        let typed = typed.filter(|key| matches!(key, Key::Char(_)));
        let labels: Vec<String> = typed.map(|key| key.label()).collect();
        binding.footer.map(|text| (labels.join(" "), text))
    };
    BINDINGS.iter().filter_map(hint).collect()
}

/// The table as `ratelab keys` prints it.
pub fn text() -> String {
    rows().iter().fold(String::new(), |mut text, (keys, help)| {
        let _ = writeln!(text, "{keys:<15} {help}");
        text
    })
}

/// The table as the README shows it.
#[cfg(test)]
pub fn markdown() -> String {
    let head = "| key | what it does |\n|---|---|\n".to_owned();
    BINDINGS.iter().fold(head, |mut text, binding| {
        let keys = binding.labels().into_iter();
        let keys: Vec<String> = keys.map(|label| format!("`{label}`")).collect();
        let _ = writeln!(text, "| {} | {} |", keys.join(" "), binding.help);
        text
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_has_two_meanings() {
        let keys = BINDINGS.iter().flat_map(|binding| binding.keys);
        let keys: Vec<Key> = keys.map(|(key, _)| *key).collect();
        for (index, key) in keys.iter().enumerate() {
            assert!(!keys[..index].contains(key), "{} is taken", key.label());
        }
    }

    #[test]
    fn every_action_can_be_reached_by_each_of_its_keys() {
        for binding in &BINDINGS {
            assert!(!binding.keys.is_empty(), "{} has no key", binding.help);
            for (key, done) in binding.keys {
                let event = match *key {
                    Key::Char(c) => KeyEvent::new(KeyCode::Char(c), KeyModifiers::SHIFT),
                    Key::Ctrl(c) => KeyEvent::new(KeyCode::Char(c), KeyModifiers::CONTROL),
                    Key::Named(code, _) => KeyEvent::new(code, KeyModifiers::NONE),
                };
                assert_eq!(action(&event), Some(*done), "{}", key.label());
            }
        }
    }

    #[test]
    fn the_readme_shows_this_table() {
        let readme = include_str!("../../../README.md");
        assert!(
            readme.contains(&markdown()),
            "README.md is to hold this table:\n{}",
            markdown()
        );
    }
}
