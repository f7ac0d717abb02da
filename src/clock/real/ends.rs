//! How a stretch comes to its end.

use crate::time::Time;
use crate::{clock::ClockExit, command::ClockKind, graph::Graph, journal::End, node::Fault};

/// The report of a thread that ends before it is told to: that its last tick before the end of the
/// run is over, or why the stretch ends.
pub(super) type Report = Option<StretchEnd>;

/// The reason for the end of a stretch.
pub(super) struct StretchEnd {
    pub(super) end: End,
    /// The failure, if it was one.
    pub(super) fault: Option<Fault>,
}

impl From<End> for StretchEnd {
    fn from(end: End) -> Self {
        let fault = None;
        Self { end, fault }
    }
}

impl StretchEnd {
    /// The end after a tick that was the last one of node number `node`.
    pub(super) fn of(node: usize, outcome: Result<Time, Fault>) -> Self {
        match outcome {
            Ok(at) => End::Ended { node, at }.into(),
            Err(fault) => Self {
                end: End::Failed { node, at: fault.at },
                fault: Some(fault),
            },
        }
    }

    /// What it is for the clock; `None` for a pause.
    pub(super) fn exit(self, graph: &Graph) -> Result<Option<ClockExit>, Fault> {
        if let Some(fault) = self.fault {
            return Err(fault);
        }
        Ok(match self.end {
            End::Completed { .. } => Some(ClockExit::Completed),
            End::Ended { node, at } => Some(ClockExit::Ended {
                node: graph.seats[node].name.to_string(),
                at,
            }),
            End::HandedOver => Some(ClockExit::HandedOver(ClockKind::Virtual)),
            End::Paused => None,
            _ => Some(ClockExit::Stopped),
        })
    }
}
