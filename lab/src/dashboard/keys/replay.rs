//! The keys of a recording that is played.

use crossterm::event::KeyCode;

use super::{END, HOME, Key, LEFT, RIGHT, Table, row, screen_with_panes};
use crate::dashboard::{focus::Pane, ladder::Way};

/// What a person can do with a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Play, or stand still.
    Play,
    /// Go to the next thing that happened, or the last one before.
    Step(Way),
    /// Go on or back by a second of run time.
    Second(Way),
    /// Go to the next event, or the last one before.
    Event(Way),
    /// Go to the beginning.
    Start,
    /// Go to the end.
    End,
    /// Play faster or slower.
    Speed(Way),
    /// Play as fast as the run was in its own time.
    SpeedOne,
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

const PAGE_UP: Key = Key::Named(KeyCode::PageUp, "PgUp");
const PAGE_DOWN: Key = Key::Named(KeyCode::PageDown, "PgDn");

/// All keys of the replay, the way out first.
pub const REPLAY: Table<Action> = screen_with_panes![
    Action;
    row(
        &[(Key::Char(' '), Action::Play)],
        "play, or stand still",
        Some("play"),
    ),
    row(
        &[
            (Key::Char(','), Action::Step(Way::Down)),
            (Key::Char('.'), Action::Step(Way::Up)),
            (LEFT, Action::Step(Way::Down)),
            (RIGHT, Action::Step(Way::Up)),
        ],
        "to the messages before, to the next messages",
        Some("step"),
    ),
    row(
        &[
            (PAGE_UP, Action::Second(Way::Down)),
            (PAGE_DOWN, Action::Second(Way::Up)),
        ],
        "a second back, a second on",
        None,
    ),
    row(
        &[
            (Key::Char('N'), Action::Event(Way::Down)),
            (Key::Char('n'), Action::Event(Way::Up)),
        ],
        "to the event before, to the next event",
        Some("event"),
    ),
    row(
        &[(HOME, Action::Start), (END, Action::End)],
        "to the beginning, to the end",
        None,
    ),
    row(
        &[
            (Key::Char('+'), Action::Speed(Way::Up)),
            (Key::Char('-'), Action::Speed(Way::Down)),
            (Key::Char('0'), Action::SpeedOne),
        ],
        "play faster, slower, as fast as it was",
        Some("speed"),
    ),
];
