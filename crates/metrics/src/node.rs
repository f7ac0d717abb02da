//! The account of a node.

use std::{mem, time::Duration};

use ratelab::{
    Executor, Hz, MessageId, NodeRecord, NodeTopology, Push, TickTimes, Time, sync::Arc,
};
use smallvec::SmallVec;

use crate::{distribution::Distribution, sawtooth::PushAge};

/// What the records of a node add up to.
#[derive(Clone, Debug)]
pub struct NodeAccount {
    /// Its name.
    pub name: Arc<str>,
    /// Priority among nodes that are due at the same instant, lowest first.
    pub priority: u32,
    /// The rate in force; that of the messages for a node that they trigger.
    pub hz: Hz,
    /// The topics that trigger it, by their indices; empty for a node at a rate.
    pub triggers: Arc<[usize]>,
    /// Its executor; `None` for a thread of its own.
    pub executor: Option<Executor>,
    /// Ticks so far, with the one that it is in.
    pub ticks: u64,
    /// Periods skipped because the node was still busy.
    pub overruns: u64,
    /// Whether it is in a tick. In virtual time ticks take no time unless a duration is
    /// set.
    pub busy: bool,
    /// Whether it crashed without a restart since.
    pub crashed: bool,
    /// Whether it runs in another process, which has its figures.
    pub remote: bool,
    /// Lateness of all ticks: from the due time to the start. A tick without a known lateness, of
    /// virtual time, started when it was due.
    pub lateness: Distribution,
    /// Duration of ticks: in run time where a duration is set, otherwise in wall time.
    /// The wall time is not measured while the virtual clock runs at unlimited speed.
    pub tick_time: Distribution,
    /// Response time: from the due time to the end of a tick, lateness plus tick time.
    pub response: Distribution,
    /// The node's own measurements, by their names.
    pub meters: Vec<(Arc<str>, Distribution)>,
    /// Age of the sensing behind the node's pushes on the world, if it makes any.
    pub push_age: PushAge,
    /// Whether `ticks` already counts the running tick.
    counted: bool,
    /// What the tick that it records next has read, and what completed its set.
    pub(crate) causes: TickCauses,
}

/// Why a tick of a node does what it does.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TickCauses {
    /// The messages that it read, in this order.
    pub reads: SmallVec<[TopicRead; 2]>,
    /// Index of the topic whose message completed the set that it is for, where several topics
    /// trigger the node.
    pub completed: Option<usize>,
}

/// A message that a tick read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TopicRead {
    /// The message.
    pub message: MessageId,
    /// The reader, by its place at the topic.
    pub reader: usize,
    /// Sequence number of the newest message that was there.
    pub newest: u64,
}

/// A finished tick of a node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TickRecord {
    /// Number of the tick, counted from zero.
    pub number: u64,
    /// Run time of its start.
    pub at: Time,
    /// Run time at which it published and acted; `None` if the run ended before.
    pub ends: Option<Time>,
    /// Lateness of its start; `None` under the virtual clock unless a lateness is set.
    pub lateness: Option<Duration>,
    /// Duration; `None` where it was not measured.
    pub took: Option<Duration>,
    /// Periods that the node has skipped so far because it was busy.
    pub overruns: u64,
    /// What it did to the world; `None` if it did nothing that was sensed for.
    pub push: Option<Push>,
    /// What it read, and why it began.
    pub causes: TickCauses,
}

impl TickRecord {
    /// Returns the run time at which it was due, for a node that several topics trigger that at which
    /// its set of messages was complete; never before run time zero.
    pub fn due(&self) -> Time {
        self.at - self.lateness.unwrap_or_default()
    }
}

impl NodeAccount {
    /// Creates the account of `node` before its first record.
    pub(crate) fn new(node: &NodeTopology) -> Self {
        let meters = node.meters.iter();
        Self {
            name: node.name.as_str().into(),
            priority: node.priority,
            hz: node.hz,
            triggers: node.triggers.as_slice().into(),
            executor: node.executor.as_ref().and_then(|name| name.parse().ok()),
            ticks: 0,
            overruns: 0,
            busy: false,
            crashed: false,
            remote: false,
            lateness: Distribution::default(),
            tick_time: Distribution::default(),
            response: Distribution::default(),
            meters: meters
                .map(|name| (name.as_str().into(), Distribution::default()))
                .collect(),
            push_age: PushAge::default(),
            counted: false,
            causes: TickCauses::default(),
        }
    }

    /// Adds a record.
    #[inline]
    pub(crate) fn add(&mut self, record: &NodeRecord) {
        match record {
            NodeRecord::Began(_) => {
                self.ticks += 1;
                (self.busy, self.counted) = (true, true);
            }
            NodeRecord::Ended => self.busy = false,
            NodeRecord::Ticked(times) => self.tick(times),
            NodeRecord::Skipped(ticks) => self.overruns += ticks,
            NodeRecord::Rate(hz) => self.hz = *hz,
            NodeRecord::Crashed => (self.busy, self.crashed) = (false, true),
            NodeRecord::Restarted => (self.busy, self.crashed) = (false, false),
            NodeRecord::Measured { meter, sample } => {
                if let Some((_, distribution)) = self.meters.get_mut(*meter) {
                    distribution.add(*sample);
                }
            }
            NodeRecord::Pushed(push) => self.push_age.push(push.at, push.sensed),
        }
    }

    /// Adds a tick: how late it began and how long it took, where that was measured.
    fn tick(&mut self, times: &TickTimes) {
        self.ticks += u64::from(!mem::take(&mut self.counted));
        self.lateness.add(times.lateness.unwrap_or_default());
        if let Some(took) = times.took {
            self.tick_time.add(took);
            self.response.add(times.lateness.unwrap_or_default() + took);
        }
    }

    /// Returns the newest tick, which had these `times`, with its causes.
    pub(crate) fn newest_tick(&mut self, times: &TickTimes) -> TickRecord {
        let push = self.push_age.in_force();
        TickRecord {
            number: times.number,
            at: times.at,
            ends: times.ends,
            lateness: times.lateness,
            took: times.took,
            overruns: self.overruns,
            push: push.filter(|push| Some(push.at) == times.ends),
            causes: mem::take(&mut self.causes),
        }
    }

    /// Returns the node's own measurement `name`.
    pub fn meter(&self, name: &str) -> Option<&Distribution> {
        let meter = self.meters.iter().find(|(known, _)| **known == *name);
        meter.map(|(_, distribution)| distribution)
    }
}
