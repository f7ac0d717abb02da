//! The keys of the cliff map. All others do what they do in the lab.

use MapAction::*;
use crossterm::event::KeyCode;

use super::{DOWN, Key, KeyTable, LEFT, RIGHT, UP, row};
use crate::dashboard::presets::Direction::{self, Down, Up};

/// Actions on the map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapAction {
    /// Go to the next rate.
    Rate(Direction),
    /// Go to the next seed.
    Seed(Direction),
    /// Turn another quantity from column to column.
    Columns,
    /// Turn another quantity from row to row.
    Rows,
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
        &[(LEFT, Rate(Down)), (RIGHT, Rate(Up))],
        "to the next lower rate, the next higher",
        Some("rate"),
    ),
    row(
        &[(UP, Seed(Down)), (DOWN, Seed(Up))],
        "to the previous seed, the next",
        Some("seed"),
    ),
    row(
        &[(Key::Char('x'), Columns)],
        "columns of another knob: rate, delay, loss, cost",
        Some("columns"),
    ),
    row(
        &[(Key::Char('y'), Rows)],
        "rows of another knob, or of seeds",
        Some("rows"),
    ),
    row(
        &[(ENTER, Run)],
        "start again live, as at this place",
        Some("run it live"),
    ),
    row(
        &[(ESC, Close), (Key::Char('m'), Close)],
        "close the map",
        Some("close"),
    ),
]);
