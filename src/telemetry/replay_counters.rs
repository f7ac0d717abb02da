//! The counters of a run, replayed from its record.

use std::{collections::BTreeMap, time::Duration};

use super::{
    Event, EventKind, EventLog, Flight, Meter, MeterRecorder, NodeEntry, NodeTopology, Observer,
    PushAge, RunState, Status, SubscriptionEntry, TickMeters, TopicCounters, TopicEntry,
    TopicTopology, Topology,
};
use crate::{
    command::Command,
    head::Head,
    knob::Knob,
    push::Push,
    reexecution::RunLog,
    sync::{
        Arc, Mutex,
        atomic::{AtomicU64, Ordering},
        bump, lock,
    },
    tap::TickRecord,
    time::Time,
};

/// The counters of a run, updated from its record.
///
/// Given all ticks, messages and events in order, its [`Observer`] reads the same values
/// as the run's own observer: exactly for a run on the virtual clock; on the real clock
/// the ages of read messages differ by microseconds, because a read is recorded with the
/// time of its tick.
///
/// At the same run time a tick comes before the messages published in it, and nodes are
/// ordered by priority. Messages lost to a shallower queue appear with the next message,
/// or with the total passed to [`lost`](Self::lost) at the end.
pub struct ReplayCounters {
    state: Arc<RunState>,
    nodes: Vec<ReplayNode>,
    topics: Vec<ReplayTopic>,
}

struct ReplayNode {
    entry: NodeEntry,
    tick_meters: TickMeters,
    meters: Vec<MeterRecorder>,
}

struct ReplayTopic {
    entry: TopicEntry,
    /// Ages of messages when each subscription read them.
    ages: Vec<MeterRecorder>,
    /// Stamps of the messages in flight, by delivery and sequence number.
    in_flight: BTreeMap<(Time, u64), Time>,
    /// Sequence number and stamp of the newest delivered message.
    delivered: Option<(u64, Time)>,
    /// Messages lost up to the newest one; `None` before the first.
    dropped: Option<u64>,
    /// Run time of the last reduction of the queue depth.
    shrunk: Time,
}

impl ReplayCounters {
    /// Creates counters at zero for a graph with this `topology` and `status`.
    pub fn new(topology: &Topology, status: Status) -> Self {
        Self {
            state: Arc::new(RunState {
                now: AtomicU64::new(0),
                status: Mutex::new(status),
                log: EventLog::default(),
                threads: RunLog::default(),
                zero: Mutex::new(None),
            }),
            nodes: topology.nodes.iter().map(ReplayNode::new).collect(),
            topics: topology.topics.iter().map(ReplayTopic::new).collect(),
        }
    }

    /// Returns an observer of the counters.
    pub fn observer(&self) -> Observer {
        Observer {
            state: self.state.clone(),
            nodes: self.nodes.iter().map(|node| node.entry.clone()).collect(),
            topics: self.topics.iter().map(|t| t.entry.clone()).collect(),
        }
    }

    /// Sets run time to `now`. At the end of a run it may go back: the real clock ends at
    /// its end time, even if the last tick began a little later.
    pub fn set_now(&self, now: Time) {
        self.state.now.store(now.as_nanos(), Ordering::Relaxed);
    }

    /// Records a tick of the node with index `node`, which read the newest message of
    /// each of its topics.
    pub fn tick(&mut self, node: usize, tick: &TickRecord) {
        self.set_now(tick.at);
        for topic in &mut self.topics {
            topic.read_by(node, tick.at);
        }
        if let Some(node) = self.nodes.get_mut(node) {
            node.tick(tick);
        }
    }

    /// Records a message of the topic with index `topic`.
    pub fn message(&mut self, topic: usize, head: &Head) {
        if let Some(topic) = self.topics.get_mut(topic) {
            topic.publish(head);
        }
    }

    /// Delivers the messages that arrive by `now`.
    pub fn deliver(&mut self, now: Time) {
        self.topics.iter_mut().for_each(|topic| topic.deliver(now));
    }

    /// Records the total number of messages lost unread on the topic with index `topic`,
    /// at the end of the run.
    pub fn lost(&mut self, topic: usize, dropped: u64) {
        if let Some(topic) = self.topics.get_mut(topic) {
            // After the last message only a shallower queue loses messages.
            topic.lose(topic.shrunk, dropped);
        }
    }

    /// Records a `sample` of the measurement `meter` of the node with index `node`.
    pub fn sample(&mut self, node: usize, meter: &str, sample: Duration) {
        let Some(node) = self.nodes.get_mut(node) else {
            return;
        };
        let meters = node.entry.meters.iter().zip(&mut node.meters);
        for (_, recorder) in meters.filter(|((name, _), _)| name == meter) {
            recorder.record(sample);
        }
    }

    /// Records what the node with index `node` did to the world.
    pub fn push(&mut self, node: usize, push: Push) {
        let node = self.nodes.get(node);
        if let Some(age) = node.and_then(|node| node.entry.push_age.as_ref()) {
            age.push(push.at, push.sensed);
        }
    }

    /// Records an event of the run.
    pub fn event(&mut self, event: &Event) {
        self.set_now(event.at);
        if let EventKind::Applied { command, .. } = &event.what {
            self.apply(event.at, command);
        }
        self.state.log.note(event.at, event.what.clone());
    }

    fn apply(&mut self, at: Time, command: &Command) {
        let mut status = lock(&self.state.status);
        match command {
            Command::Set(Knob::Rate { node, hz }) => {
                let known = self.nodes.iter().find(|n| *n.entry.name == **node);
                if let Some(node) = known {
                    node.entry
                        .counters
                        .micro_hz
                        .store(hz.as_micro(), Ordering::Relaxed);
                }
            }
            Command::Set(Knob::Crash { node } | Knob::Restart { node }) => {
                let known = self.nodes.iter().find(|n| *n.entry.name == **node);
                if let Some(node) = known {
                    let crashed = matches!(command, Command::Set(Knob::Crash { .. }));
                    node.entry
                        .counters
                        .crashed
                        .store(crashed, Ordering::Relaxed);
                }
            }
            Command::Set(Knob::Depth { topic, depth }) => {
                let known = self.topics.iter_mut().find(|t| *t.entry.name == **topic);
                if let Some(topic) = known {
                    let counters = &topic.entry.counters;
                    let before = counters.depth.swap(depth.get(), Ordering::Relaxed);
                    if depth.get() < before {
                        topic.shrunk = at;
                    }
                }
            }
            Command::Pause | Command::Step => status.paused = true,
            Command::Resume => status.paused = false,
            Command::Speed(speed) => status.speed = *speed,
            Command::HandOver(clock) => status.clock = *clock,
            Command::Set(_) | Command::Stop => {}
        }
    }
}

impl ReplayNode {
    fn new(topology: &NodeTopology) -> Self {
        let meters = topology.meters.iter().map(|name| (name, Meter::new()));
        let (entries, meters) = meters
            .map(|(name, (recorder, meter))| ((name.clone(), meter), recorder))
            .unzip();
        let (mut entry, tick_meters) = NodeEntry::new(
            &topology.name,
            topology.priority,
            topology.hz,
            entries,
            Some(PushAge::default()),
        );
        entry.triggers = topology.triggers.as_slice().into();
        entry.matching = topology.matching;
        entry.executor = topology.executor;
        Self {
            entry,
            tick_meters,
            meters,
        }
    }

    fn tick(&mut self, tick: &TickRecord) {
        let ticks = tick.number.saturating_add(1);
        let counters = &self.entry.counters;
        counters.ticks.store(ticks, Ordering::Relaxed);
        counters.overruns.store(tick.overruns, Ordering::Relaxed);
        self.tick_meters.record(tick.lateness, tick.took);
    }
}

impl ReplayTopic {
    fn new(topology: &TopicTopology) -> Self {
        let readers = topology.readers.iter().map(|&node| {
            let (recorder, ages) = Meter::new();
            let mark = Arc::default();
            (recorder, SubscriptionEntry { node, mark, ages })
        });
        let (ages, subscriptions) = readers.unzip();
        Self {
            entry: TopicEntry {
                name: topology.name.as_str().into(),
                counters: Arc::new(TopicCounters::new(topology.depth)),
                publishers: topology.publishers.clone(),
                subscriptions,
            },
            ages,
            in_flight: BTreeMap::new(),
            delivered: None,
            dropped: None,
            shrunk: Time::ZERO,
        }
    }

    fn publish(&mut self, head: &Head) {
        let Head { at, arrives, .. } = *head;
        let counters = &self.entry.counters;
        let published = head.seq.saturating_add(1);
        counters.published.store(published, Ordering::Relaxed);
        counters.note(at);
        if arrives != Some(at) {
            counters.fly(Flight {
                released: at,
                arrives,
            });
        }
        if let Some(arrives) = arrives {
            self.in_flight.insert((arrives, head.seq), head.stamp);
        }
        self.deliver(at);
        self.lose(at, head.dropped);
    }

    /// Delivers the messages that arrive by `now`.
    fn deliver(&mut self, now: Time) {
        let counters = &self.entry.counters;
        while let Some(next) = self.in_flight.first_entry()
            && next.key().0 <= now
        {
            let ((_, seq), stamp) = next.remove_entry();
            if self.delivered.is_some_and(|(newest, _)| seq < newest) {
                bump(&counters.overtaken);
            } else {
                self.delivered = Some((seq, stamp));
            }
        }
        let in_flight = self.in_flight.len() as u64;
        counters.in_flight.store(in_flight, Ordering::Relaxed);
    }

    /// Sets the number of messages lost by `at`.
    fn lose(&mut self, at: Time, dropped: u64) {
        // A record has the total losses of all readers only.
        if let Some(reader) = self.entry.subscriptions.first() {
            reader.mark.dropped.store(dropped, Ordering::Relaxed);
            // Losses before the start of the record are not recent.
            let lost = dropped.saturating_sub(self.dropped.unwrap_or(dropped));
            let lost = u32::try_from(lost).unwrap_or(u32::MAX);
            reader.mark.drops.count_many(at, lost);
        }
        self.dropped = Some(dropped);
    }

    fn read_by(&mut self, node: usize, now: Time) {
        self.deliver(now);
        let Some((_, newest)) = self.delivered else {
            return;
        };
        let subscriptions = self.entry.subscriptions.iter().zip(&mut self.ages);
        for (_, ages) in subscriptions.filter(|(subscription, _)| subscription.node == node) {
            ages.record(now.since(newest));
        }
    }
}
