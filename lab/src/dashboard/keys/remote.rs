//! The keys of the dashboard over a run of other processes.

use RemoteAction::*;

use super::{
    Key::{Char, Ctrl},
    KeyTable, TAB, row, screen_with_panes,
};
use crate::dashboard::{
    focus::Pane,
    presets::Direction::{self, Down, Up},
};

/// Actions of that dashboard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RemoteAction {
    /// Turn the rate of the marked node to the next preset.
    Rate(Direction),
    /// Turn the depth of the marked topics to the next preset.
    Depth(Direction),
    /// Open the line in which a knob is typed.
    Type,
    /// Focus the next pane.
    NextPane,
    /// Focus a pane.
    Focus(Pane),
    /// Give the focused pane the whole screen, or take it back.
    Zoom,
    /// Select the next push in the timeline, or the one before.
    Push(bool),
    /// Show a shorter stretch of the timeline, or a longer one.
    Span(bool),
    /// Explain the pane in focus.
    Explain,
    /// Show or hide the keys.
    Help,
    /// Leave; the run goes on.
    Quit,
}

/// All of its keys, help and quit first.
pub const REMOTE: KeyTable<RemoteAction> = screen_with_panes![
    RemoteAction;
    row(&[(Char('['), Rate(Down)), (Char(']'), Rate(Up))],
        "rate of the marked node down, up", Some("rate")),
    row(&[(Char('<'), Depth(Down)), (Char('>'), Depth(Up))],
        "depth of the marked topics down, up", Some("depth"));
    row(&[(Char(':'), Type)],
        "type a knob and its exact value, such as rate NODE 7.5", Some("type a value")),
];
