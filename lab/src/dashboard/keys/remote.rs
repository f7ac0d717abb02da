//! The keys of the dashboard over a run of other processes.

use RemoteAction::*;

use super::{
    Key::{Char, Ctrl},
    KeyTable, PaneAction, TAB, row, screen_with_panes,
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
    /// Start a recording, or end it.
    Record,
    /// An action on the panes.
    Panes(PaneAction),
    /// Leave; the run goes on.
    Quit,
}

/// All of its keys, help and quit first.
pub const REMOTE: KeyTable<RemoteAction> = screen_with_panes![
    row(&[(Char('['), Rate(Down)), (Char(']'), Rate(Up))],
        "rate of the marked node down, up", Some("rate")),
    row(&[(Char('<'), Depth(Down)), (Char('>'), Depth(Up))],
        "depth of the marked topics down, up", Some("depth"));
    row(&[(Char(':'), Type)],
        "type a knob and its exact value, such as rate NODE 7.5", Some("type a value")),
    row(&[(Char('w'), Record)],
        "record to a file in the folder recordings, or stop recording", Some("record")),
];
