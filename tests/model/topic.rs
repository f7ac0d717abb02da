//! Topics: no message is torn, and every one is accounted for.

use ratelab::{GO_ON, Graph, Subscription, Time, Topic};
use ratelab_account::TapHandle;
use shuttle::thread;

use crate::{
    MANY, explore,
    support::{depth, hz},
};

/// Reads `times` times; returns the sequence numbers, newest message last.
fn read(subscription: &mut Subscription<u64>, times: usize) -> Vec<u64> {
    let seen = (0..times).filter_map(|_| subscription.latest(Time::MAX));
    seen.map(|message| {
        assert_eq!(message.data, message.seq, "torn message");
        message.seq
    })
    .collect()
}

fn publish(topic: &Topic<u64>, messages: u64) {
    let publisher = topic.publisher();
    (0..messages).for_each(|number| publisher.publish(number, Time::ZERO, None));
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

fn check_two_readers(messages: u64, reads: usize, queue: usize) {
    let topic = Topic::new("/test", depth(queue));
    let readers = [topic.subscribe(), topic.subscribe()].map(|mut subscription| {
        thread::spawn(move || {
            let seen = read(&mut subscription, reads);
            (subscription, seen)
        })
    });
    publish(&topic, messages);
    for reader in readers {
        let (mut subscription, mut seen) = reader.join().expect("reader");
        seen.extend(read(&mut subscription, 1));
        assert!(
            seen.is_sorted(),
            "a message came after a newer one: {seen:?}"
        );
        assert_eq!(seen.last(), Some(&(messages - 1)));
        seen.dedup();
        assert_eq!(
            subscription.dropped(),
            losses(&seen, queue as u64),
            "{seen:?}"
        );
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
        let node = graph.node("talker", hz(1.0), 0, |wiring| {
            let publisher = wiring.publisher(&topic);
            move |_| {
                let _ = &publisher;
                GO_ON
            }
        });
        node.expect("a node");
        let tap = TapHandle::of(&graph).topic(&topic, 100);
        let publishers = [0, 1].map(|_| {
            let publisher = topic.publisher();
            thread::spawn(move || (0..3).for_each(|_| publisher.publish((), Time::ZERO, None)))
        });
        for publisher in publishers {
            publisher.join().expect("publisher");
        }
        let seqs: Vec<u64> = tap
            .items()
            .try_iter()
            .map(|tapped| tapped.message.seq)
            .collect();
        assert_eq!(seqs, Vec::from_iter(0..6));
        assert_eq!((topic.published(), idle.dropped()), (6, 5));
    });
}

#[test]
fn a_depth_change_during_traffic_keeps_the_counts_exact() {
    const MESSAGES: u64 = 6;
    explore(MANY, || {
        let topic = Topic::new("/test", depth(3));
        let idle = topic.subscribe();
        let mut subscription = topic.subscribe();
        let reader = thread::spawn(move || {
            let seen = read(&mut subscription, 3);
            (subscription, seen)
        });
        let tuned = topic.clone();
        let tuner =
            thread::spawn(move || [1, 4, 2].map(|d| tuned.set_depth(depth(d), Time::ZERO).get()));
        publish(&topic, MESSAGES);
        assert_eq!(tuner.join().expect("tuner"), [3, 1, 4]);
        let (mut subscription, mut seen) = reader.join().expect("reader");
        seen.extend(read(&mut subscription, 1));
        assert!(
            seen.is_sorted(),
            "a message came after a newer one: {seen:?}"
        );
        seen.dedup();
        let (least, most) = (losses(&seen, 4), losses(&seen, 1));
        assert!((least..=most).contains(&subscription.dropped()), "{seen:?}");
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
