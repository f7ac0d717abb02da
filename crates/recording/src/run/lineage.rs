//! The lineage of a recorded run.

use ratelab::{Event, Knob, Time, TimedKnob};
use ratelab_experiment::{RunAge, RunAges, Summary};
use ratelab_metrics::{Lineage, TickRecord};
use ratelab_system::{PlanBar, PlanBars, Planning, System};

use super::recording::Recording;

impl Recording {
    /// Returns the chains behind the actions of the run.
    pub fn lineage(&self) -> Lineage {
        let setup = self.origin.config.setup.iter();
        let mut lineage = Lineage::new(self.origin.topology.clone(), setup);
        self.events.iter().for_each(|event| lineage.event(event));
        for (topic, rows) in self.topics.iter().enumerate() {
            rows.heads()
                .iter()
                .for_each(|head| lineage.message(topic, head));
        }
        for (node, ticks) in self.ticks.iter().enumerate() {
            ticks
                .iter()
                .for_each(|tick| lineage.tick(node, tick.clone()));
        }
        lineage.settle();
        lineage
    }

    /// Returns whether it holds the run from its start.
    pub fn begins_with_run(&self) -> bool {
        let mut ticks = self.ticks.iter().filter_map(|ticks| ticks.first());
        let mut heads = self.topics.iter().filter_map(|rows| rows.heads().first());
        ticks.all(|tick| tick.number == 0) && heads.all(|head| head.seq == 0)
    }

    /// Returns the ages of the whole run of `system` with this `summary`, with their parts; none
    /// without all messages and ticks.
    pub fn ages(&self, system: &dyn System, summary: &Summary) -> Vec<RunAge> {
        let lost = self.outcome.as_ref().map_or(0, |outcome| outcome.lost);
        match lost {
            0 => RunAges::new(system, self.lineage()).finish(summary.sim_time, &summary.nodes),
            _ => Vec::new(),
        }
    }

    /// Returns the plans of the run as bars, by lane.
    pub fn plan_lanes(&self, planning: &Planning) -> Vec<Vec<PlanBar>> {
        PlanBars::of(planning, |topic| self.rows(topic)).lanes()
    }

    /// Returns the knobs of the run in the order in which they were turned, beginning with the
    /// knobs of the start.
    pub fn knobs(&self) -> Vec<TimedKnob> {
        let start = self
            .origin
            .config
            .setup
            .iter()
            .cloned()
            .map(|knob| TimedKnob {
                at: Time::ZERO,
                knob,
            });
        let later = self.events.iter().filter_map(Event::knob);
        start.chain(later).collect()
    }

    /// Finds the time at which each tick of all nodes published and acted: the end of a
    /// tick with a configured duration, the start of any other.
    pub(crate) fn find_ends(&mut self) {
        let knobs = self.knobs();
        let nodes = self.origin.topology.nodes.iter();
        for (node, ticks) in nodes.zip(&mut self.run.ticks) {
            let mut mine = knobs
                .iter()
                .filter(|timed| timed.knob.target() == node.name)
                .peekable();
            let (mut takes, mut hangs) = (false, false);
            for tick in ticks {
                while let Some(timed) = mine.next_if(|timed| timed.at <= tick.at) {
                    match &timed.knob {
                        Knob::Takes { .. } => takes = timed.knob.takes_time(),
                        Knob::Hang { .. } => hangs = true,
                        Knob::Crash { .. } | Knob::Restart { .. } => hangs = false,
                        _ => {}
                    }
                }
                tick.ends = if std::mem::take(&mut hangs) || takes {
                    tick.took.map(|took| tick.at + took)
                } else {
                    Some(tick.at)
                };
            }
        }
    }
}

/// Returns the end of a tick; under the real clock in wall time.
pub fn end_of(tick: &TickRecord) -> Time {
    let took = tick.lateness.and(tick.took).unwrap_or_default();
    tick.ends.unwrap_or(tick.at).max(tick.at + took)
}
