//! Links and faults of nodes, set by knobs, with the fate of every message. The virtual
//! clock's bytes are tested in `golden.rs`.

use std::collections::BTreeSet;

use proptest::prelude::*;

use crate::{
    support::{specs::almost_link, *},
    table::rows,
};

/// What was read when, the figures, and when each message arrives, if it does.
type Delivered = (Vec<(Time, u64)>, Snapshot, Vec<Option<Time>>);

/// Three seconds of a publisher of 50 Hz and a reader, with these knobs turned before the run.
fn bench(read_hz: f64, knobs: &str) -> Delivered {
    let (mut graph, topic) = (Graph::with_seed(7), Topic::new("/test", depth(1)));
    talker(&mut graph, "talker", 50.0, 0, &topic, |_| Some(()));
    let read = reader(&mut graph, "reader", read_hz, 1, &topic);
    let tap = TapHandle::new(&graph).topic(&topic, 1_000);
    run_virtual(&mut graph, &at_once(knobs), secs(3.0));
    let arrivals = tap.items().try_iter().map(|tapped| tapped.head.arrives);
    let read = read.try_iter().map(|(now, message)| (now, message.seq));
    (read.collect(), snapshot(&graph), arrivals.collect())
}

/// What becomes of messages, by the words of the contract alone.
#[derive(Default)]
struct Ledger {
    read: Vec<(Time, u64)>,
    lost: u64,
    overtaken: u64,
    dropped: u64,
    passed_over: u64,
    queued: u64,
    in_flight: u64,
}

/// `ways` are run times of arrival (ns), if there is one.
fn expected(
    (read_hz, keeps, oldest): (u64, usize, bool),
    ways: impl Iterator<Item = Option<u64>>,
) -> Ledger {
    let (mut ledger, mut arrivals) = (Ledger::default(), Vec::new());
    for (seq, way) in (0..).zip(ways) {
        match way {
            None => ledger.lost += 1,
            Some(at) => arrivals.push((at, seq)),
        }
    }
    arrivals.sort_unstable();
    let (mut queue, mut last, mut highest) = (Vec::new(), None, None);
    let mut arrivals = arrivals.into_iter().peekable();
    for tick in 0..=3 * read_hz {
        let now = tick * 1_000_000_000 / read_hz;
        while let Some((_, seq)) = arrivals.next_if(|(at, _)| *at <= now) {
            if highest > Some(seq) {
                ledger.overtaken += 1;
                continue;
            }
            highest = Some(seq);
            queue.push(seq);
            if queue.len() > keeps {
                queue.remove(0);
                ledger.dropped += 1;
            }
        }
        if !queue.is_empty() {
            let taken = if oldest { 1 } else { queue.len() };
            ledger.passed_over += taken as u64 - 1;
            last = queue.drain(..taken).next_back();
        }
        ledger
            .read
            .extend(last.map(|seq| (Time::from_nanos(now), seq)));
    }
    ledger.queued = queue.len() as u64;
    ledger.in_flight = arrivals.count() as u64;
    ledger
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]
    #[test]
    fn every_message_on_any_link_is_accounted_for_once(
        spec in prop_oneof![Just("none".to_owned()), almost_link()],
        faults in proptest::collection::btree_map(0..150u64, proptest::option::of(0..400u64), 0..80),
        hz in 5..150u64,
        // Who reads fast, with a deep queue, reads from the old end all that a link delivers.
        read_hz in prop_oneof![4 => 5..120u64, 1 => Just(1_000)],
        keeps in prop_oneof![4 => 1..12usize, 1 => Just(1_000)],
        oldest: bool,
    ) {
        let link = format!("link /test {spec}");
        if link.parse::<Knob>().is_err() {
            return Ok(());
        }
        let order = if oldest { "oldest" } else { "newest" };
        let faults = faults.iter().map(|(seq, way)| match way {
            Some(late) => format!("; postpone /test {seq} {late}"),
            None => format!("; lose /test {seq}"),
        });
        let faults = faults.collect::<String>();
        let settings = format!("depth /test {keeps}; read /test {order}; rate talker {hz}");
        let knobs = format!("{link}; {settings}{faults}");
        let (read, snapshot, arrivals) = bench(read_hz as f64, &knobs);
        let ways = arrivals.iter().map(|arrives| arrives.map(Time::as_nanos));
        let expected = expected((read_hz, keeps, oldest), ways);
        let topic = snapshot.topic("/test").expect("a topic");
        prop_assert_eq!(&read, &expected.read);
        let fates = [topic.lost, topic.overtaken, topic.dropped(), topic.in_flight()];
        let Ledger { lost, overtaken, dropped, in_flight, .. } = expected;
        prop_assert_eq!(fates, [lost, overtaken, dropped, in_flight], "lost, overtaken, dropped, in flight");
        let seen: BTreeSet<u64> = read.iter().map(|(_, seq)| *seq).collect();
        let delivered = seen.len() as u64 + expected.passed_over + expected.queued;
        prop_assert_eq!(topic.published, delivered + fates.iter().sum::<u64>());
    }
}

#[test]
fn a_perfect_link_is_no_link() {
    let plain = run(&own(3, ""));
    let fates = |run: &Summary| figure(run, "fates /state,/obs,/action");
    for spec in ["/action none", "/action loss:0", "/obs delay:0,in-order"] {
        let linked = run(&own(3, &format!("link {spec}")));
        assert_eq!(linked.state, plain.state, "{spec}");
        assert_eq!(fates(&linked), fates(&plain), "{spec}");
    }
}

#[test]
fn a_node_without_a_restart_refuses_it() {
    let (_, snapshot, _) = bench(10.0, "crash talker; restart talker");
    let talker = snapshot.node("talker").expect("a node");
    assert_eq!((talker.crashed, talker.ticks), (true, 0));
}

#[test]
fn a_node_that_is_built_once_more_has_the_message_of_its_setup() {
    let stale = |live: &str| {
        let setup = "send actuator zero:0; link /obs delay:1";
        run(&own(1, &format!("{setup}; {live}"))).sim_time
    };
    let never_pushed = stale("");
    assert!(never_pushed < secs(1.0), "a push that is 20 ms old");
    let sent = "0.01 send actuator hold";
    assert_eq!(stale(sent), secs(10.0));
    let sent = format!("{sent}; 0.03 restart actuator");
    assert!(stale(&sent) < secs(1.0), "it forgot what it was sent");
}

#[test]
fn any_node_of_a_system_is_started_again_without_knowing_how() {
    // Counts its ticks, and ends the run at the fifth.
    let counter = system(|builder| {
        builder.node("counter", 10.0, 0, |_| {
            let mut count = 0;
            move |_: &mut Tick| {
                count += 1;
                if count < 5 { Flow::Continue } else { Flow::End }
            }
        })
    });
    for [list, figures] in rows(
        "                                      | end 0.4; ticks counter 5
         0.25 restart counter                  | end 0.7; ticks counter 8
         0.05 crash counter; 1 restart counter | end 1.4; ticks counter 6",
    ) {
        check(&list, &run_of(counter.clone(), &config(&list)), &figures);
    }
}

#[test]
fn a_delay_is_the_wall_s_under_the_real_clock() {
    let links = "real; until 0.4; link /obs delay:80; link /action loss:1";
    let summary = run(&own(0, links));
    let [obs, action] = [OBS, ACTION].map(|topic| summary.topic(topic).expect(topic));
    assert!(obs.in_flight() >= 3 && obs.published > 10, "{obs:?}");
    assert!(
        action.published > 0 && action.lost == action.published,
        "{action:?}"
    );
    assert_eq!(summary.latency.count(), 0);
}

#[test]
fn a_tap_holds_every_message_with_its_arrival() {
    let (mut graph, topic) = (Graph::new(), Topic::new("/test", depth(1)));
    talker(&mut graph, "talker", 50.0, 0, &topic, |_| Some(()));
    reader(&mut graph, "reader", 1.0, 1, &topic);
    let tap = TapHandle::new(&graph).topic(&topic, 10);
    let links = "0.01 link /test delay:30; 0.01 lose /test 2; 0.05 link /test none";
    run_virtual(&mut graph, links, secs(0.06));
    let arrives = |millis| Some(at_ms(millis));
    let tapped = tap.items().try_iter();
    let tapped = tapped.map(|tapped| (tapped.message.seq, tapped.head.arrives));
    let expected = [
        (0, arrives(0)),
        (1, arrives(50)),
        (2, None),
        (3, arrives(60)),
    ];
    assert!(tapped.eq(expected));
}
