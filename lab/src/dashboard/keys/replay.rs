//! The keys of a recording that is played.

use crossterm::event::KeyCode;

use super::{END, HOME, Key, KeyTable, LEFT, RIGHT, row, screen_with_panes};
use crate::dashboard::{focus::Pane, presets::Direction};

/// What a person can do with a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReplayAction {
    /// Play, or stand still.
    Play,
    /// Go to the next thing that happened, or the last one before.
    Step(Direction),
    /// Go on or back by a second of run time.
    Second(Direction),
    /// Go to the next event, or the last one before.
    Event(Direction),
    /// Go to the beginning.
    Start,
    /// Go to the end.
    End,
    /// Play faster or slower.
    Speed(Direction),
    /// Play as fast as the run was in its own time.
    SpeedOne,
    /// Focus the next pane.
    NextPane,
    /// Focus a pane.
    Focus(Pane),
    /// Give the focused pane the whole screen, or take it back.
    Zoom,
    /// Explain the pane in focus.
    Explain,
    /// Show or hide the keys.
    Help,
    /// Leave.
    Quit,
}

const PAGE_UP: Key = Key::Named(KeyCode::PageUp, "PgUp");
const PAGE_DOWN: Key = Key::Named(KeyCode::PageDown, "PgDn");

/// All keys of the replay, the way out first.
pub const REPLAY: KeyTable<ReplayAction> = screen_with_panes![
    ReplayAction;
    row(
        &[(Key::Char(' '), ReplayAction::Play)],
        "play, or stand still",
        Some("play"),
    ),
    row(
        &[
            (Key::Char(','), ReplayAction::Step(Direction::Down)),
            (Key::Char('.'), ReplayAction::Step(Direction::Up)),
            (LEFT, ReplayAction::Step(Direction::Down)),
            (RIGHT, ReplayAction::Step(Direction::Up)),
        ],
        "to the messages before, to the next messages",
        Some("step"),
    ),
    row(
        &[
            (PAGE_UP, ReplayAction::Second(Direction::Down)),
            (PAGE_DOWN, ReplayAction::Second(Direction::Up)),
        ],
        "a second back, a second on",
        None,
    ),
    row(
        &[
            (Key::Char('N'), ReplayAction::Event(Direction::Down)),
            (Key::Char('n'), ReplayAction::Event(Direction::Up)),
        ],
        "to the event before, to the next event",
        Some("event"),
    ),
    row(
        &[(HOME, ReplayAction::Start), (END, ReplayAction::End)],
        "to the beginning, to the end",
        None,
    ),
    row(
        &[
            (Key::Char('+'), ReplayAction::Speed(Direction::Up)),
            (Key::Char('-'), ReplayAction::Speed(Direction::Down)),
            (Key::Char('0'), ReplayAction::SpeedOne),
        ],
        "play faster, slower, as fast as it was",
        Some("speed"),
    ),
];
