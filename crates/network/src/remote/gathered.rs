//! What is known of a run of other processes, put together in the order of its run times, with
//! numbers and totals that go on where a process that was started again begins anew.

use std::{
    collections::{BTreeMap, HashMap},
    mem,
    sync::Arc,
    time::Duration,
};

use ratelab::{
    ClockExit, ClockKind, Command, Derived, Event, EventKind, Head, MessageId, Speed, Status,
    TickId, Time, Topology,
};
use ratelab_experiment::{Config, Summary, Taps};
use ratelab_metrics::{
    Lineage, Observer, ReplayAccounts, Rows, Snapshot, TickCauses, TickRecord, TopicRead,
};
use ratelab_recording::StopReason;
use ratelab_system::{MeanCost, RunTally, System};

use super::relay::Relay;
use crate::telemetry::{PublishedMessage, Read, SentMessage};

/// Messages and ticks kept per topic and node, for the timeline.
const KEPT: usize = 1 << 15;

/// A run as far as it is put together.
pub struct GatheredRun {
    system: Arc<dyn System>,
    pub config: Config,
    pub topology: Topology,
    pub observer: Observer,
    /// The graph before the run.
    pub start: Snapshot,
    /// Its messages and ticks for a recorder.
    pub relay: Arc<Relay>,
    counters: ReplayAccounts,
    lineage: Lineage,
    new_rows: BTreeMap<usize, Rows>,
    ticks: Numbering,
    messages: Numbering,
    overruns: Totals,
    /// The newest state, and what the states cost if all of them came.
    state: Vec<f64>,
    chains: Vec<f64>,
    cost: Option<MeanCost>,
    /// What the system adds up of its messages.
    tally: Option<Box<dyn RunTally>>,
}

impl GatheredRun {
    /// Creates a run of which nothing is known yet. The topics that are `known` can be recorded.
    pub fn new(
        system: &Arc<dyn System>,
        config: &Config,
        topology: &Topology,
        known: &Taps,
    ) -> Self {
        let status = Status {
            clock: ClockKind::Real,
            paused: false,
            speed: Speed::REAL_TIME,
        };
        let counters = ReplayAccounts::new(topology, status);
        let lineage = Lineage::new(topology.clone(), config.setup.iter()).keeping(KEPT);
        Self {
            system: system.clone(),
            start: counters.observer().snapshot(),
            observer: counters.observer(),
            relay: Arc::new(Relay::new(topology, known)),
            counters,
            lineage: lineage.along(system.about().latency_path()),
            config: config.clone(),
            topology: topology.clone(),
            new_rows: BTreeMap::new(),
            ticks: Numbering::default(),
            messages: Numbering::default(),
            overruns: Totals::default(),
            state: Vec::new(),
            chains: Vec::new(),
            cost: Some(MeanCost::default()),
            tally: system.judge().tally(&config.setup),
        }
    }

    /// Returns the chains behind its actions.
    pub fn lineage(&self) -> &Lineage {
        &self.lineage
    }

    /// Returns the messages since the last call, by the index of their topic.
    pub fn take_rows(&mut self) -> BTreeMap<usize, Rows> {
        mem::take(&mut self.new_rows)
    }

    /// Adds an event.
    pub fn event(&mut self, event: &Event) {
        self.lineage.event(event);
        self.counters.event(event);
    }

    /// Adds a tick of the node with index `node` in process `from`.
    pub fn tick(&mut self, from: u64, node: usize, tick: TickRecord, reads: &[Read]) {
        let Some(place) = self.ticks.place(node, from, tick.number, tick.at) else {
            return;
        };
        let tick = TickRecord {
            number: place.number,
            at: place.at,
            overruns: self.overruns.total(node, from, tick.overruns),
            push: tick.push.map(|mut push| {
                push.at = push.at.max(place.at);
                push
            }),
            causes: TickCauses {
                reads: reads.iter().filter_map(|read| self.read(read)).collect(),
                ..tick.causes
            },
            ..tick
        };
        self.counters.tick(node, &tick);
        if let Some(push) = tick.push {
            self.counters.push(node, push);
            let name = self.topology.nodes.get(node).map(|node| &*node.name);
            if let Some((acts, meter)) = self.system.latency()
                && name == Some(acts)
            {
                let age = push.at.since(push.sensed);
                self.counters.sample(node, meter, age);
            }
        }
        self.lineage.tick(node, tick.clone());
        self.relay.tick(node, tick, place.missing);
    }

    /// Returns a message that a tick read, as it is numbered here.
    fn read(&self, read: &Read) -> Option<TopicRead> {
        let message = self.numbered(read.message)?;
        Some(TopicRead {
            message,
            reader: read.reader,
            newest: message.seq.saturating_add(read.newer),
        })
    }

    /// Returns a message as it is numbered here.
    fn numbered(&self, sent: SentMessage) -> Option<MessageId> {
        let SentMessage {
            topic,
            incarnation,
            seq,
        } = sent;
        let seq = self.messages.known(topic, incarnation, seq)?;
        Some(MessageId { topic, seq })
    }

    /// Adds a message of process `from`, which `arrives` at its reader unless it is lost.
    pub fn message(
        &mut self,
        from: u64,
        message: PublishedMessage,
        arrives: Option<Time>,
        dropped: u64,
    ) {
        let topic = message.topic;
        let Some(place) = self.messages.place(topic, from, message.seq, message.at) else {
            return;
        };
        let by = message.by.and_then(|(node, number)| {
            let number = self.ticks.known(node, from, number)?;
            Some(TickId { node, number })
        });
        let head = Head {
            at: place.at,
            by,
            from: match message.from.and_then(|from| self.numbered(from)) {
                Some(from) => Derived::Message(from),
                None if message.begins => Derived::Nothing,
                None => Derived::Reads,
            },
            stamp: place.at,
            seq: place.number,
            origin: message.origin,
            arrives: arrives.map(|arrives| arrives.max(place.at)),
            dropped,
        };
        self.counters.message(topic, &head);
        self.lineage.message(topic, &head);
        let row: Vec<f64> = message
            .row
            .into_iter()
            .map(|number| number.unwrap_or(f64::NAN))
            .collect();
        self.relay.message(topic, head, &row, place.missing);
        let name = self.topology.topics.get(topic).map(|topic| &*topic.name);
        let is = |other: Option<&str>| name.is_some() && name == other;
        let (is_state, is_chains) = (
            is(self.system.states_topic()),
            is(self.system.chains_topic()),
        );
        if let (Some(tally), Some(name)) = (&mut self.tally, name)
            && tally.topics().contains(&name)
        {
            tally.message(name, &row);
        }
        if is_state {
            self.add_state(&head, place.missing, &row);
        }
        if is_chains {
            row.clone_into(&mut self.chains);
        }
        let rows = self
            .new_rows
            .entry(topic)
            .or_insert_with(|| Rows::new(row.len()));
        // A row of another length is of a hostile sender.
        let _ = rows.push(head, row);
    }

    fn add_state(&mut self, head: &Head, missing: u64, row: &[f64]) {
        let is_first = self.state.is_empty();
        row.clone_into(&mut self.state);
        if missing > 0 || (is_first && head.seq > 0) {
            self.cost = None;
        }
        if let (Some(mean), Some(cost)) = (&mut self.cost, self.system.judge().quadratic_cost()) {
            mean.state(head.stamp, (cost.of_state)(row));
        }
    }

    /// Closes the chains behind the actions so far.
    pub fn settle(&mut self) {
        self.lineage.settle();
    }

    /// Sets run time to `now`.
    pub fn set_now(&mut self, now: Time) {
        self.counters.deliver(now);
        self.counters.set_now(now);
    }

    /// Returns how it ended, if that is known.
    pub fn exit(&self) -> Option<Result<ClockExit, String>> {
        let mut ended = self
            .observer
            .events(0)
            .into_iter()
            .rev()
            .filter_map(|event| match event.what {
                EventKind::Ended { node } => Some(Ok(ClockExit::Ended { node, at: event.at })),
                EventKind::Faulted { node, cause } => Some(Err(format!("{node} failed: {cause}"))),
                EventKind::Applied {
                    command: Command::Stop,
                    ..
                } => Some(Ok(ClockExit::Stopped)),
                _ => None,
            });
        let is_completed = self.observer.now() >= self.config.end;
        let completed = || is_completed.then_some(Ok(ClockExit::Completed));
        ended.next().or_else(completed)
    }

    /// Returns the end of the run, for a recording.
    pub fn end(&self) -> StopReason {
        match self.exit() {
            None => StopReason::Off,
            Some(Err(fault)) => StopReason::Fault(fault),
            Some(Ok(exit)) => StopReason::Run(Box::new(self.summary(&exit))),
        }
    }

    /// Returns the summary of what is known, of a run that ended by `exit`.
    pub fn summary(&self, exit: &ClockExit) -> Summary {
        let now = self.observer.now().min(self.config.end);
        let at = match exit {
            ClockExit::Ended { at, .. } => *at,
            _ => now,
        };
        let [state, chains] =
            [&self.state, &self.chains].map(|row| (!row.is_empty()).then_some(&row[..]));
        let verdict = self.system.verdict(exit, at, [state, chains]);
        let summary = Summary {
            wall_time: Duration::from_nanos(at.as_nanos()),
            state: self.state.clone(),
            chains: self.chains.clone(),
            cost: self.cost.as_ref().and_then(|mean| mean.until(at)),
            figures: self
                .tally
                .as_ref()
                .map_or_else(Vec::new, |tally| tally.figures()),
            ..Summary::new(&self.config, verdict)
        };
        summary.observed(&*self.system, &self.observer)
    }
}

/// A count that goes on.
#[derive(Default)]
struct Count {
    process: u64,
    /// Counted by earlier processes.
    before: u64,
    now: u64,
    /// The processes before it, each with what was counted before that.
    earlier: Vec<(u64, u64)>,
}

impl Count {
    /// Returns what `process` calls `count`, after all that earlier processes counted.
    fn after_others(&mut self, process: u64, count: u64) -> u64 {
        if self.process != process {
            self.earlier.push((self.process, self.before));
            self.process = process;
            self.before = self.now;
        }
        self.before.saturating_add(count)
    }

    /// Returns what `process` calls `count`, if anything of that process has come.
    fn known(&self, process: u64, count: u64) -> Option<u64> {
        let now = [(self.process, self.before)];
        let mut processes = now.iter().chain(self.earlier.iter().rev());
        let (_, before) = processes.find(|(known, _)| *known == process)?;
        Some(before.saturating_add(count))
    }
}

/// The numbering of each of several series, with their times.
#[derive(Default)]
pub struct Numbering(HashMap<usize, (Count, Time)>);

/// The place of an item in its series.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SeriesPlace {
    /// Its number.
    pub number: u64,
    /// Its run time, never before that of the item before: a better estimate of a clock
    /// may have moved it.
    pub at: Time,
    /// Numbers between it and the item before.
    pub missing: u64,
}

impl Numbering {
    /// Returns the place in `series` of the item that `process` calls `number`, at run time `at`;
    /// `None` if it was there already.
    pub fn place(
        &mut self,
        series: usize,
        process: u64,
        number: u64,
        at: Time,
    ) -> Option<SeriesPlace> {
        let is_first = !self.0.contains_key(&series);
        let (count, last) = self.0.entry(series).or_default();
        let number = count.after_others(process, number);
        let missing = number.checked_sub(count.now)?;
        count.now = number.saturating_add(1);
        *last = at.max(*last);
        Some(SeriesPlace {
            number,
            at: *last,
            missing: if is_first { 0 } else { missing },
        })
    }
}

impl Numbering {
    /// Returns the number in `series` of the item that `process` calls `number`; `None` if nothing
    /// of that process has come.
    pub fn known(&self, series: usize, process: u64, number: u64) -> Option<u64> {
        self.0.get(&series)?.0.known(process, number)
    }
}

/// Totals of several counters.
#[derive(Default)]
pub struct Totals(HashMap<usize, Count>);

impl Totals {
    /// Returns the total of `counter`, of which `process` has counted `count`.
    pub fn total(&mut self, counter: usize, process: u64, count: u64) -> u64 {
        let total = self.0.entry(counter).or_default();
        total.now = total.after_others(process, count).max(total.now);
        total.now
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The number, the run time (ns) and what is missing before it.
    fn place(of: &mut Numbering, process: u64, number: u64, at: u64) -> Option<(u64, u64, u64)> {
        let place = of.place(0, process, number, Time::from_nanos(at))?;
        Some((place.number, place.at.as_nanos(), place.missing))
    }

    #[test]
    fn a_restart_goes_on_after_the_last_number() {
        let of = &mut Numbering::default();
        assert_eq!(place(of, 1, 40, 5), Some((40, 5, 0)));
        assert_eq!(place(of, 1, 43, 6), Some((43, 6, 2)));
        assert_eq!(place(of, 1, 43, 6), None);
        assert_eq!(place(of, 2, 0, 4), Some((44, 6, 0)));
        assert_eq!(place(of, 2, 2, 7), Some((46, 7, 1)));
        let other = of.place(1, 2, 7, Time::ZERO).expect("another series");
        assert_eq!((other.number, other.missing), (7, 0));
    }

    #[test]
    fn a_restart_adds_to_the_total() {
        let totals = &mut Totals::default();
        let counts = [(1, 3), (1, 5), (2, 0), (2, 4), (3, 1)];
        let found = counts.map(|(process, count)| totals.total(0, process, count));
        assert_eq!(found, [3, 5, 5, 9, 10]);
    }
}
