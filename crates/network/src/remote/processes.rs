//! The processes of a run: what runs where, by which clock, and whether it still reports.

use std::{
    collections::{HashMap, HashSet},
    time::{Duration, Instant},
};

use crate::{
    machine::{ClockId, Nanos},
    telemetry::{Batch, Info, TopicCounts},
    times::Estimate,
};
use ratelab::{Command, Event, EventKind};

use ratelab_recording::ProcessRecord;

/// Time without a report after which a process counts as gone.
pub(super) const GONE: Duration = Duration::from_millis(500);

/// A time or a difference of times (ns), with its greatest error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Inexact {
    /// Its middle.
    pub nanos: Nanos,
    /// How far the true one is from that at the most.
    pub error: Nanos,
}

/// All processes that were there, without replaced ones.
#[derive(Default)]
pub struct Processes {
    /// The one that listens, and how its run began.
    pub(super) hub: Option<Info>,
    pub(super) all: HashMap<u64, Process>,
    /// The processes that are connected.
    present: HashSet<u64>,
    /// How far their clocks are ahead of ours.
    clocks: HashMap<ClockId, Estimate>,
    /// Messages of this run lost unread in processes that were replaced, by topic.
    dropped_before: HashMap<usize, u64>,
}

/// A process and its reports.
pub(super) struct Process {
    pub(super) info: Info,
    /// Number of its last report.
    batch: u64,
    pub(super) heard: Instant,
    pub(super) counts: Vec<TopicCounts>,
    /// Messages lost unread before this run, by topic.
    dropped_before: HashMap<usize, u64>,
    /// Greatest error of its times in the run time of the one that listens; `None` while
    /// unknown.
    pub(super) bound: Option<Nanos>,
    /// Number of its events so far.
    events: usize,
}

impl Process {
    fn new(info: Info) -> Self {
        Self {
            info,
            batch: 0,
            heard: Instant::now(),
            counts: Vec::new(),
            dropped_before: HashMap::new(),
            bound: None,
            events: 0,
        }
    }

    /// Returns the messages of a topic lost unread in this run.
    fn dropped(&self, topic: usize) -> u64 {
        let counts = self.counts.iter().filter(|counts| counts.topic == topic);
        let all = total(counts.map(|counts| counts.dropped));
        all.saturating_sub(self.dropped_before.get(&topic).copied().unwrap_or(0))
    }
}

impl Processes {
    /// Returns the process that listens.
    pub fn hub(&self) -> Option<&Info> {
        self.hub.as_ref()
    }

    /// Begins another run, that of `hub`.
    pub fn begin(&mut self, hub: &Info) {
        self.hub = Some(hub.clone());
        self.dropped_before.clear();
        // What was lost in a run before is none of this one.
        self.all
            .retain(|_, process| hub.shared(&process.info).is_empty());
        for process in self.all.values_mut() {
            let counts = process.counts.iter();
            process.dropped_before = counts.map(|c| (c.topic, c.dropped)).collect();
        }
    }

    /// Notes which processes are connected.
    pub fn set_present(&mut self, present: impl Iterator<Item = u64>) {
        self.present = present.collect();
    }

    /// Notes how far a clock is ahead of ours.
    pub fn set_clock(&mut self, clock: ClockId, ahead: Estimate) {
        self.clocks.insert(clock, ahead);
    }

    /// Returns whether a process is known.
    pub fn know(&self, incarnation: u64) -> bool {
        self.all.contains_key(&incarnation)
    }

    /// Adds a process in place of one that ran the same nodes.
    pub fn add(&mut self, info: Info) {
        let same = |other: &Process| !info.shared(&other.info).is_empty();
        for (_, replaced) in self.all.extract_if(|_, other| same(other)) {
            for TopicCounts { topic, .. } in &replaced.counts {
                let before = self.dropped_before.entry(*topic).or_default();
                *before = before.saturating_add(replaced.dropped(*topic));
            }
        }
        self.all.insert(info.incarnation, Process::new(info));
    }

    /// Notes a report of process `from`, whose times have at most the error `bound`; returns
    /// the number of reports missing before it.
    pub fn report(&mut self, from: u64, batch: &Batch, bound: Nanos) -> u64 {
        let Some(process) = self.all.get_mut(&from) else {
            return 0;
        };
        let missed = match process.batch {
            0 => 0,
            last => batch.number.saturating_sub(last.saturating_add(1)),
        };
        process.batch = batch.number;
        process.heard = Instant::now();
        process.counts.clone_from(&batch.topics);
        process.bound = Some(bound);
        missed
    }

    /// Notes when the run began in the process that listens, if that is `from`.
    pub fn note_zero(&mut self, from: u64, zero: Nanos) {
        let hub = self.hub.as_mut().filter(|hub| hub.incarnation == from);
        if let Some(hub) = hub {
            hub.zero.get_or_insert(zero);
        }
    }

    /// Returns the run time zero by our clock, with its error; `None` before the run.
    pub fn zero(&self) -> Option<Inexact> {
        let hub = self.hub.as_ref()?;
        self.moment(hub, hub.zero?)
    }

    /// `moment` of the clock of `process` by our clock, with its error.
    fn moment(&self, process: &Info, moment: Nanos) -> Option<Inexact> {
        let estimate = self.clocks.get(&process.clock)?;
        Some(Inexact {
            nanos: estimate.ours(moment),
            error: estimate.bound,
        })
    }

    /// Returns what is to be added to run times (ns) of process `from`, whose run began at `zero`,
    /// and the greatest error of that; `None` while unknown.
    pub fn shift(&self, from: u64, zero: Nanos) -> Option<Inexact> {
        let (hub, process) = (self.hub.as_ref()?, &self.all.get(&from)?.info);
        if process.clock == hub.clock {
            let nanos = zero.saturating_sub(hub.zero?);
            return Some(Inexact { nanos, error: 0 });
        }
        let (of_hub, of_process) = (self.zero()?, self.moment(process, zero)?);
        Some(Inexact {
            nanos: of_process.nanos.saturating_sub(of_hub.nanos),
            error: of_hub.error.saturating_add(of_process.error),
        })
    }

    /// Those of the `events` of process `from` that are new, and to be shown: topics are in
    /// several processes, and one log of each is enough. The first has number `first`.
    pub fn new_events<'a>(
        &mut self,
        from: u64,
        first: usize,
        events: &'a [Event],
    ) -> Vec<&'a Event> {
        let own = self.hub.as_ref().is_some_and(|hub| hub.incarnation == from);
        let Some(process) = self.all.get_mut(&from) else {
            return Vec::new();
        };
        let skip = process.events.saturating_sub(first);
        process.events = process.events.max(first.saturating_add(events.len()));
        let is_shown = |event: &&Event| own || is_of(event, &process.info);
        events.iter().skip(skip).filter(is_shown).collect()
    }

    /// Returns the messages of a topic lost unread so far, in all processes.
    pub fn dropped(&self, topic: usize) -> u64 {
        let now = self.all.values().map(|process| process.dropped(topic));
        total(now.chain(self.dropped_before.get(&topic).copied()))
    }

    /// Returns whether process `incarnation` runs `node`.
    pub fn runs(&self, incarnation: u64, node: &str) -> bool {
        let process = self.all.get(&incarnation);
        process.is_none_or(|process| process.info.runs(node))
    }

    /// Returns whether the process of `node` has reported.
    pub fn have_heard(&self, node: &str) -> bool {
        self.with_node(node)
            .is_some_and(|process| process.batch > 0)
    }

    /// Returns whether nothing is heard of the process that listens.
    pub fn lack_hub(&self) -> bool {
        self.hub_process().is_none_or(|hub| self.is_gone(hub))
    }

    pub(super) fn hub_process(&self) -> Option<&Process> {
        self.all.get(&self.hub.as_ref()?.incarnation)
    }

    /// Returns whether nothing is heard of a process. Before the run none has anything to report.
    pub(super) fn is_gone(&self, process: &Process) -> bool {
        let began = self.hub.as_ref().is_some_and(|hub| hub.zero.is_some());
        process.heard.elapsed() > GONE && (began || !self.is_present(process))
    }

    pub(super) fn is_present(&self, process: &Process) -> bool {
        self.present.contains(&process.info.incarnation)
    }

    /// Returns all of them for a recording.
    pub fn records(&self) -> Vec<ProcessRecord> {
        let mut records: Vec<_> = self
            .all
            .values()
            .map(|process| ProcessRecord {
                host: process.info.host.clone(),
                pid: process.info.pid,
                nodes: process.info.nodes.clone(),
                error_ns: process.bound.and_then(|bound| u64::try_from(bound).ok()),
            })
            .collect();
        records.sort_by_key(|process| process.pid);
        records
    }

    /// Returns the process that runs `node`.
    pub(super) fn with_node(&self, node: &str) -> Option<&Process> {
        self.all.values().find(|process| process.info.runs(node))
    }
}

/// Returns the sum of counts that somebody else sends: any numbers.
pub(super) fn total(counts: impl Iterator<Item = u64>) -> u64 {
    counts.fold(0, u64::saturating_add)
}

/// Returns whether an event is about a node of `process`, or about the whole run.
fn is_of(event: &Event, process: &Info) -> bool {
    match &event.what {
        EventKind::Applied { command, .. } | EventKind::Refused { command, .. } => match command {
            Command::Set(knob) => !knob.kind().is_of_topic() && process.runs(knob.target()),
            _ => false,
        },
        EventKind::Ended { .. } | EventKind::Faulted { .. } | EventKind::Crashed { .. } => true,
        EventKind::Presence { .. } => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ratelab::Time;
    use ratelab_cart_pole::CartPole;
    use ratelab_experiment::{Config, Experiment};
    use std::sync::Arc;

    /// A process with one node, whose run began at `zero` (ns) of its clock.
    fn info(incarnation: u64, node: &str, clock: u64, zero: Nanos) -> Info {
        let system = Arc::new(CartPole::default());
        let whole = Experiment::new(system, &Config::default()).expect("cart-pole");
        Info {
            incarnation,
            is_hub: node == "sensor",
            clock: ClockId(clock),
            zero: Some(zero),
            ..Info::new(&whole, &[node.to_owned()])
        }
    }

    /// A report of messages that were dropped and refused.
    fn batch(number: u64, messages: u64) -> Batch {
        let counts = TopicCounts {
            topic: 7,
            dropped: messages,
            refused: messages,
            lost: 0,
        };
        Batch {
            number,
            topics: vec![counts],
            ..Batch::default()
        }
    }

    fn with_hub() -> Processes {
        let (mut processes, hub) = (Processes::default(), info(1, "sensor", 1, 500));
        processes.begin(&hub);
        processes.add(hub);
        processes.set_clock(ClockId(1), Estimate::SAME);
        // Clock 2 is 1000 ns ahead of ours.
        let (ahead, bound) = (1000, 30);
        processes.set_clock(ClockId(2), Estimate { ahead, bound });
        processes
    }

    #[test]
    fn run_times_of_all_become_those_of_the_process_that_listens() {
        let mut processes = with_hub();
        processes.add(info(2, "near", 1, 600));
        processes.add(info(3, "far", 2, 1600));
        processes.add(info(4, "unknown", 3, 0));
        let shift = |from, zero| {
            let shift = processes.shift(from, zero)?;
            Some((shift.nanos, shift.error))
        };
        assert_eq!(shift(2, 600), Some((100, 0)));
        assert_eq!(shift(3, 1600), Some((100, 30)));
        assert_eq!(shift(4, 0), None);
        assert_eq!(processes.exactness().as_deref(), Some("ages ?"));
    }

    #[test]
    fn a_restart_keeps_the_drops_so_far_and_lacks_no_reports() {
        let mut processes = with_hub();
        processes.add(info(2, "policy", 1, 0));
        assert_eq!(processes.report(2, &batch(40, 3), 0), 0);
        assert_eq!(processes.report(2, &batch(43, 5), 0), 2);
        processes.add(info(3, "policy", 1, 0));
        assert_eq!(processes.report(3, &batch(1, 1), 0), 0);
        assert_eq!(processes.dropped(7), 6);
        assert!(!processes.know(2) && processes.know(3));
    }

    #[test]
    fn any_numbers_of_a_report_are_added_up() {
        let mut processes = with_hub();
        let mut batch = batch(u64::MAX, u64::MAX);
        batch.topics.extend_from_within(..);
        processes.add(info(2, "policy", 1, Nanos::MIN));
        for _ in 0..2 {
            processes.report(2, &batch, Nanos::MAX);
            assert_eq!(processes.dropped(7), u64::MAX);
            processes.add(info(2, "policy", 1, Nanos::MAX));
        }
        assert!(processes.shift(2, Nanos::MIN).is_some());
        assert!(processes.new_events(2, usize::MAX, &[]).is_empty());
        assert!(processes.trouble(false).is_none());
    }

    #[test]
    fn who_left_after_the_run_is_waited_for_and_not_missed() {
        let mut processes = with_hub();
        processes.add(info(2, "policy", 1, 0));
        processes.add(info(3, "actuator", 1, 0));
        processes.set_present([2, 3].into_iter());
        let trouble = processes.trouble(true);
        assert_eq!(trouble.as_deref(), Some("waiting for sensor"));
        processes.set_present([1, 2].into_iter());
        let trouble = processes.trouble(true);
        assert_eq!(trouble.as_deref(), Some("waiting for actuator"));
        processes.set_present([1, 2, 3].into_iter());
        assert_eq!(processes.trouble(true), None);
    }

    #[test]
    fn only_the_process_of_a_node_shows_its_knobs() {
        let mut processes = with_hub();
        processes.add(info(2, "policy", 1, 0));
        let knob = |text: &str| Event {
            at: Time::ZERO,
            what: EventKind::Applied {
                command: Command::Set(text.parse().expect("a knob")),
                was: None,
            },
        };
        let events = ["rate policy 20", "rate sensor 20"].map(knob);
        let shown = |processes: &mut Processes, from| {
            let new = processes.new_events(from, 0, &events);
            new.into_iter().cloned().collect::<Vec<_>>()
        };
        assert_eq!(shown(&mut processes, 1), events);
        assert_eq!(shown(&mut processes, 2), events[..1]);
        assert_eq!(shown(&mut processes, 2), []);
    }
}
