//! The messages that met for each tick of a node with several triggers.
//!
//! A tick notes when its set was complete. The set itself follows from the rules of
//! [`Match`](ratelab_effects::Match) and the order in which the node took its messages.

use std::collections::VecDeque;

use ratelab::{Head, TakenMessage, Time};
use ratelab_effects::{Choice, Matcher};

use super::{Lineage, sensing_of};

/// The messages that a node has taken so far.
#[derive(Clone, Debug)]
pub(super) struct Meeting {
    sets: Matcher,
    /// Sets that a message completed beyond one, with the time of its delivery.
    more: VecDeque<Choice>,
    completed: Time,
    /// The message taken last from each trigger.
    taken: Vec<Option<u64>>,
    turn: usize,
}

impl Lineage {
    /// The messages of its triggers that a tick is for, as pairs of a topic and a sequence
    /// number.
    pub(super) fn met(&mut self, node: usize, index: usize) -> Vec<(usize, u64)> {
        let known = self.nodes[node].meeting.take();
        let mut meeting = known.unwrap_or_else(|| self.first_meeting(node));
        let set = self.replayed(node, index, &mut meeting);
        let set = set.unwrap_or_else(|| self.guessed(node, index, &mut meeting));
        self.nodes[node].meeting = Some(meeting);
        let triggers = self.topology.nodes[node].triggers.iter().copied();
        triggers.zip(set).collect()
    }

    fn first_meeting(&self, node: usize) -> Meeting {
        let node = &self.topology.nodes[node];
        let inputs = node.triggers.len();
        Meeting {
            sets: Matcher::new(node.matching.parse().unwrap_or_default(), inputs),
            more: VecDeque::new(),
            completed: Time::ZERO,
            taken: vec![None; inputs],
            turn: 0,
        }
    }

    /// Takes messages as the node did, up to the set that was complete when the tick was due.
    fn replayed(&self, node: usize, index: usize, meeting: &mut Meeting) -> Option<Choice> {
        let ticks = &self.nodes[node].ticks;
        let tick = &ticks[index].tick;
        let (at, due) = (tick.at, tick.due());
        let free = index
            .checked_sub(1)
            .map_or(Time::ZERO, |before| ticks[before].ends());
        let triggers = self.topology.nodes[node].triggers.iter();
        let arrivals = triggers.zip(&meeting.taken).flat_map(|(topic, last)| {
            let news = self.topics[*topic].after(*last, at);
            news.filter_map(|sent| sent.arrives)
        });
        let mut looks: Vec<Time> = arrivals
            .filter(|arrives| *arrives <= at)
            .map(|arrives| self.looks(node, arrives.max(free), at))
            .collect();
        looks.push(free.min(at));
        looks.sort_unstable();
        looks.dedup();
        looks
            .into_iter()
            .find_map(|now| self.take_at(node, now, due, meeting))
    }

    /// When the only thread of the node's executor is free, from `from` on.
    fn looks(&self, node: usize, from: Time, until: Time) -> Time {
        let executor = self.nodes[node].executor;
        if !executor.is_some_and(|executor| executor.is_single_threaded()) {
            return from;
        }
        let running = |now: Time| {
            let mut others = self.companions(node);
            others.find_map(|other| {
                let ticks = self.ticks_between(other, now, now);
                let mut ends = ticks.filter(|(_, worked)| worked.tick.at <= now);
                ends.find_map(|(_, worked)| Some(worked.ends()).filter(|ends| *ends > now))
            })
        };
        let mut now = from;
        while let Some(ends) = running(now).filter(|_| now < until) {
            now = ends;
        }
        now.min(until)
    }

    /// Takes what is there at run time `now`, one message of each topic in turn, up to the
    /// set that was complete at `due`.
    fn take_at(&self, node: usize, now: Time, due: Time, meeting: &mut Meeting) -> Option<Choice> {
        let triggers = &self.topology.nodes[node].triggers;
        let mut empty = 0;
        while empty < triggers.len() {
            if let Some(set) = meeting.more.pop_front() {
                match meeting.completed == due {
                    true => return Some(set),
                    false => continue,
                }
            }
            let input = meeting.turn;
            meeting.turn = (input + 1) % triggers.len();
            let last = meeting.taken[input];
            let Some(sent) = self.oldest(triggers[input], node, now, last) else {
                empty += 1;
                continue;
            };
            empty = 0;
            meeting.taken[input] = Some(sent.seq);
            let taken = TakenMessage {
                seq: sent.seq,
                sensed: sensing_of(sent),
                arrived: sent.arrives.unwrap_or(now),
            };
            meeting.sets.add(input, taken, &mut meeting.more);
            meeting.completed = taken.arrived;
        }
        None
    }

    /// The set of a tick whose messages were taken in an order that is not known: the newest
    /// message of each topic. The messages behind the next ticks are later.
    fn guessed(&self, node: usize, index: usize, meeting: &mut Meeting) -> Choice {
        *meeting = self.first_meeting(node);
        let at = self.nodes[node].ticks[index].tick.at;
        let seen = |topic: usize| {
            let mut sent = self.topics[topic].after(None, at).rev();
            sent.find(|sent| self.is_seen(topic, sent, node, at))
        };
        let triggers = self.topology.nodes[node].triggers.iter();
        let newest: Vec<Option<&Head>> = triggers.map(|topic| seen(*topic)).collect();
        meeting.taken = newest
            .iter()
            .map(|sent| sent.map(|sent| sent.seq))
            .collect();
        let known = newest.into_iter().map(|sent| sent.map(|sent| sent.seq));
        known.collect::<Option<Choice>>().unwrap_or_default()
    }

    /// The topic that the message behind `topic`, one of several triggers, waited for: the one
    /// with the message that completed the set of this tick.
    pub(super) fn waited_for(&self, node: usize, index: usize, topic: usize) -> usize {
        let triggers = &self.topology.nodes[node].triggers;
        let due = self.nodes[node].ticks[index].tick.due();
        let came = |of: &usize| {
            let mut sent = self.topics[*of].after(None, due).rev().take(64);
            sent.any(|sent| sent.arrives == Some(due))
        };
        let mut others = triggers.iter().copied().filter(|of| *of != topic);
        match others.clone().find(came) {
            Some(other) => other,
            None if came(&topic) => topic,
            None => others.next().unwrap_or(topic),
        }
    }

    /// Whether a node ticks on sets of messages, one of them from `topic`.
    pub(super) fn meets(&self, node: usize, topic: usize) -> bool {
        let triggers = &self.topology.nodes[node].triggers;
        triggers.len() > 1 && triggers.contains(&topic)
    }
}
