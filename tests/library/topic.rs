//! Latest wins, losses count, and taps copy: every row of the table of cases in `src/topic.rs`,
//! and random sequences of them compared with a simple model.

use std::{collections::VecDeque, thread};

use proptest::prelude::*;
use ratelab::{Depth, END, GO_ON, Graph, Publisher, Subscription, Time, Topic};
use ratelab_account::{Observer, Tap, TapHandle, TapMessage};

use crate::support::{depth, hz, messages_of, run_virtual, secs};

/// A topic with its two ends; each message is its own number.
struct Bench {
    topic: Topic<u64>,
    publisher: Publisher<u64>,
    subscription: Subscription<u64>,
}

fn bench(messages: usize) -> Bench {
    let topic = Topic::new("/test", depth(messages));
    Bench {
        publisher: topic.publisher(),
        subscription: topic.subscribe(),
        topic,
    }
}

impl Bench {
    fn publish(&self, messages: u64) {
        for _ in 0..messages {
            let number = self.topic.published();
            self.publisher
                .publish(number, Time::from_nanos(number), None);
        }
    }
}

/// A tap on `topic`, which is that of a node.
fn tap(topic: &Topic<u64>, capacity: usize) -> Tap<TapMessage<u64>> {
    let mut graph = Graph::new();
    let node = graph.node("talker", hz(1.0), 0, |wiring| {
        let publisher = wiring.publisher(topic);
        move |_| {
            let _ = &publisher;
            GO_ON
        }
    });
    node.expect("a node");
    // As under the real clock: nobody waits for a tap.
    TapHandle::of(&graph).topic(topic, capacity)
}

fn read(subscription: &mut Subscription<u64>) -> Option<u64> {
    subscription.latest(Time::MAX).map(|message| message.data)
}

#[test]
fn publishing_into_room_drops_nothing() {
    let bench = bench(3);
    bench.publish(3);
    assert_eq!(bench.subscription.dropped(), 0);
    assert_eq!(bench.topic.published(), 3);
}

#[test]
fn publishing_into_a_full_buffer_drops_the_oldest_unread() {
    let mut bench = bench(3);
    bench.publish(4);
    assert_eq!(bench.subscription.dropped(), 1);
    bench.publish(1);
    assert_eq!(bench.subscription.dropped(), 2);
    assert_eq!(read(&mut bench.subscription), Some(4));
}

#[test]
fn publishing_over_a_message_already_read_or_passed_over_drops_nothing() {
    let mut bench = bench(3);
    bench.publish(3);
    assert_eq!(read(&mut bench.subscription), Some(2));
    bench.publish(3);
    assert_eq!(bench.subscription.dropped(), 0);
    bench.publish(1);
    assert_eq!(bench.subscription.dropped(), 1);
}

#[test]
fn a_topic_that_never_carried_a_message_has_no_latest() {
    let mut bench = bench(1);
    assert_eq!(bench.subscription.latest(Time::ZERO), None);
    assert_eq!(bench.subscription.dropped(), 0);
}

#[test]
fn latest_is_the_newest_and_everything_older_counts_as_seen() {
    let mut bench = bench(100);
    bench.publish(5);
    let newest = bench.subscription.latest(Time::MAX).expect("published");
    assert_eq!(
        (newest.data, newest.seq, newest.stamp.as_nanos()),
        (4, 4, 4)
    );
    bench.publish(100);
    assert_eq!(bench.subscription.dropped(), 0);
}

#[test]
fn latest_holds_the_last_message_while_nothing_new_comes() {
    let mut bench = bench(1);
    bench.publish(1);
    let first = bench.subscription.latest(Time::from_nanos(1));
    assert_eq!(bench.subscription.latest(Time::from_nanos(2)), first);
    assert_eq!(bench.subscription.dropped(), 0);
}

#[test]
fn only_the_slow_one_of_two_subscriptions_drops() {
    let mut fast = bench(1);
    let slow = fast.topic.subscribe();
    for _ in 0..10 {
        fast.publish(1);
        read(&mut fast.subscription);
    }
    assert_eq!((fast.subscription.dropped(), slow.dropped()), (0, 9));
}

#[test]
fn a_late_subscription_reads_the_newest_and_is_not_charged_for_the_past() {
    let bench = bench(2);
    bench.publish(5);
    let mut late = bench.topic.subscribe();
    assert_eq!(read(&mut late), Some(4));
    bench.publish(2);
    assert_eq!(late.dropped(), 0);
    bench.publish(1);
    assert_eq!(late.dropped(), 1);
}

#[test]
fn the_past_is_not_charged_to_a_late_subscription_that_never_read_it() {
    let bench = bench(2);
    bench.publish(2);
    let late = bench.topic.subscribe();
    bench.publish(2);
    assert_eq!((late.dropped(), bench.subscription.dropped()), (0, 2));
}

#[test]
fn depth_zero_and_absurd_depths_are_refused_with_value_and_range() {
    for wrong in ["0", "1000001", "-1", "1.5", "ten", ""] {
        let error = wrong.parse::<Depth>().expect_err("refused").to_string();
        assert_eq!(
            error,
            format!("{wrong:?} is not a queue depth: expected a whole number from 1 to 1000000")
        );
    }
    assert!(Depth::new(0).is_err());
    assert_eq!(Depth::new(1), Ok(Depth::ONE));
    assert_eq!(Depth::new(1_000_000), Ok(Depth::MAX));
}

#[test]
fn a_queue_made_shallower_evicts_the_oldest_and_charges_the_unread() {
    let bench = bench(5);
    let mut reader = bench.topic.subscribe();
    bench.publish(3);
    read(&mut reader);
    bench.publish(2);
    assert_eq!(bench.topic.set_depth(Depth::ONE, Time::ZERO), depth(5));
    assert_eq!(bench.topic.depth(), Depth::ONE);
    // Messages 0 to 3 were evicted; the reader had seen 0 to 2.
    assert_eq!((bench.subscription.dropped(), reader.dropped()), (4, 1));
    assert_eq!(read(&mut reader), Some(4));
}

#[test]
fn a_queue_made_deeper_loses_nothing_and_brings_nothing_back() {
    let mut bench = bench(1);
    bench.publish(2);
    bench.topic.set_depth(depth(3), Time::ZERO);
    assert_eq!(bench.subscription.dropped(), 1);
    bench.publish(2);
    assert_eq!(bench.subscription.dropped(), 1);
    bench.publish(1);
    assert_eq!(bench.subscription.dropped(), 2);
    assert_eq!(read(&mut bench.subscription), Some(4));
}

#[test]
fn a_full_tap_loses_and_counts_while_the_publisher_goes_on() {
    let bench = bench(1);
    let tap = tap(&bench.topic, 3);
    bench.publish(10);
    assert_eq!(bench.topic.published(), 10);
    assert_eq!(tap.lost(), 7);
    let kept: Vec<u64> = tap
        .items()
        .try_iter()
        .map(|tapped| tapped.message.seq)
        .collect();
    assert_eq!(kept, [0, 1, 2]);
}

#[test]
fn a_full_tap_has_virtual_time_wait_and_loses_nothing() {
    const MESSAGES: u64 = 1_000;
    let (mut graph, topic) = (Graph::new(), Topic::new("/numbers", Depth::ONE));
    let node = graph.node("talker", hz(1_000.0), 0, |wiring| {
        let publisher = wiring.publisher(&topic);
        let mut said = 0;
        move |now| {
            publisher.publish(said, now, None);
            said += 1;
            if said < MESSAGES { GO_ON } else { END }
        }
    });
    node.expect("node");
    let tap = TapHandle::of(&graph).topic(&topic, 1);
    let got = thread::scope(|scope| {
        let items = tap.items().iter().take(MESSAGES as usize);
        let reader = scope.spawn(|| items.map(|tapped| tapped.message).collect::<Vec<_>>());
        run_virtual(&mut graph, Vec::new(), Time::MAX);
        reader.join().expect("read")
    });
    assert!(got.iter().map(|message| message.data).eq(0..MESSAGES));
    let last = got.last().map(|message| message.stamp);
    assert_eq!(last, Some(secs(0.999)), "waiting costs no run time");
    assert_eq!(tap.lost(), 0);
}

#[test]
fn a_tap_gets_every_message_and_ends_with_the_topic() {
    let bench = bench(1);
    let tap = tap(&bench.topic, 100);
    bench.publish(10);
    drop(bench);
    let messages = messages_of(&tap);
    let seqs: Vec<u64> = messages.iter().map(|message| message.seq).collect();
    assert_eq!(seqs, Vec::from_iter(0..10));
    assert_eq!(tap.lost(), 0);
}

#[test]
fn a_dropped_tap_does_not_affect_the_publisher() {
    let bench = bench(1);
    drop(tap(&bench.topic, 1));
    bench.publish(10);
    assert_eq!(bench.topic.published(), 10);
}

#[test]
fn a_dropped_subscription_counts_no_more_drops() {
    let mut bench = bench(1);
    drop(bench.topic.subscribe());
    bench.publish(3);
    assert_eq!(read(&mut bench.subscription), Some(2));
    assert_eq!(bench.subscription.dropped(), 2);
}

#[test]
fn the_age_of_a_message_is_measured_at_every_reading() {
    let (bench, mut graph) = (bench(1), Graph::new());
    let node = graph.node("reader", hz(1.0), 0, |wiring| {
        let mut subscription = wiring.subscription(&bench.topic);
        move |_| {
            for nanos in [10, 20, 60] {
                subscription.latest(Time::from_nanos(nanos));
            }
            GO_ON
        }
    });
    node.expect("a node");
    bench.publish(1);
    let observer = Observer::of(&graph);
    run_virtual(&mut graph, Vec::new(), Time::ZERO);
    let ages = &observer.snapshot().topics[0].readers[0].ages;
    assert_eq!((ages.count(), ages.sum().as_nanos()), (3, 90));
}

/// An operation on a topic; subscriptions are given by number.
#[derive(Clone, Copy, Debug)]
enum Step {
    Publish,
    Read(usize),
    SetDepth(usize),
    Subscribe,
}

fn steps() -> impl Strategy<Value = Vec<Step>> {
    let step = prop_oneof![
        4 => Just(Step::Publish),
        3 => (0..6usize).prop_map(Step::Read),
        1 => (1..8usize).prop_map(Step::SetDepth),
        1 => Just(Step::Subscribe),
    ];
    proptest::collection::vec(step, 0..200)
}

/// A topic without marks or counters: the remaining messages, and for each subscription
/// the messages it has not seen.
struct ReferenceTopic {
    depth: usize,
    published: u64,
    buffer: VecDeque<u64>,
    readers: Vec<ReferenceReader>,
}

#[derive(Default)]
struct ReferenceReader {
    unread: Vec<u64>,
    dropped: u64,
}

impl ReferenceTopic {
    fn new(depth: usize) -> Self {
        Self {
            depth,
            published: 0,
            buffer: VecDeque::new(),
            readers: Vec::new(),
        }
    }

    fn publish(&mut self) {
        self.buffer.push_back(self.published);
        for reader in &mut self.readers {
            reader.unread.push(self.published);
        }
        self.published += 1;
        self.shrink();
    }

    fn shrink(&mut self) {
        while self.buffer.len() > self.depth {
            let gone = self.buffer.pop_front();
            for reader in &mut self.readers {
                let before = reader.unread.len();
                reader.unread.retain(|message| Some(*message) != gone);
                reader.dropped += (before - reader.unread.len()) as u64;
            }
        }
    }

    fn read(&mut self, reader: usize) -> Option<u64> {
        self.readers[reader].unread.clear();
        self.buffer.back().copied()
    }
}

proptest! {
    #[test]
    fn any_sequence_of_operations_agrees_with_the_model(
        initial in 1..8usize,
        steps in steps(),
    ) {
        let topic = Topic::new("/test", depth(initial));
        let publisher = topic.publisher();
        let mut readers: Vec<_> = (0..3).map(|_| topic.subscribe()).collect();
        let mut model = ReferenceTopic::new(initial);
        model.readers.resize_with(readers.len(), ReferenceReader::default);
        for step in steps {
            match step {
                Step::Publish => {
                    publisher.publish(model.published, Time::ZERO, None);
                    model.publish();
                }
                Step::Read(reader) => {
                    let reader = reader % readers.len();
                    prop_assert_eq!(read(&mut readers[reader]), model.read(reader));
                }
                Step::SetDepth(messages) => {
                    let before = topic.set_depth(depth(messages), Time::ZERO);
                    prop_assert_eq!(before.get(), model.depth);
                    model.depth = messages;
                    model.shrink();
                }
                Step::Subscribe => {
                    readers.push(topic.subscribe());
                    model.readers.push(ReferenceReader::default());
                }
            }
            let dropped = readers.iter().map(Subscription::dropped);
            let expected = model.readers.iter().map(|reader| reader.dropped);
            prop_assert!(dropped.eq(expected), "after {:?}", step);
            prop_assert_eq!(topic.published(), model.published);
            prop_assert_eq!(topic.depth().get(), model.depth);
        }
    }
}
