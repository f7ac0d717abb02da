//! Topics and their taps: nothing is lost in virtual time, ages are measured, and losses stay.

use std::thread;

use crate::support::*;

#[test]
fn a_full_tap_has_virtual_time_wait_and_loses_nothing() {
    const MESSAGES: u64 = 1_000;
    let (mut graph, topic) = (Graph::new(), Topic::new("/numbers", Depth::ONE));
    let millis = |now: Time| now.as_nanos() / 1_000_000;
    talker(&mut graph, "talker", 1_000.0, 0, &topic, move |now| {
        Some(millis(now))
    });
    let tap = TapHandle::new(&graph).topic(&topic, 1);
    let got = thread::scope(|scope| {
        let items = tap.items().iter().take(MESSAGES as usize);
        let reader = scope.spawn(|| items.map(|tapped| tapped.message).collect::<Vec<_>>());
        run_virtual(&mut graph, "", secs(0.999));
        reader.join().expect("read")
    });
    assert!(got.iter().map(|message| message.data).eq(0..MESSAGES));
    let last = got.last().map(|message| message.stamp);
    assert_eq!(last, Some(secs(0.999)), "waiting costs no run time");
    assert_eq!((tap.lost(), tapped(&tap).len()), (0, 0));
}

#[test]
fn the_age_of_a_message_is_measured_at_every_reading() {
    let (topic, mut graph) = (Topic::new("/test", Depth::ONE), Graph::new());
    let node = graph.node("reader", 1.0, 0, |wiring| {
        let mut subscription = wiring.subscription(&topic);
        move |_: &mut Tick| {
            for nanos in [10, 20, 60] {
                Tick::at(Time::from_nanos(nanos)).read(&mut subscription);
            }
        }
    });
    node.expect("a node");
    Tick::at(Time::ZERO).publish(&topic.publisher(), 0);
    run_virtual(&mut graph, "", Time::ZERO);
    let ages = &snapshot(&graph).topics[0].readers[0].ages;
    assert_eq!((ages.count(), ages.sum().as_nanos()), (3, 90));
}

#[test]
fn what_a_node_has_lost_stays_lost_when_it_is_gone() {
    let (word, mut graph) = (Topic::new("/word", Depth::ONE), Graph::new());
    let added = graph.node("ear", hz(1.0), 0, |wiring| {
        let ear = wiring.subscription(&word);
        move |_: &mut Tick| assert_eq!(ear.dropped(), 0)
    });
    added.expect("a node");
    let (publisher, mut tick) = (word.publisher(), Tick::at(Time::ZERO));
    let lost = |tick: &mut Tick| {
        tick.publish(&publisher, ());
        word.peek().map_or(0, |(_, head)| head.dropped)
    };
    assert_eq!([0; 3].map(|_| lost(&mut tick)), [0, 1, 2]);
    drop(graph);
    assert_eq!(lost(&mut tick), 2);
}
