//! The replay of a recorded run, into the counters read by the dashboard.

use std::{sync::Arc, time::Duration};

use ratelab::{ClockExit, EventKind, Head, Push, Status, Time};
use ratelab_experiment::{Config, Summary};
use ratelab_metrics::{Observer, ReplayAccounts, Rows};
use ratelab_system::{MeanCost, System, SystemFigure};

use crate::run::Recording;

/// An item of the recording, by its index.
#[derive(Clone, Copy, Debug)]
enum ReplayItem {
    Event(usize),
    Tick {
        node: usize,
        index: usize,
    },
    /// The action of a tick on the world, at its time.
    Push {
        node: usize,
        push: Push,
    },
    Message {
        topic: usize,
        index: usize,
    },
}

/// A recording, replayed up to a run time.
pub struct Replay {
    recording: Arc<Recording>,
    system: Arc<dyn System>,
    /// All items in order of time.
    order: Vec<(Time, ReplayItem)>,
    /// Number of replayed items.
    done: usize,
    counters: ReplayAccounts,
    /// Number of replayed messages per topic, and how many of them were returned.
    replayed: Vec<usize>,
    handed_out: Vec<usize>,
    /// The topic of states, and the node and meter of the age of the sensing behind each
    /// push.
    state: Option<usize>,
    latency: Option<(usize, String)>,
    /// The topic with the data ages of chains.
    chains: Option<usize>,
}

impl Replay {
    /// Creates a replay at the beginning. `system` is the program's system; a recording
    /// of another system is shown without picture and signals.
    pub fn new(recording: Arc<Recording>, system: &Arc<dyn System>) -> Self {
        let system = recording.system(system);
        let topology = &recording.origin.topology;
        let [state, chains] =
            [system.states_topic(), system.chains_topic()].map(|name| topology.topic(name?));
        let latency = system
            .latency()
            .and_then(|(node, meter)| Some((topology.node(node)?, meter.to_owned())));
        Self {
            order: order(
                &recording,
                state.zip(latency.as_ref().map(|(node, _)| *node)),
            ),
            done: 0,
            counters: begin(&recording),
            replayed: vec![0; topology.topics.len()],
            handed_out: vec![0; topology.topics.len()],
            state,
            latency,
            chains,
            recording,
            system,
        }
    }

    /// Returns the system of the recording.
    pub fn system(&self) -> &Arc<dyn System> {
        &self.system
    }

    /// Returns the recording.
    pub fn recording(&self) -> &Arc<Recording> {
        &self.recording
    }

    /// Reads the current counters.
    pub fn observer(&self) -> Observer {
        self.counters.observer()
    }

    /// Returns the run time of the first item.
    pub fn begins(&self) -> Time {
        let first = self
            .order
            .iter()
            .find(|(_, item)| !matches!(item, ReplayItem::Event(_)));
        first.map_or(Time::ZERO, |(at, _)| *at)
    }

    /// Returns whether everything is replayed, and the run had ended.
    pub fn is_over(&self) -> bool {
        self.recording.end_of_run().is_some() && self.done == self.order.len()
    }

    /// Returns the run time of the next item.
    pub fn next(&self) -> Option<Time> {
        self.order.get(self.done).map(|(at, _)| *at)
    }

    /// Returns what happened at the current instant, with its run time (µs).
    pub fn happened(&self) -> Option<String> {
        let (at, _) = self.order.get(self.done.checked_sub(1)?)?;
        let first = self.order.partition_point(|(before, _)| before < at);
        let items = self.order[first..self.done].iter().map(|(_, item)| *item);
        // Ticks have made the rest.
        let made = |item: &ReplayItem| {
            matches!(item, ReplayItem::Message { .. } | ReplayItem::Push { .. })
        };
        let all = items.clone().all(|item| made(&item));
        let words: Vec<String> = items
            .filter(|item| all || !made(item))
            .map(|item| self.in_words(item))
            .collect();
        Some(format!("{:.6} s: {}", at.as_secs_f64(), words.join(", ")))
    }

    fn in_words(&self, item: ReplayItem) -> String {
        let topology = &self.recording.origin.topology;
        match item {
            ReplayItem::Event(index) => self.recording.events[index].to_string(),
            ReplayItem::Tick { node, .. } => format!("{} ticks", topology.nodes[node].name),
            ReplayItem::Push { node, .. } => format!("{} acts", topology.nodes[node].name),
            ReplayItem::Message { topic, index } => {
                let seq = self.recording.topics[topic].heads()[index].seq;
                format!("{} gets message {seq}", topology.topics[topic].name)
            }
        }
    }

    /// Returns the run time of the item before the current instant.
    pub fn previous(&self) -> Option<Time> {
        let (last, _) = self.order.get(self.done.checked_sub(1)?)?;
        let before = self.order.partition_point(|(at, _)| at < last);
        self.order.get(before.checked_sub(1)?).map(|(at, _)| *at)
    }

    /// Replays up to run time `until`.
    pub fn advance_to(&mut self, until: Time) {
        while let Some((_, item)) = self.order.get(self.done).filter(|(at, _)| *at <= until) {
            let item = *item;
            self.done += 1;
            self.apply(item);
        }
        self.tell_losses(until);
        let now = until.min(self.end());
        self.counters.deliver(now);
        self.counters.set_now(now);
    }

    /// Returns the messages of the topic called `name` replayed since the last call.
    pub fn new_rows(&mut self, name: &str) -> Rows {
        let Some(topic) = self.recording.origin.topology.topic(name) else {
            return Rows::default();
        };
        let rows = &self.recording.topics[topic];
        let mut new = Rows::new(rows.width());
        let until = self.replayed[topic];
        for (head, row) in rows.iter().take(until).skip(self.handed_out[topic]) {
            let _ = new.push(*head, row.iter().copied()); // Of the same width.
        }
        self.handed_out[topic] = until;
        new
    }

    /// Returns the run time at the end of the recording; that of the run if it is over, even if a
    /// tick on the real clock began a little later.
    fn end(&self) -> Time {
        let recording = &self.recording;
        if let Some(result) = recording.result() {
            return result.sim_time;
        }
        recording
            .outcome
            .as_ref()
            .map(|outcome| outcome.at)
            .unwrap_or_default()
            .max(recording.until)
    }

    /// Goes back to the beginning.
    pub fn rewind(&mut self) {
        self.done = 0;
        self.replayed.fill(0);
        self.handed_out.fill(0);
        self.counters = begin(&self.recording);
    }

    /// Sets the losses of the whole run at its end.
    fn tell_losses(&mut self, until: Time) {
        let done = self.done == self.order.len() && until >= self.recording.until;
        let outcome = self.recording.outcome.as_ref().filter(|_| done);
        let losses = outcome.and_then(|outcome| outcome.dropped.as_ref());
        for (topic, dropped) in losses.into_iter().flatten().enumerate() {
            self.counters.lost(topic, *dropped);
        }
        let unmatched = outcome.and_then(|outcome| outcome.unmatched.as_ref());
        for (topic, unmatched) in unmatched.into_iter().flatten().enumerate() {
            self.counters.unmatched(topic, *unmatched);
        }
    }

    fn apply(&mut self, item: ReplayItem) {
        match item {
            ReplayItem::Event(index) => self.counters.event(&self.recording.events[index]),
            ReplayItem::Tick { node, index } => {
                self.counters.tick(node, &self.recording.ticks[node][index]);
            }
            ReplayItem::Push { node, push } => self.push(node, push),
            ReplayItem::Message { topic, index } => {
                let head = self.recording.topics[topic].heads()[index];
                self.counters.message(topic, &head);
                self.replayed[topic] = index + 1;
                if Some(topic) == self.chains {
                    self.outputs(topic, index);
                }
            }
        }
    }

    fn push(&mut self, node: usize, push: Push) {
        self.counters.push(node, push);
        if let Some((of, meter)) = &self.latency
            && *of == node
        {
            let age = push.at.since(push.sensed);
            self.counters.sample(node, meter, age);
        }
    }

    /// Adds the latencies of the chains of a message on their `topic`: the chains that end at its
    /// publisher. The main one is measured by pushes.
    fn outputs(&mut self, topic: usize, index: usize) {
        let messages = &self.recording.topics[topic];
        let Some(by) = messages.heads()[index].by else {
            return;
        };
        let name = &self.recording.origin.topology.nodes[by.node].name;
        for chain in self.system.about().chains {
            let main = self.latency.as_ref();
            let is_main =
                main.is_some_and(|(node, meter)| *node == by.node && meter == chain.name());
            if chain.last() == name
                && !is_main
                && let Some(age) = chain.latency(messages.row(index))
            {
                self.counters.sample(by.node, chain.name(), age);
            }
        }
    }

    /// Returns the configuration of the run.
    pub fn config(&self) -> &Config {
        &self.recording.origin.config
    }

    /// Returns the summary of the run, or of its recording, for the part replayed so far.
    pub fn summary(&self) -> Summary {
        let at = self.recording.until;
        let (verdict, sim_time, wall_time) = match self.recording.result() {
            Some(result) => {
                let verdict = result.verdict.verdict(&*self.system);
                (verdict, result.sim_time, result.wall_time)
            }
            None => {
                let newest = [self.newest(self.state), self.newest(self.chains)]
                    .map(|row| (!row.is_empty()).then_some(row));
                let verdict = self.system.verdict(&ClockExit::Stopped, at, newest);
                (verdict, at, Duration::from_nanos(at.as_nanos()))
            }
        };
        let summary = Summary {
            sim_time,
            wall_time,
            state: self.newest(self.state).to_vec(),
            chains: self.newest(self.chains).to_vec(),
            cost: self.cost(sim_time),
            figures: self.figures(),
            ..Summary::new(self.config(), verdict)
        };
        summary.observed(&*self.system, &self.observer())
    }

    /// Returns the system's own figures of the replayed messages.
    fn figures(&self) -> Vec<SystemFigure> {
        let Some(mut tally) = self.system.judge().tally(&self.config().setup) else {
            return Vec::new();
        };
        let topics = self.recording.origin.topology.topics.iter();
        let rows = self.recording.topics.iter().zip(&self.replayed);
        for (topic, (rows, replayed)) in topics.zip(rows) {
            if tally.topics().contains(&&*topic.name) {
                rows.iter()
                    .take(*replayed)
                    .for_each(|(_, row)| tally.message(&topic.name, row));
            }
        }
        tally.figures()
    }

    /// Returns the mean cost of the replayed states up to run time `end`.
    fn cost(&self, end: Time) -> Option<f64> {
        let (cost, topic) = self.system.judge().quadratic_cost().zip(self.state)?;
        let states = self.recording.topics[topic].iter();
        let mut mean = MeanCost::default();
        for (head, state) in states.take(self.replayed[topic]) {
            mean.state(head.stamp, (cost.of_state)(state));
        }
        mean.until(end)
    }

    /// Returns the newest replayed message of `topic`; empty if there is none.
    fn newest(&self, topic: Option<usize>) -> &[f64] {
        let newest = topic.and_then(|topic| {
            let newest = self.replayed[topic].checked_sub(1)?;
            Some(self.recording.topics[topic].row(newest))
        });
        newest.unwrap_or_default()
    }
}

/// Creates counters at zero.
fn begin(recording: &Recording) -> ReplayAccounts {
    let origin = &recording.origin;
    let status = Status {
        clock: origin.config.clock,
        paused: false,
        speed: origin.config.speed,
    };
    ReplayAccounts::new(&origin.topology, status)
}

/// Returns all items in order of time. At the same run time commands come first, then nodes by
/// priority, each tick before its messages, and ends last. `acts` is the topic of states and the
/// node that acts.
fn order(recording: &Recording, acts: Option<(usize, usize)>) -> Vec<(Time, ReplayItem)> {
    let topology = &recording.origin.topology;
    let priority = |node: usize| u64::from(topology.nodes[node].priority);
    let mut order = Vec::new();
    for (index, event) in recording.events.iter().enumerate() {
        let command = matches!(
            event.what,
            EventKind::Applied { .. } | EventKind::Refused { .. }
        );
        let rank = if command { 0 } else { u64::MAX };
        order.push(((event.at, rank), ReplayItem::Event(index)));
    }
    for (node, ticks) in recording.ticks.iter().enumerate() {
        let rank = 1 + 2 * priority(node);
        for (index, tick) in ticks.iter().enumerate() {
            order.push(((tick.at, rank), ReplayItem::Tick { node, index }));
            if let Some(push) = tick.push {
                // Ticks with a duration end before others start.
                let rank = if push.at > tick.at { 1 } else { rank };
                order.push(((push.at, rank), ReplayItem::Push { node, push }));
            }
        }
    }
    for topic in 0..recording.topics.len() {
        let publisher = topology.topics[topic].publishers.first();
        let rank = 2 + 2 * publisher.map_or(0, |node| priority(*node));
        let items = messages(
            recording,
            topic,
            acts.filter(|(states, _)| *states == topic)
                .map(|(_, node)| node),
        );
        order.extend(items.into_iter().map(|(at, item)| ((at, rank), item)));
    }
    order.sort_by_key(|(place, _)| *place);
    order
        .into_iter()
        .map(|((at, _), item)| (at, item))
        .collect()
}

/// Returns the messages of `topic` in the order of their numbers, which several publishers may not
/// keep in time. Where they are the states after the actions of a node that `acts`, and its actions
/// are not recorded, they tell these too: in a world that waits for its actuator.
fn messages(recording: &Recording, topic: usize, acts: Option<usize>) -> Vec<(Time, ReplayItem)> {
    let publishers = &recording.origin.topology.topics[topic].publishers;
    let told = |node: usize| recording.ticks[node].iter().any(|tick| tick.push.is_some());
    let acts = acts.filter(|node| publishers.contains(node) && !told(*node));
    let (mut items, mut reached) = (Vec::new(), Time::ZERO);
    for (index, head) in recording.topics[topic].heads().iter().enumerate() {
        let Head { at, origin, .. } = *head;
        reached = reached.max(at);
        items.push((reached, ReplayItem::Message { topic, index }));
        let push = acts.zip(origin).map(|(node, sensed)| {
            let push = Push { at, sensed };
            (reached, ReplayItem::Push { node, push })
        });
        items.extend(push);
    }
    items
}
