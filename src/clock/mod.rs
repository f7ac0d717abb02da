//! Virtual time, and what a clock with threads needs. Every clock asks a schedule for work, by the
//! same rules: here one thread jumps from event to event; others have threads that wait for the wall
//! (`crates/real-clock`), or play a log (`crates/re-execution`).
//!
//! A clock runs a [`Graph`] until it ends, is stopped, reaches a given run time, or is
//! handed over to another clock. All state of the run stays in the graph, so [`run`]
//! can pass it back and forth.
//!
//! Commands take effect *between* calls of a node; of a tick that takes run time that may be
//! between its begin and its end. Under the virtual clock they do so between instants: nodes that
//! are due together see the same world, and the run time of a command is enough to repeat it.

mod obey;
mod task_sets;
mod virtual_time;
mod wall;
mod worker;

pub use crate::{
    arrival::{Arrival, Wake},
    control::{
        inbox::{Received, Wait},
        state::RunWriter,
    },
    node::JobKind,
};
pub use obey::{Obeyed, Supervision, obey_at_rest};
pub use task_sets::{TaskSets, ThreadGroup};
pub use virtual_time::{RunError, VirtualClock};
pub use wall::Wall;
pub use worker::{CoreClaim, LookResult, Outcome, Worker};

use crate::{
    control::{command::ClockKind, inbox::Inbox, state::EventKind},
    graph::Graph,
    node::Fault,
    sync::get_mut,
    time::Time,
};

/// Runs a graph.
pub trait Clock {
    /// Returns the number of cores on which it can have threads take turns by priority; `None` if the
    /// system has not granted real-time priority.
    fn cores(&self) -> Option<usize> {
        None
    }

    /// Runs `graph` from its current run time up to and including `until`, and carries
    /// out the commands in `inbox`.
    ///
    /// # Errors
    /// [`Fault`] if a node failed; all other nodes have stopped by then.
    fn run(
        &mut self,
        graph: &mut Graph,
        inbox: &mut Inbox,
        until: Time,
    ) -> Result<ClockExit, Fault>;
}

/// Why a clock stopped.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ClockExit {
    /// Run time reached the requested end.
    Completed,
    /// A node ended the run.
    Ended {
        /// Name of the node.
        node: String,
        /// Run time of its last tick.
        at: Time,
    },
    /// A command stopped the run.
    Stopped,
    /// A command hands the graph to the other clock.
    HandedOver(ClockKind),
}

/// Runs a graph to its end, with handovers between the clocks. `real` runs it whenever it
/// is under the real clock.
///
/// # Errors
/// [`Fault`] if a node failed.
pub fn run(
    graph: &mut Graph,
    inbox: &mut Inbox,
    until: Time,
    first: ClockKind,
    real: &mut dyn Clock,
) -> Result<ClockExit, Fault> {
    let mut kind = first;
    graph.set_cores(real.cores());
    loop {
        let exit = match kind {
            ClockKind::Real => real.run(graph, inbox, until),
            ClockKind::Virtual => VirtualClock.run(graph, inbox, until),
        };
        match exit? {
            ClockExit::HandedOver(next) => kind = next,
            exit => return Ok(exit),
        }
    }
}

/// Comes to the `end` of a run: counts what is missed until then, and logs unfinished ticks and the
/// node that ended it. Every clock does this when it stops.
pub fn note_end(graph: &mut Graph, end: &Result<ClockExit, Fault>) {
    let now = graph.now();
    graph.control.deliver(now);
    let (at, what) = match end {
        Ok(ClockExit::HandedOver(_)) => return,
        Ok(ClockExit::Completed | ClockExit::Stopped) => (now, None),
        Ok(ClockExit::Ended { node, at }) => {
            let node = node.clone();
            (*at, Some(EventKind::Ended { node }))
        }
        Err(fault) => {
            let (node, cause) = (fault.node.clone(), fault.cause.to_string());
            (fault.at, Some(EventKind::Faulted { node, cause }))
        }
    };
    // Ticks due at the end are missed, even though no node ticks any more; a stop is before them.
    let missed_before = match end {
        Ok(ClockExit::Stopped) => at,
        _ => at + Time::RESOLUTION,
    };
    graph.schedule.close(missed_before, at);
    for slot in &mut graph.slots {
        get_mut(slot).cut_off();
    }
    if let Some(what) = what {
        graph.control.state.note(at, what);
    }
}
