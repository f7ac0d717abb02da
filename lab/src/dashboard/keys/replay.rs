//! The keys of a replay.

use ReplayAction::*;
use crossterm::event::KeyCode;

use super::{
    END, HOME,
    Key::{self, Char, Ctrl},
    KeyTable, LEFT, OverlayContent, PaneAction, RIGHT, TAB, row, screen_with_panes,
};
use crate::dashboard::{
    focus::Pane,
    presets::Direction::{self, Down, Up},
};

/// Actions in a replay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReplayAction {
    /// Play, or stand still.
    Play,
    /// Go to the next messages or ticks, or to the last ones before.
    Step(Direction),
    /// Go to the next operation of ticks that overlap, or to the last one before.
    Operation(Direction),
    /// Leave the run at this moment, with a knob turned.
    Branch,
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
    /// An action on the panes.
    Panes(PaneAction),
    /// Leave.
    Quit,
}

const PAGE_UP: Key = Key::Named(KeyCode::PageUp, "PgUp");
const PAGE_DOWN: Key = Key::Named(KeyCode::PageDown, "PgDn");

/// All keys of the replay, help and quit first.
pub const REPLAY: KeyTable<ReplayAction> = screen_with_panes![
    row(&[(Char(' '), Play)], "play, or stand still", Some("play")),
    row(&[(Char(','), Step(Down)), (Char('.'), Step(Up)), (LEFT, Step(Down)), (RIGHT, Step(Up))],
        "to the messages before, to the next messages", Some("step"));
    row(&[(Char('O'), Operation(Down)), (Char('o'), Operation(Up))],
        "where ticks overlap: to the operation before, to the next one", Some("operation")),
    row(&[(PAGE_UP, Second(Down)), (PAGE_DOWN, Second(Up))],
        "a second back, a second on", None),
    row(&[(Char('N'), Event(Down)), (Char('n'), Event(Up))],
        "to the event before, to the next event", Some("event")),
    row(&[(HOME, Start), (END, End)],
        "to the beginning, to the end", None),
    row(&[(Char('+'), Speed(Up)), (Char('-'), Speed(Down)), (Char('0'), SpeedOne)],
        "play faster, slower, as fast as it was", Some("speed")),
    row(&[(Char('B'), Branch)],
        "branch: this run again up to here, then with a knob turned", Some("branch")),
];
