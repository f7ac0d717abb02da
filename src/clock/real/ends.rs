//! How a stretch comes to its end.

use crate::{clock::ClockExit, graph::Graph, journal::End, node::Fault, time::Time};

/// The report of a node's thread when it ends.
pub(super) enum Report {
    /// The node's last tick before the end of the run is over.
    Finished,
    /// The node ended the run.
    Ended(NodeEnd),
    /// The node failed.
    Failed(NodeEnd, Fault),
    /// The node has no thread.
    NoThread(NodeEnd, Fault),
}

/// The node that ended the run, and the run time.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct NodeEnd {
    /// Its index.
    pub(super) node: usize,
    pub(super) at: Time,
}

/// The reason for the end of a stretch.
pub(super) enum StretchEnd {
    Paused,
    Exit(ClockExit),
    Ended(NodeEnd),
    Failed(NodeEnd, Fault),
    NoThread(NodeEnd, Fault),
}

impl StretchEnd {
    pub(super) fn entry(&self, until: Time) -> End {
        match self {
            Self::Paused => End::Paused,
            Self::Exit(ClockExit::Completed) => End::Completed { until },
            Self::Exit(ClockExit::HandedOver(_)) => End::HandedOver,
            Self::Exit(_) => End::Stopped,
            Self::Ended(NodeEnd { node, at }) => End::Ended {
                node: *node,
                at: *at,
            },
            Self::Failed(NodeEnd { node, at }, _) => End::Failed {
                node: *node,
                at: *at,
            },
            Self::NoThread(NodeEnd { node, at }, _) => End::NoThread {
                node: *node,
                at: *at,
            },
        }
    }

    pub(super) fn exit(self, graph: &Graph) -> Result<Option<ClockExit>, Fault> {
        match self {
            Self::Paused => Ok(None),
            Self::Exit(exit) => Ok(Some(exit)),
            Self::Ended(NodeEnd { node, at }) => Ok(Some(ClockExit::Ended {
                node: graph.seats[node].name.to_string(),
                at,
            })),
            Self::Failed(_, fault) | Self::NoThread(_, fault) => Err(fault),
        }
    }
}

impl Report {
    /// The report after a tick that was the last one of node number `node`.
    pub(super) fn of(node: usize, outcome: Result<Time, Fault>) -> Self {
        match outcome {
            Ok(at) => Self::Ended(NodeEnd { node, at }),
            Err(fault) => Self::Failed(NodeEnd { node, at: fault.at }, fault),
        }
    }

    /// The end of the stretch, if this is one.
    pub(super) fn end(self) -> Option<StretchEnd> {
        match self {
            Self::Finished => None,
            Self::Ended(end) => Some(StretchEnd::Ended(end)),
            Self::Failed(end, fault) => Some(StretchEnd::Failed(end, fault)),
            Self::NoThread(end, fault) => Some(StretchEnd::NoThread(end, fault)),
        }
    }
}
