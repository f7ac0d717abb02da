//! The recorder stood still: what came meanwhile was logged together afterwards.

use crate::{
    bag::{Bag, NO_STAMP},
    clocks::{Clocks, TopicClock},
    numbers::{MS, median, steps},
    stamps::is_stamped,
};

/// A time without any message, after which those came that were sent in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pause {
    /// The last log time before (ns).
    pub at: i64,
    /// Its length (ns).
    pub length: i64,
}

/// Messages this soon after a pause tell of it; those without source times are moved (ns).
const AFTER: (i64, i64) = (5 * MS, 6 * MS);

/// The most pauses that are looked at.
const MOST: usize = 1_000;

/// Finds the pauses of the recorder.
pub fn pauses(bag: &Bag) -> Vec<Pause> {
    let mut logs: Vec<i64> = bag
        .topics
        .iter()
        .flat_map(|topic| &topic.messages)
        .map(|message| message.log)
        .collect();
    logs.sort_unstable();
    let least = (100 * MS).max((5.0 * median(steps(&logs))) as i64);
    let pauses: Vec<Pause> = logs
        .windows(2)
        .filter(|pair| pair[1] - pair[0] > least)
        .take(MOST)
        .map(|pair| Pause {
            at: pair[0],
            length: pair[1] - pair[0],
        })
        .collect();
    if pauses.is_empty() {
        return pauses;
    }
    let ages = usual_ages(bag);
    pauses
        .into_iter()
        .filter(|pause| is_of_recorder(bag, &ages, *pause))
        .collect()
}

/// Returns the median of log time less stamp of each stamped topic.
fn usual_ages(bag: &Bag) -> Vec<Option<f64>> {
    let age = |topic: usize| {
        let messages = bag.topics[topic].messages.iter();
        let ages = messages
            .filter(|message| message.stamp != NO_STAMP)
            .map(|message| message.log - message.stamp);
        is_stamped(&bag.topics[topic].messages).then(|| median(ages.collect()))
    };
    (0..bag.topics.len()).map(age).collect()
}

/// Returns the places of the messages of a topic up to `after` behind a pause.
fn behind(bag: &Bag, topic: usize, pause: Pause, after: i64) -> std::ops::Range<usize> {
    let messages = &bag.topics[topic].messages;
    let end = pause.at + pause.length;
    let first = messages.partition_point(|message| message.log < end);
    let last = messages.partition_point(|message| message.log <= end + after);
    first..last
}

/// Returns whether at least half of the stamped topics have a message behind the pause that is too
/// old.
fn is_of_recorder(bag: &Bag, ages: &[Option<f64>], pause: Pause) -> bool {
    let (mut with, mut old) = (0, 0);
    for (topic, age) in ages.iter().enumerate() {
        let Some(usual) = age else { continue };
        let messages = &bag.topics[topic].messages[behind(bag, topic, pause, AFTER.0)];
        with += usize::from(!messages.is_empty());
        let is_old = messages.iter().any(|message| {
            let age = message.log.saturating_sub(message.stamp) as f64;
            message.stamp != NO_STAMP && age - usual > 0.2 * pause.length as f64
        });
        old += usize::from(is_old);
    }
    old >= 1 && old * 2 >= with
}

/// Moves the events without source times behind pauses to where their stamps were.
pub fn moved(bag: &Bag, clocks: &Clocks, topic: usize, pauses: &[Pause], events: &mut [i64]) {
    if clocks.of_topics[topic] != TopicClock::Log || pauses.is_empty() {
        return;
    }
    let messages = &bag.topics[topic].messages;
    let mut late = vec![false; messages.len()];
    for pause in pauses {
        late[behind(bag, topic, *pause, AFTER.1)].fill(true);
    }
    let others = messages
        .iter()
        .zip(&late)
        .filter(|(message, late)| !**late && message.stamp != NO_STAMP);
    let usual = median(
        others
            .map(|(message, _)| message.log - message.stamp)
            .collect(),
    );
    let usual = crate::numbers::nearest(usual);
    for (place, message) in messages.iter().enumerate() {
        if late[place] && message.stamp != NO_STAMP {
            events[place] = message.log.min(message.stamp.saturating_add(usual));
        }
    }
    let mut last = i64::MIN;
    for event in events {
        last = last.max(*event);
        *event = last;
    }
}
