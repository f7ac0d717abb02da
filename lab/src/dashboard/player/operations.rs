//! Ticks that overlap, operation by operation: the run itself, held between two of them.

use ratelab::Time;

use super::Player;
use crate::{
    dashboard::{
        focus::Pane,
        knot::{KnotView, neighbour},
        presets::Direction,
    },
    recording::{Execution, Held},
};

/// A run that is held within ticks that overlap.
pub(super) struct HeldKnot {
    pub(super) run: Held,
    /// Number of the knot.
    knot: usize,
    /// Number of operations to be done.
    operations: usize,
    /// Number of operations done; `None` until it is there.
    pub(super) done: Option<usize>,
}

impl Player {
    /// Goes to the neighbouring operation of ticks that overlap.
    pub(super) fn operate(&mut self, direction: Direction) {
        self.desk.run.playing = None;
        let held = self.desk.run.held.as_ref();
        let here = held.map(|held| (held.knot, held.operations));
        let later = direction == Direction::Up;
        match neighbour(&self.knots, here, self.desk.run.at, later) {
            Some(there) => self.hold(there),
            None if self.executing.is_some() => self.desk.notify("the run is still executed again"),
            None if self.knots.is_empty() => self.desk.notify("no ticks overlap in this run"),
            None if later => self.desk.notify("no ticks overlap after this"),
            None => self.desk.notify("no ticks overlapped before this"),
        }
    }

    /// Executes the run again up to an operation of a knot; goes on from the one before.
    fn hold(&mut self, (knot, operations): (usize, usize)) {
        if let Some(held) = &mut self.desk.run.held
            && held.knot == knot
            && held.operations < operations
        {
            held.run.allow(operations);
            held.operations = operations;
            return;
        }
        self.leave_knot();
        let recording = self.desk.run.replay.shared_recording();
        match Execution::new(recording, &self.setup.system) {
            Ok(execution) => {
                let before = self.knots[knot].from.as_nanos().saturating_sub(1);
                self.go(Time::from_nanos(before));
                let held = execution.hold(knot, operations);
                self.desk.run.held = held.map(|run| HeldKnot {
                    run,
                    knot,
                    operations,
                    done: None,
                });
                self.desk.panes.focus = Pane::Timeline;
            }
            Err(error) => self.desk.notify(error.to_string()),
        }
    }

    /// Leaves the ticks that overlap, to the moment before.
    pub(super) fn leave_knot(&mut self) {
        if self.desk.run.held.take().is_some() {
            let at = self.desk.run.at;
            self.rewind();
            self.go(at);
        }
    }

    /// Follows the run on its way to an operation; returns whether there is something new.
    pub(super) fn follow_held(&mut self) -> bool {
        let Some(held) = &mut self.desk.run.held else {
            return false;
        };
        let Some(done) = held.run.done() else {
            let now = held.run.observer().now();
            self.desk.notify(format!("executing the run again: {now}"));
            return true;
        };
        let new = held.done.replace(done) != Some(done);
        if new {
            // Locks within each other are done at once.
            held.operations = done;
            self.desk.notice = self.knot().map(|knot| knot.sentence());
        }
        new
    }

    /// The knot in which the run is held.
    pub(super) fn knot(&self) -> Option<KnotView> {
        let held = self.desk.run.held.as_ref()?;
        let topology = &self.desk.run.replay.recording().origin.topology;
        Some(KnotView::of(&self.knots[held.knot], topology, held.done?))
    }
}
