//! The counters of a run, replayed from its record.

use std::{collections::BTreeMap, time::Duration};

use ratelab::{
    Command, Event, EventKind, Head, Knob, Push, RunState, Status, TickTimes, Time, Topology,
    sync::{Arc, atomic::Ordering, bump},
};

use super::{
    counters::TopicCounters, observer::Observer, run_counters::RunCounters, tap::TickRecord,
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
    run: Arc<RunState>,
    figures: RunCounters,
    topics: Vec<ReplayTopic>,
}

/// What the figures of a topic follow from.
#[derive(Default)]
struct ReplayTopic {
    /// Indices of the nodes that read from it.
    readers: Vec<usize>,
    /// The messages in flight, by delivery and sequence number.
    in_flight: BTreeMap<(Time, u64), InFlight>,
    /// Sequence number and stamp of the newest delivered message.
    delivered: Option<(u64, Time)>,
    /// Messages lost up to the newest one; `None` before the first.
    dropped: Option<u64>,
    /// Run time of the last reduction of the queue depth.
    shrunk: Time,
}

/// A message in flight.
struct InFlight {
    stamp: Time,
    /// Whether it goes through a link.
    link: bool,
}

impl ReplayCounters {
    /// Creates counters at zero for a graph with this `topology` and `status`.
    pub fn new(topology: &Topology, status: Status) -> Self {
        let topics = topology.topics.iter().map(|topic| ReplayTopic {
            readers: topic.readers.clone(),
            ..ReplayTopic::default()
        });
        Self {
            run: Arc::new(RunState::new(status)),
            topics: topics.collect(),
            figures: RunCounters::new(topology.clone()),
        }
    }

    /// Returns an observer of the counters.
    pub fn observer(&self) -> Observer {
        Observer::new(self.run.clone(), self.figures.clone())
    }

    /// Sets run time to `now`. At the end of a run it may go back: the real clock ends at
    /// its end time, even if the last tick began a little later.
    pub fn set_now(&self, now: Time) {
        self.run.set_now(now);
    }

    /// Records a tick of the node with index `node`, which read the newest message of
    /// each of its topics.
    pub fn tick(&mut self, node: usize, tick: &TickRecord) {
        self.set_now(tick.at);
        let topics = self.topics.iter_mut().zip(&*self.figures.topics);
        topics.for_each(|(topic, figures)| topic.read_by(node, tick.at, figures));
        if let Some(figures) = self.figures.nodes.get(node) {
            let ticks = tick.number.saturating_add(1);
            figures.ticks.store(ticks, Ordering::Relaxed);
            figures.overruns.store(tick.overruns, Ordering::Relaxed);
            figures.tick(&TickTimes {
                at: tick.at,
                lateness: tick.lateness,
                took: tick.took,
                ends: tick.ends,
            });
        }
    }

    /// Records a message of the topic with index `topic`.
    pub fn message(&mut self, topic: usize, head: &Head) {
        let figures = self.figures.topics.get(topic);
        if let Some((topic, figures)) = self.topics.get_mut(topic).zip(figures) {
            topic.publish(head, figures);
        }
    }

    /// Delivers the messages that arrive by `now`.
    pub fn deliver(&mut self, now: Time) {
        let topics = self.topics.iter_mut().zip(&*self.figures.topics);
        topics.for_each(|(topic, figures)| topic.deliver(now, figures));
    }

    /// Records the total number of messages lost unread on the topic with index `topic`,
    /// at the end of the run.
    pub fn lost(&mut self, topic: usize, dropped: u64) {
        let figures = self.figures.topics.get(topic);
        if let Some((topic, figures)) = self.topics.get_mut(topic).zip(figures) {
            // After the last message only a shallower queue loses messages.
            topic.lose(topic.shrunk, dropped, figures);
        }
    }

    /// Records a `sample` of the measurement `meter` of the node with index `node`.
    pub fn sample(&mut self, node: usize, meter: &str, sample: Duration) {
        let names = self.figures.topology_before().nodes.get(node);
        let Some((names, figures)) = names.zip(self.figures.nodes.get(node)) else {
            return;
        };
        let meters = names.meters.iter().zip(&figures.meters);
        let meters = meters.filter(|(name, _)| *name == meter);
        meters.for_each(|(_, meter)| meter.record(sample));
    }

    /// Records what the node with index `node` did to the world.
    pub fn push(&mut self, node: usize, push: Push) {
        if let Some(figures) = self.figures.nodes.get(node) {
            figures.push_age.push(push.at, push.sensed);
        }
    }

    /// Records an event of the run.
    pub fn event(&mut self, event: &Event) {
        self.set_now(event.at);
        if let EventKind::Applied { command, .. } = &event.what {
            self.apply(event.at, command);
        }
        self.run.note(event.at, event.what.clone());
    }

    fn apply(&mut self, at: Time, command: &Command) {
        let graph = self.figures.topology_before();
        let node = |name: &str| {
            let known = graph.nodes.iter().position(|node| node.name == name);
            known.map(|index| &self.figures.nodes[index])
        };
        match command {
            Command::Set(Knob::Rate { node: name, hz }) => {
                if let Some(figures) = node(name) {
                    figures.set_hz(*hz);
                }
            }
            Command::Set(Knob::Crash { node: name } | Knob::Restart { node: name }) => {
                if let Some(figures) = node(name) {
                    figures.set_crashed(matches!(command, Command::Set(Knob::Crash { .. })));
                }
            }
            Command::Set(Knob::Depth { topic, depth }) => {
                if let Some(index) = graph.topics.iter().position(|t| t.name == *topic)
                    && *depth < self.figures.topics[index].set_depth(*depth)
                {
                    self.topics[index].shrunk = at;
                }
            }
            Command::Pause | Command::Step => self.run.update(|status| status.paused = true),
            Command::Resume => self.run.update(|status| status.paused = false),
            Command::Speed(speed) => self.run.update(|status| status.speed = *speed),
            Command::HandOver(clock) => self.run.update(|status| status.clock = *clock),
            Command::Set(_) | Command::Stop => {}
        }
    }
}

impl ReplayTopic {
    fn publish(&mut self, head: &Head, figures: &TopicCounters) {
        let Head { at, arrives, .. } = *head;
        let link = arrives != Some(at);
        figures.sent(head, link);
        if let Some(arrives) = arrives {
            let stamp = head.stamp;
            let message = InFlight { stamp, link };
            self.in_flight.insert((arrives, head.seq), message);
        }
        self.deliver(at, figures);
        self.lose(at, head.dropped, figures);
    }

    /// Delivers the messages that arrive by `now`.
    fn deliver(&mut self, now: Time, figures: &TopicCounters) {
        while let Some(next) = self.in_flight.first_entry()
            && next.key().0 <= now
        {
            let ((_, seq), message) = next.remove_entry();
            let overtaken = self.delivered.is_some_and(|(newest, _)| seq < newest);
            if !overtaken {
                self.delivered = Some((seq, message.stamp));
            }
            match message.link {
                true => figures.delivered(overtaken),
                false if overtaken => bump(&figures.overtaken),
                false => {}
            }
        }
    }

    /// Sets the number of messages lost by `at`.
    fn lose(&mut self, at: Time, dropped: u64, figures: &TopicCounters) {
        // A record has the total losses of all readers only.
        if let Some(reader) = figures.readers.first() {
            reader.dropped.store(dropped, Ordering::Relaxed);
            // Losses before the start of the record are not recent.
            let lost = dropped.saturating_sub(self.dropped.unwrap_or(dropped));
            let lost = u32::try_from(lost).unwrap_or(u32::MAX);
            reader.drops.count_many(at, lost);
        }
        self.dropped = Some(dropped);
    }

    fn read_by(&mut self, node: usize, now: Time, figures: &TopicCounters) {
        self.deliver(now, figures);
        let Some((_, newest)) = self.delivered else {
            return;
        };
        let readers = self.readers.iter().zip(&figures.readers);
        for (_, reader) in readers.filter(|(reader, _)| **reader == node) {
            reader.ages.record(now.since(newest));
        }
    }
}
