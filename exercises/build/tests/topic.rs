//! The promises of a topic.

use std::{sync::Arc, thread};

use build_it::Topic;

#[test]
fn before_the_first_message_there_is_none() {
    let topic = Topic::<i32>::new("/obs", 1);
    assert_eq!(topic.name(), "/obs");
    assert!(topic.latest().is_none());
    assert_eq!((topic.published(), topic.dropped()), (0, 0));
}

#[test]
fn the_newest_message_is_read_with_its_times_and_its_number() {
    let topic = Topic::new("/obs", 3);
    topic.publish('a', 10, None);
    topic.publish('b', 20, Some(15));
    let newest = topic.latest().expect("published");
    assert_eq!((newest.data, newest.stamp), ('b', 20));
    assert_eq!((newest.seq, newest.origin), (1, Some(15)));
    // Nothing new: the same again.
    assert_eq!(topic.latest(), Some(newest));
    assert_eq!(topic.published(), 2);
}

#[test]
fn what_is_pushed_out_unread_is_dropped() {
    let topic = Topic::new("/obs", 1);
    for number in 0..10 {
        topic.publish(number, 0, None);
    }
    assert_eq!(topic.dropped(), 9);
    assert_eq!(topic.latest().map(|newest| newest.data), Some(9));
}

#[test]
fn what_was_read_or_passed_over_is_no_drop() {
    let topic = Topic::new("/obs", 2);
    for number in 0..100 {
        topic.publish(2 * number, 0, None);
        topic.publish(2 * number + 1, 0, None);
        // Passes over the even one.
        assert_eq!(
            topic.latest().map(|newest| newest.data),
            Some(2 * number + 1)
        );
    }
    assert_eq!((topic.published(), topic.dropped()), (200, 0));
}

#[test]
fn a_deeper_queue_drops_later() {
    let topic = Topic::new("/obs", 3);
    (0..3).for_each(|number| topic.publish(number, 0, None));
    assert_eq!(topic.dropped(), 0);
    (3..8).for_each(|number| topic.publish(number, 0, None));
    assert_eq!(topic.dropped(), 5);
}

#[test]
fn a_queue_keeps_at_least_one_message() {
    let topic = Topic::new("/obs", 0);
    topic.publish(7, 0, None);
    assert_eq!(topic.latest().map(|newest| newest.data), Some(7));
}

#[test]
fn it_is_shared_between_threads_and_counts_every_message() {
    let topic = Arc::new(Topic::new("/obs", 1));
    let publishers = (0..4).map(|_| {
        let topic = topic.clone();
        thread::spawn(move || (0..1_000).for_each(|number| topic.publish(number, 0, None)))
    });
    let publishers: Vec<_> = publishers.collect();
    publishers
        .into_iter()
        .for_each(|publisher| publisher.join().expect("publishes"));
    assert_eq!((topic.published(), topic.dropped()), (4_000, 3_999));
    assert_eq!(topic.latest().map(|newest| newest.seq), Some(3_999));
}
