//! The number of ticks of a node by a given run time, according to its rates.

use std::collections::VecDeque;

use ratelab::{Event, Hz, Knob, KnobKind, NodeTopology, Rate, Time};
use ratelab_study::system::Setup;

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
    /// The schedule of `node` in a run with this `setup` and these `events`.
    pub fn new(node: &NodeTopology, setup: &Setup, events: &[Event]) -> Self {
        let turned = events.iter().filter_map(Event::change);
        let turned: Vec<_> = turned
            .filter(|timed| timed.knob.target() == node.name)
            .collect();
        let knobs = || {
            let set = setup.iter().filter(|knob| knob.target() == node.name);
            set.chain(turned.iter().map(|timed| &timed.knob))
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

    /// Whether tick `number` is possible at `at`, which is not before the time of the
    /// last call.
    pub fn allows(&mut self, number: u64, at: Time) -> bool {
        let due = self.ticks_before(at);
        let (most, least) = (
            due.saturating_add(self.slack),
            due.saturating_sub(self.slack),
        );
        self.wrong || (number <= most && (self.may_miss || least <= number))
    }

    /// Whether run time can have reached `at` without a tick after tick `last`.
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

/// Whether `knob`, of a node, makes ticks last, late or rare.
fn makes_rare(knob: &Knob) -> bool {
    knob.kind().is_time() || knob.kind().has_no_value()
}

#[cfg(test)]
mod tests {
    use ratelab::{NodeTopology, Time};
    use ratelab_study::system::Setup;

    use super::TickSchedule;
    use crate::tests::{hz, ms, turned_rate};

    /// 50 Hz, then 10 Hz from 0.5 s on, with the knobs in `setup`.
    fn schedule(setup: &Setup) -> TickSchedule {
        let node = NodeTopology {
            name: "policy".to_owned(),
            priority: 1,
            hz: hz(50.0),
            meters: Vec::new(),
            triggers: Vec::new(),
            matching: "each".to_owned(),
            executor: None,
            executor_index: None,
            group: None,
        };
        TickSchedule::new(&node, setup, &[turned_rate(ms(500), "policy", 10.0)])
    }

    #[test]
    fn ticks_are_where_the_rates_have_them_and_none_rests_for_longer() {
        let schedule = || schedule(&Setup::default());
        // Every 20 ms before the change; then 0.58 s, 0.68 s and so on.
        let due = [0, 1, 480, 500, 580, 581, 1580].map(|at| schedule().ticks_before(ms(at)));
        assert_eq!(due, [0, 1, 24, 25, 25, 26, 35]);
        let late = ms(1_000_000_000_000);
        for (number, at, allowed) in [
            (24, ms(480), true),
            (35, ms(1580), true),
            (1 << 62, late, false),
        ] {
            assert_eq!(schedule().allows(number, at), allowed, "{at}");
        }
        for (at, rests) in [(ms(680), true), (ms(10_000), false), (Time::MAX, false)] {
            assert_eq!(schedule().may_rest(25, at), rests, "{at}");
        }
    }

    #[test]
    fn ticks_that_take_time_may_be_fewer_and_never_more() {
        let setup = Setup::default().with("takes policy 60".parse().expect("a knob"));
        let mut schedule = schedule(&setup);
        assert!(schedule.allows(8, ms(480)));
        assert!(!schedule.allows(40, ms(490)));
        assert!(schedule.may_rest(8, ms(10_000)));
    }
}
