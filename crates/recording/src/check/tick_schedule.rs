//! The number of ticks of a node by a given run time, according to its rates.

use std::collections::VecDeque;

use ratelab::{Event, Hz, Knob, KnobKind, NodeTopology, Rate, Time};
use ratelab_system::Setup;

/// The ticks of a node under the virtual clock, from its first rate and all changes of
/// it, followed through run time. The cost is independent of the length of the run.
pub struct TickSchedule {
    rate: Rate,
    /// Number of ticks due before the next one.
    ticks: u64,
    /// Later changes, in order.
    ahead: VecDeque<(Time, Hz)>,
    /// Maximum error of a count: one, plus one for each change of rate, so that
    /// recordings stay valid when the handling of changes is revised.
    slack: u64,
    /// Whether some due ticks may have been missed: its ticks had a duration, lateness or offset,
    /// or it stopped for a while.
    pub may_miss: bool,
    /// Whether its clock had an error, so that due times were skipped or repeated.
    wrong: bool,
}

impl TickSchedule {
    /// Creates the schedule of `node` in a run with this `setup` and these `events`.
    pub fn new(node: &NodeTopology, setup: &Setup, events: &[Event]) -> Self {
        let turned: Vec<_> = events
            .iter()
            .filter_map(Event::change)
            .filter(|timed| timed.knob.target() == node.name)
            .collect();
        let knobs = || {
            setup
                .iter()
                .filter(|knob| knob.target() == node.name)
                .chain(turned.iter().map(|timed| &timed.knob))
        };
        let changes = turned.iter().filter_map(|timed| match timed.knob {
            Knob::Rate { hz, .. } => Some((timed.at, hz)),
            _ => None,
        });
        let ahead: VecDeque<_> = changes.collect();
        let rare = turned.iter().filter(|timed| makes_rare(&timed.knob));
        Self {
            rate: Rate::new(node.hz, Time::ZERO),
            ticks: 0,
            slack: 1 + (ahead.len() + rare.count()) as u64,
            ahead,
            may_miss: knobs().any(makes_rare) || node.executor.is_some(),
            wrong: !node.triggers.is_empty() || knobs().any(|knob| knob.kind() == KnobKind::Clock),
        }
    }

    /// Returns whether tick `number` is possible at `at`, which is not before the time of the last
    /// call.
    pub fn allows(&mut self, number: u64, at: Time) -> bool {
        let due = self.ticks_before(at);
        let (most, least) = (
            due.saturating_add(self.slack),
            due.saturating_sub(self.slack),
        );
        self.wrong || (number <= most && (self.may_miss || least <= number))
    }

    /// Returns whether run time can have reached `at` without a tick after tick `last`.
    pub fn may_rest(&mut self, last: u64, at: Time) -> bool {
        let due = self.ticks_before(at).saturating_sub(self.slack);
        self.may_miss || self.wrong || due <= last.saturating_add(1)
    }

    fn ticks_before(&mut self, at: Time) -> u64 {
        while let Some((change, hz)) = self.ahead.pop_front_if(|(change, _)| *change <= at) {
            self.advance_to(change);
            self.rate.set_hz(hz, change);
        }
        self.advance_to(at);
        self.ticks
    }

    fn advance_to(&mut self, at: Time) {
        if self.rate.due() < at {
            let skipped = self.rate.advance_past(at);
            self.ticks = self.ticks.saturating_add(skipped).saturating_add(1);
        }
    }
}

/// Returns whether `knob`, of a node, makes ticks last, late or rare.
fn makes_rare(knob: &Knob) -> bool {
    knob.kind().is_time() || knob.kind().has_no_value()
}
