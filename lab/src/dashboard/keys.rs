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

/// A row of the table.
pub struct Binding {
    /// What it does.
    pub action: Action,
    /// The keys that do it.
    pub keys: &'static [Key],
    /// What it does, in words.
    pub help: &'static str,
    /// What the footer says, for those that it shows; a text that a row above
    /// has said already is not said twice.
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

/// All keys of the lab.
pub const BINDINGS: [Binding; 32] = [
    row(
        Action::ControlRate(Way::Down),
        &[Key::Char('[')],
        "control rate down",
        Some("control rate"),
    ),
    row(
        Action::ControlRate(Way::Up),
        &[Key::Char(']')],
        "control rate up",
        Some("control rate"),
    ),
    row(
        Action::Depth(Way::Down),
        &[Key::Char('<')],
        "queue depth down",
        Some("depth"),
    ),
    row(
        Action::Depth(Way::Up),
        &[Key::Char('>')],
        "queue depth up",
        Some("depth"),
    ),
    row(
        Action::Break,
        &[Key::Char('b')],
        "break it: the policy decides 5 times a second",
        Some("break"),
    ),
    row(
        Action::Pause,
        &[Key::Char(' ')],
        "pause, or go on",
        Some("pause"),
    ),
    row(
        Action::StepForward,
        &[Key::Char('.'), RIGHT],
        "one tick of one node; while looking back, one picture forward",
        Some("step"),
    ),
    row(
        Action::StepBack,
        &[Key::Char(','), LEFT],
        "look back one picture",
        Some("back"),
    ),
    row(
        Action::Oldest,
        &[HOME],
        "look at the oldest picture kept",
        None,
    ),
    row(Action::Newest, &[END], "look at the newest picture", None),
    row(Action::Live, &[Key::Char('f')], "back to live", None),
    row(
        Action::Restart,
        &[Key::Char('r')],
        "start again: same seed, same knobs",
        Some("restart"),
    ),
    row(
        Action::OtherClock,
        &[Key::Char('c')],
        "hand the running graph to the other clock",
        Some("clock"),
    ),
    row(
        Action::Speed(Way::Up),
        &[Key::Char('+')],
        "virtual time faster",
        Some("speed"),
    ),
    row(
        Action::Speed(Way::Down),
        &[Key::Char('-')],
        "virtual time slower",
        Some("speed"),
    ),
    row(
        Action::SpeedOne,
        &[Key::Char('0')],
        "virtual time as fast as the wall's",
        None,
    ),
    row(
        Action::SensorRate(Way::Down),
        &[Key::Char('{')],
        "sensor rate down",
        Some("sensor rate"),
    ),
    row(
        Action::SensorRate(Way::Up),
        &[Key::Char('}')],
        "sensor rate up",
        Some("sensor rate"),
    ),
    row(
        Action::Type,
        &[Key::Char(':')],
        "type an exact value, such as control-hz 7.5",
        Some("type a value"),
    ),
    row(
        Action::Seed(Way::Up),
        &[Key::Char('n')],
        "start again with the next seed",
        Some("seed"),
    ),
    row(
        Action::Seed(Way::Down),
        &[Key::Char('N')],
        "start again with the previous seed",
        Some("seed"),
    ),
    row(
        Action::Policy(Way::Up),
        &[Key::Char('p')],
        "start again with the next policy",
        Some("policy"),
    ),
    row(
        Action::Policy(Way::Down),
        &[Key::Char('P')],
        "start again with the previous policy",
        Some("policy"),
    ),
    row(Action::NextPane, &[TAB], "focus the next pane", None),
    row(
        Action::Focus(Pane::Graph),
        &[Key::Char('1')],
        "focus the graph",
        None,
    ),
    row(
        Action::Focus(Pane::Plant),
        &[Key::Char('2')],
        "focus the cart-pole",
        None,
    ),
    row(
        Action::Focus(Pane::Angle),
        &[Key::Char('3')],
        "focus the pole angle",
        None,
    ),
    row(
        Action::Focus(Pane::Figures),
        &[Key::Char('4')],
        "focus topics and latency",
        None,
    ),
    row(
        Action::Focus(Pane::Events),
        &[Key::Char('5')],
        "focus verdict and events",
        None,
    ),
    row(
        Action::Zoom,
        &[Key::Char('z')],
        "give the focused pane the whole screen, or take it back",
        Some("zoom"),
    ),
    row(
        Action::Help,
        &[Key::Char('?')],
        "show or hide this help",
        Some("keys"),
    ),
    row(
        Action::Quit,
        &[Key::Char('q'), Key::Ctrl('c')],
        "quit",
        Some("quit"),
    ),
];

const fn row(
    action: Action,
    keys: &'static [Key],
    help: &'static str,
    footer: Option<&'static str>,
) -> Binding {
    Binding {
        action,
        keys,
        help,
        footer,
    }
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
    /// The keys of this row, as text.
    pub fn labels(&self) -> String {
        let labels: Vec<String> = self.keys.iter().map(|key| key.label()).collect();
        labels.join(" ")
    }
}

/// What `event` asks for.
pub fn action(event: &KeyEvent) -> Option<Action> {
    let pressed = |binding: &&Binding| binding.keys.iter().any(|key| key.is(event));
    BINDINGS.iter().find(pressed).map(|binding| binding.action)
}

/// Keys and what they do.
pub fn rows() -> Vec<(String, String)> {
    BINDINGS
        .iter()
        .map(|binding| (binding.labels(), binding.help.to_owned()))
        .collect()
}

/// What the footer says: the first key of each row, rows of one text together.
pub fn hints() -> Vec<(String, &'static str)> {
    let mut hints: Vec<(String, &str)> = Vec::new();
    for binding in &BINDINGS {
        let Some(text) = binding.footer else {
            continue;
        };
        let label = binding
            .keys
            .first()
            .map_or(String::new(), |key| key.label());
        match hints.iter_mut().find(|(_, said)| *said == text) {
            Some((labels, _)) => labels.push_str(&format!(" {label}")),
            None => hints.push((label, text)),
        }
    }
    hints
}

/// The table as `ratelab keys` prints it.
pub fn text() -> String {
    rows().iter().fold(String::new(), |mut text, (keys, help)| {
        let _ = writeln!(text, "{keys:<10} {help}");
        text
    })
}

/// The table as the README shows it.
#[cfg(test)]
pub fn markdown() -> String {
    let head = "| key | what it does |\n|---|---|\n".to_owned();
    BINDINGS.iter().fold(head, |mut text, binding| {
        let keys = binding.keys.iter().map(|key| format!("`{}`", key.label()));
        let keys: Vec<String> = keys.collect();
        let _ = writeln!(text, "| {} | {} |", keys.join(" "), binding.help);
        text
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_has_two_meanings() {
        let keys: Vec<Key> = BINDINGS.iter().flat_map(|b| b.keys).copied().collect();
        for (index, key) in keys.iter().enumerate() {
            assert!(!keys[..index].contains(key), "{} is taken", key.label());
        }
    }

    #[test]
    fn every_action_can_be_reached_by_each_of_its_keys() {
        for binding in &BINDINGS {
            assert!(!binding.keys.is_empty(), "{} has no key", binding.help);
            for key in binding.keys {
                let event = match *key {
                    Key::Char(c) => KeyEvent::new(KeyCode::Char(c), KeyModifiers::SHIFT),
                    Key::Ctrl(c) => KeyEvent::new(KeyCode::Char(c), KeyModifiers::CONTROL),
                    Key::Named(code, _) => KeyEvent::new(code, KeyModifiers::NONE),
                };
                assert_eq!(action(&event), Some(binding.action), "{}", key.label());
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
