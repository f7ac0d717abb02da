//! The keys of the cliff map. All others do what they do in the lab.

use crossterm::event::KeyCode;

use super::{DOWN, Key, KeyTable, LEFT, RIGHT, UP, row};
use crate::dashboard::presets::Direction;

/// What a person can do with the map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapAction {
    /// Go to the next rate.
    Rate(Direction),
    /// Go to the next seed.
    Seed(Direction),
    /// Run the cell live.
    Run,
    /// Close the map.
    Close,
}

const ENTER: Key = Key::Named(KeyCode::Enter, "Enter");
const ESC: Key = Key::Named(KeyCode::Esc, "Esc");

/// All keys of the map.
pub const MAP: KeyTable<MapAction> = KeyTable(&[
    row(
        &[
            (LEFT, MapAction::Rate(Direction::Down)),
            (RIGHT, MapAction::Rate(Direction::Up)),
        ],
        "to the next lower rate, the next higher",
        Some("rate"),
    ),
    row(
        &[
            (UP, MapAction::Seed(Direction::Down)),
            (DOWN, MapAction::Seed(Direction::Up)),
        ],
        "to the previous seed, the next",
        Some("seed"),
    ),
    row(
        &[(ENTER, MapAction::Run)],
        "start again live, with this rate and this seed",
        Some("run it live"),
    ),
    row(
        &[(ESC, MapAction::Close), (Key::Char('m'), MapAction::Close)],
        "close the map",
        Some("close"),
    ),
]);
