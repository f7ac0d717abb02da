//! The keys of the dashboard over a run of other processes: some of the lab's.

use super::{
    Key::{Char, Ctrl},
    KeyTable, LabAction,
    LabAction::{Panes, Quit},
    OverlayContent, PaneAction, TAB,
    lab::{DEPTH, RATE, RECORD, TYPE},
    row, screen_with_panes,
};
use crate::dashboard::focus::Pane;

/// All of its keys, help and quit first. Who leaves does not end the run.
pub const REMOTE: KeyTable<LabAction> = screen_with_panes![RATE, DEPTH; TYPE, RECORD];
