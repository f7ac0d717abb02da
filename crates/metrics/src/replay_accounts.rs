//! The accounts of a run of which messages and ticks are known, from a recording or from the
//! network.

use std::{
    collections::{BTreeMap, VecDeque},
    time::Duration,
};

use ratelab::{
    Command, Event, EventKind, Head, Knob, NodeRecord, Push, Status, TickTimes, Time, TopicRecord,
    Topology, clock::RunWriter, sync::Arc,
};

use crate::{
    accounts::{Accounts, Observer},
    node::{TickRecord, TopicRead},
    topic::TopicAccount,
};

/// The most messages of a topic whose stamps are kept for their reads.
const MOST_KEPT: usize = 1 << 16;

/// Adds up the accounts of a run from what is known of it: its messages, and its ticks with what
/// these read.
///
/// Given all ticks, messages and events in order, its [`Observer`] reads the same values
/// as the run's own observer: exactly for a run on the virtual clock; on the real clock
/// the ages of read messages differ by microseconds, because a tick is recorded with the
/// time of its start.
///
/// At the same run time a tick comes before the messages published in it, and nodes are
/// ordered by priority. Messages lost to a shallower queue appear with the next message,
/// or with the total passed to [`lost`](Self::lost) at the end.
pub struct ReplayAccounts {
    run: RunWriter,
    observer: Observer,
    queues: Vec<ReplayQueue>,
}

/// What the account of a topic follows from.
#[derive(Default)]
struct ReplayQueue {
    /// The messages in flight, by delivery and sequence number.
    in_flight: BTreeMap<(Time, u64), Head>,
    /// Sequence number of the newest delivered message.
    delivered: Option<u64>,
    /// The messages that may still be read, by sequence number and stamp.
    stamps: VecDeque<(u64, Time)>,
    /// Messages lost up to the newest one; `None` before the first.
    dropped: Option<u64>,
    /// Run time of the last reduction of the queue depth.
    shrunk: Time,
}

impl ReplayAccounts {
    /// Creates the accounts of a graph with this `topology` and `status` before its run.
    pub fn new(topology: &Topology, status: Status) -> Self {
        let queues = topology.topics.iter().map(|_| ReplayQueue::default());
        let run = RunWriter::new(status);
        Self {
            queues: queues.collect(),
            observer: Observer {
                run: run.state(),
                accounts: Arc::new(Accounts::new(topology.clone())),
            },
            run,
        }
    }

    /// Returns an observer of the run.
    pub fn observer(&self) -> Observer {
        self.observer.clone()
    }

    /// Sets run time to `now`. At the end of a run it may go back: the real clock ends at
    /// its end time, even if the last tick began a little later.
    pub fn set_now(&self, now: Time) {
        self.run.set_now(now);
    }

    /// Adds a tick of the node with index `node`, with its reads.
    pub fn tick(&mut self, node: usize, tick: &TickRecord) {
        self.set_now(tick.at);
        self.deliver(tick.at);
        for read in &tick.causes.reads {
            self.topic(read.message.topic, |queue, account| {
                queue.read(read, tick, account);
            });
        }
        let times = TickTimes {
            number: tick.number,
            at: tick.at,
            lateness: tick.lateness,
            took: tick.took,
            ends: tick.ends,
        };
        self.node(node, &NodeRecord::Ticked(times));
        if let Some(mut account) = self.observer.accounts.node(node) {
            account.ticks = tick.number.saturating_add(1);
            account.overruns = tick.overruns;
        }
    }

    /// Adds a message of the topic with index `topic`.
    pub fn message(&mut self, topic: usize, head: &Head) {
        self.topic(topic, |queue, account| queue.publish(head, account));
    }

    /// Delivers the messages that arrive by `now`.
    pub fn deliver(&mut self, now: Time) {
        for topic in 0..self.queues.len() {
            self.topic(topic, |queue, account| queue.deliver(now, account));
        }
    }

    /// Adds the total number of messages lost unread on the topic with index `topic`,
    /// at the end of the run.
    pub fn lost(&mut self, topic: usize, dropped: u64) {
        // After the last message only a shallower queue loses messages.
        self.topic(topic, |queue, account| {
            queue.lose(queue.shrunk, dropped, account);
        });
    }

    /// Adds the total number of messages of the topic with index `topic` that matches used in no set,
    /// at the end of the run.
    pub fn unmatched(&mut self, topic: usize, unmatched: u64) {
        self.topic(topic, |_, account| {
            // A record has the total of all readers only.
            if let Some(reader) = account.readers.first_mut() {
                reader.unmatched = unmatched;
            }
        });
    }

    /// Adds a `sample` of the measurement `meter` of the node with index `node`.
    pub fn sample(&mut self, node: usize, meter: &str, sample: Duration) {
        let nodes = &self.observer.accounts.topology.nodes;
        let mut meters = nodes.get(node).into_iter().flat_map(|node| &node.meters);
        if let Some(meter) = meters.position(|name| name == meter) {
            self.node(node, &NodeRecord::Measured { meter, sample });
        }
    }

    /// Adds what the node with index `node` did to the world.
    pub fn push(&mut self, node: usize, push: Push) {
        self.node(node, &NodeRecord::Pushed(push));
    }

    /// Adds an event of the run.
    pub fn event(&mut self, event: &Event) {
        self.set_now(event.at);
        match &event.what {
            EventKind::Applied { command, .. } => self.apply(event.at, command),
            EventKind::Crashed { node, .. } => self.named(node, &NodeRecord::Crashed),
            _ => {}
        }
        self.run.note(event.at, event.what.clone());
    }

    fn apply(&mut self, at: Time, command: &Command) {
        let run = &self.run;
        match command {
            Command::Set(Knob::Rate { node, hz }) => self.named(node, &NodeRecord::Rate(*hz)),
            Command::Set(Knob::Crash { node }) => self.named(node, &NodeRecord::Crashed),
            Command::Set(Knob::Restart { node }) => self.named(node, &NodeRecord::Restarted),
            Command::Set(Knob::Depth { topic, depth }) => {
                let index = self.observer.accounts.topology.topic(topic);
                self.topic(index.unwrap_or(usize::MAX), |queue, account| {
                    if *depth < account.depth {
                        queue.shrunk = at;
                    }
                    account.add(&TopicRecord::Depth(*depth));
                });
            }
            Command::Pause | Command::Step => run.update(|status| status.paused = true),
            Command::Resume => run.update(|status| status.paused = false),
            Command::Speed(speed) => run.update(|status| status.speed = *speed),
            Command::HandOver(clock) => run.update(|status| status.clock = *clock),
            Command::Set(_) | Command::Stop => {}
        }
    }

    /// Adds a record of a node, if there is such a node.
    fn node(&self, node: usize, record: &NodeRecord) {
        if let Some(mut account) = self.observer.accounts.node(node) {
            account.add(record);
        }
    }

    /// Adds a record of the node called `name`.
    fn named(&self, name: &str, record: &NodeRecord) {
        if let Some(node) = self.observer.accounts.topology.node(name) {
            self.node(node, record);
        }
    }

    /// Changes a topic, if there is such a topic.
    fn topic(&mut self, topic: usize, change: impl FnOnce(&mut ReplayQueue, &mut TopicAccount)) {
        let account = self.observer.accounts.topic(topic);
        if let Some((queue, mut account)) = self.queues.get_mut(topic).zip(account) {
            change(queue, &mut account);
        }
    }
}

/// Returns whether a message goes through a link.
fn is_linked(head: &Head) -> bool {
    head.arrives != Some(head.at)
}

impl ReplayQueue {
    fn publish(&mut self, head: &Head, account: &mut TopicAccount) {
        let (head, link, payload) = (*head, is_linked(head), &());
        account.add(&TopicRecord::Sent {
            head,
            link,
            payload,
        });
        if let Some(arrives) = head.arrives {
            self.in_flight.insert((arrives, head.seq), head);
            self.stamps.push_back((head.seq, head.stamp));
            if self.stamps.len() > MOST_KEPT {
                self.stamps.pop_front();
            }
        }
        self.deliver(head.at, account);
        self.lose(head.at, head.dropped, account);
    }

    /// Delivers the messages that arrive by `now`.
    fn deliver(&mut self, now: Time, account: &mut TopicAccount) {
        while let Some(next) = self.in_flight.first_entry()
            && next.key().0 <= now
        {
            let ((at, seq), sent) = next.remove_entry();
            let overtaken = self.delivered.is_some_and(|newest| sent.seq < newest);
            if !overtaken {
                self.delivered = Some(sent.seq);
            }
            if is_linked(&sent) {
                account.add(&TopicRecord::Delivered { seq, at, overtaken })
            } else {
                account.overtaken += u64::from(overtaken)
            }
        }
    }

    /// Sets the number of messages lost by `at`.
    fn lose(&mut self, at: Time, dropped: u64, account: &mut TopicAccount) {
        // A record has the total losses of all readers only.
        if let Some(reader) = account.readers.first_mut() {
            reader.dropped = dropped;
            // Losses before the start of the record are not recent.
            let lost = dropped.saturating_sub(self.dropped.unwrap_or(dropped));
            let lost = u32::try_from(lost).unwrap_or(u32::MAX);
            reader.drops.count(at, lost);
        }
        self.dropped = Some(dropped);
    }

    /// Adds what a `tick` has read.
    fn read(&self, read: &TopicRead, tick: &TickRecord, account: &mut TopicAccount) {
        let seq = read.message.seq;
        let place = self.stamps.binary_search_by_key(&seq, |(known, _)| *known);
        if let Ok(place) = place {
            account.add(&TopicRecord::Read {
                reader: read.reader,
                tick: tick.number,
                seq,
                newest: read.newest,
                age: tick.at.since(self.stamps[place].1),
            });
        }
    }
}
