//! Topics: no message is torn, and every one is accounted for.

use ratelab::{Graph, Subscription, Tick, Time, Topic};
use ratelab_metrics::TapHandle;
use shuttle::thread;

use crate::{
    MANY, explore,
    support::{depth, seqs, talker},
};

/// Reads `times` times; returns the sequence numbers, newest message last.
fn read(subscription: &mut Subscription<u64>, times: usize) -> Vec<u64> {
    let seen = (0..times).filter_map(|_| Tick::at(Time::MAX).read(subscription));
    seen.map(|message| {
        assert_eq!(message.data, message.seq, "torn message");
        message.seq
    })
    .collect()
}

fn publish(topic: &Topic<u64>, messages: u64) {
    let publisher = topic.publisher();
    (0..messages).for_each(|number| Tick::at(Time::ZERO).publish(&publisher, number));
}

/// Number of messages evicted unread if each of `seen` was the newest when it was read
/// and the queue depth was `depth`.
fn losses(seen: &[u64], depth: u64) -> u64 {
    let mut unread_from = 0;
    let losses = seen.iter().map(|seq| {
        let lost = (seq + 1 - unread_from).saturating_sub(depth);
        unread_from = seq + 1;
        lost
    });
    losses.sum()
}

/// All that `reader` saw in the end, in order and up to the last of `messages`; its losses.
fn seen_by(reader: thread::JoinHandle<(Subscription<u64>, Vec<u64>)>) -> (Vec<u64>, u64) {
    let (mut subscription, mut seen) = reader.join().expect("reader");
    seen.extend(read(&mut subscription, 1));
    assert!(
        seen.is_sorted(),
        "a message came after a newer one: {seen:?}"
    );
    seen.dedup();
    (seen, subscription.dropped())
}

/// Reads `times` times on a thread of its own.
fn reader(topic: &Topic<u64>, times: usize) -> thread::JoinHandle<(Subscription<u64>, Vec<u64>)> {
    let mut subscription = topic.subscribe();
    thread::spawn(move || {
        let seen = read(&mut subscription, times);
        (subscription, seen)
    })
}

fn check_two_readers(messages: u64, reads: usize, queue: usize) {
    let topic = Topic::new("/test", depth(queue));
    let readers = [(); 2].map(|()| reader(&topic, reads));
    publish(&topic, messages);
    for reader in readers {
        let (seen, dropped) = seen_by(reader);
        assert_eq!(seen.last(), Some(&(messages - 1)));
        assert_eq!(dropped, losses(&seen, queue as u64), "{seen:?}");
    }
    assert_eq!(topic.published(), messages);
}

#[test]
fn every_message_is_seen_passed_over_or_counted_as_dropped() {
    explore(MANY, || check_two_readers(5, 3, 1));
    explore(MANY, || check_two_readers(6, 3, 2));
}

#[test]
fn two_publishers_share_one_history_without_gaps() {
    explore(MANY, || {
        let (topic, mut graph) = (Topic::new("/test", depth(1)), Graph::new());
        let idle = topic.subscribe();
        talker(&mut graph, "talker", 1.0, 0, &topic, |_| None);
        let tap = TapHandle::new(&graph).topic(&topic, 100);
        let publishers = [0, 1].map(|_| {
            let publisher = topic.publisher();
            thread::spawn(move || (0..3).for_each(|_| Tick::at(Time::ZERO).publish(&publisher, ())))
        });
        for publisher in publishers {
            publisher.join().expect("publisher");
        }
        assert_eq!(seqs(&tap), Vec::from_iter(0..6));
        assert_eq!((topic.published(), idle.dropped()), (6, 5));
    });
}

#[test]
fn a_depth_change_during_traffic_keeps_the_counts_exact() {
    const MESSAGES: u64 = 6;
    explore(MANY, || {
        let topic = Topic::new("/test", depth(3));
        let idle = topic.subscribe();
        let reader = reader(&topic, 3);
        let tuned = topic.clone();
        let tuner =
            thread::spawn(move || [1, 4, 2].map(|d| tuned.set_depth(depth(d), Time::ZERO).get()));
        publish(&topic, MESSAGES);
        assert_eq!(tuner.join().expect("tuner"), [3, 1, 4]);
        let (seen, dropped) = seen_by(reader);
        let (least, most) = (losses(&seen, 4), losses(&seen, 1));
        assert!((least..=most).contains(&dropped), "{seen:?}");
        topic.set_depth(depth(1), Time::ZERO);
        assert_eq!(idle.dropped(), MESSAGES - 1);
    });
}

#[test]
fn a_subscription_added_during_traffic_counts_drops_from_then_on() {
    explore(MANY, || {
        let topic = Topic::new("/test", depth(1));
        let late = topic.clone();
        let late = thread::spawn(move || {
            let before = late.published();
            (before, late.subscribe())
        });
        publish(&topic, 4);
        let (before, late) = late.join().expect("late");
        assert!(late.dropped() <= (4 - before).saturating_sub(1));
        let charged = late.dropped();
        publish(&topic, 2);
        assert!((charged + 1..=charged + 2).contains(&late.dropped()));
    });
}
