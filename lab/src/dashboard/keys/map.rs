//! The keys of the cliff map. All others do what they do in the lab.

use crossterm::event::KeyCode;

use super::{Key, LEFT, RIGHT, Table, row};
use crate::dashboard::ladder::Way;

/// What a person can do with the map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Go to the next rate.
    Rate(Way),
    /// Go to the next seed.
    Seed(Way),
    /// Run the cell live.
    Run,
    /// Close the map.
    Close,
}

const UP: Key = Key::Named(KeyCode::Up, "↑");
const DOWN: Key = Key::Named(KeyCode::Down, "↓");
const ENTER: Key = Key::Named(KeyCode::Enter, "Enter");
const ESC: Key = Key::Named(KeyCode::Esc, "Esc");

/// All keys of the map.
pub const MAP: Table<Action> = Table(&[
    row(
        &[
            (LEFT, Action::Rate(Way::Down)),
            (RIGHT, Action::Rate(Way::Up)),
        ],
        "to the next lower control rate, the next higher",
        Some("control rate"),
    ),
    row(
        &[(UP, Action::Seed(Way::Down)), (DOWN, Action::Seed(Way::Up))],
        "to the previous seed, the next",
        Some("seed"),
    ),
    row(
        &[(ENTER, Action::Run)],
        "start again live, with this control rate and this seed",
        Some("run it live"),
    ),
    row(
        &[(ESC, Action::Close), (Key::Char('m'), Action::Close)],
        "close the map",
        Some("close"),
    ),
]);
