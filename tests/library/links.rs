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

/// A publisher of 50 Hz for `seconds` and a reader, with these knobs turned before the run.
fn bench(seconds: f64, read_hz: f64, knobs: &str) -> Delivered {
    let (mut graph, topic) = (Graph::with(Effects), Topic::new("/test", depth(1)));
    graph.set_seed(7);
    talker(&mut graph, "talker", 50.0, 0, &topic, move |now| {
        (now < secs(seconds)).then_some(())
    });
    let read = reader(&mut graph, "reader", read_hz, 1, &topic);
    let tap = TapHandle::of(&graph).topic(&topic, 1_000);
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

/// Holds what was read and counted to what was `expected`, and that to its sums.
fn check_ledger(
    read: &[(Time, u64)],
    snapshot: &Snapshot,
    expected: Ledger,
) -> Result<(), TestCaseError> {
    let topic = snapshot.topic("/test").expect("a topic");
    prop_assert_eq!(read, &expected.read);
    prop_assert_eq!(topic.lost, expected.lost);
    prop_assert_eq!(topic.overtaken, expected.overtaken);
    prop_assert_eq!(topic.dropped(), expected.dropped);
    prop_assert_eq!(topic.in_flight(), expected.in_flight);
    let seen: BTreeSet<u64> = read.iter().map(|(_, seq)| *seq).collect();
    let delivered = seen.len() as u64 + expected.passed_over + expected.queued;
    let gone = topic.overtaken + topic.dropped() + topic.lost;
    prop_assert_eq!(topic.published, delivered + gone + topic.in_flight());
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]
    #[test]
    fn every_message_is_accounted_for_once(
        ways in proptest::collection::btree_map(0..150u64, proptest::option::of(0..400u64), 0..80),
        read_hz in 5..120u64,
        keeps in 1..8usize,
        oldest: bool,
    ) {
        let order = if oldest { "oldest" } else { "newest" };
        let faults = ways.iter().map(|(seq, way)| match way {
            Some(late) => format!("; postpone /test {seq} {late}"),
            None => format!("; lose /test {seq}"),
        });
        let faults = faults.collect::<String>();
        let knobs = format!("depth /test {keeps}; read /test {order}{faults}");
        let (read, snapshot, _) = bench(9.0, read_hz as f64, &knobs);
        let published = snapshot.topic("/test").expect("a topic").published;
        let ways = (0..published).map(|seq| {
            let late = ways.get(&seq).copied().unwrap_or(Some(0));
            late.map(|late| (seq * 20 + late) * 1_000_000)
        });
        check_ledger(&read, &snapshot, expected((read_hz, keeps, oldest), ways))?;
    }

    #[test]
    fn every_message_on_any_link_is_accounted_for_once(
        spec in almost_link(),
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
        let knobs =
            format!("{link}; depth /test {keeps}; read /test {order}; rate talker {hz}");
        let (read, snapshot, arrivals) = bench(9.0, read_hz as f64, &knobs);
        let ways = arrivals.iter().map(|arrives| arrives.map(Time::as_nanos));
        check_ledger(&read, &snapshot, expected((read_hz, keeps, oldest), ways))?;
    }
}

#[test]
fn a_deep_queue_behind_a_slightly_slower_reader_ages_without_a_drop() {
    let age = |order: &str| {
        let knobs = format!("depth /test 10; read /test {order}");
        let (read, snapshot, _) = bench(9.0, 49.0, &knobs);
        assert_eq!(snapshot.topic("/test").expect("a topic").dropped(), 0);
        let (at, seq) = *read.last().expect("read");
        at - Time::from_nanos(seq * 20_000_000)
    };
    assert!(age("newest").as_millis() < 20);
    assert!(age("oldest").as_millis() >= 60);
}

#[test]
fn unknown_targets_are_refused_with_the_known_ones() {
    for [knob, part] in rows(
        "link /state delay:3   | /state has no reader: expected one of /obs, /action
         read /nothing oldest  | expected one of /state, /obs, /action
         crash nobody          | expected one of world, sensor, policy, actuator
         crash world           | the world moves by itself
         clock world 1 0       | the world moves by itself
         rate world 10         | the world moves by itself
         takes world 5         | the world moves by itself
         offset world 5        | the world moves by itself
         wakes world 5         | the world moves by itself",
    ) {
        let error = refusal(&own(0, &knob));
        assert!(error.contains(&part), "{knob}: {error}");
    }
    let slow = "rate actuator 25";
    let actuator = refusal(&config(slow));
    assert!(actuator.contains("20 ms of the plant's time"), "{actuator}");
    check(slow, &run(&own(0, slow)), "ticks actuator 251");
}

#[test]
fn a_perfect_link_is_no_link() {
    let plain = run(&own(3, ""));
    let counts = |run: &Summary| {
        let counts = run.topics.iter().map(|topic| {
            let way = [topic.lost, topic.overtaken, topic.in_flight()];
            (topic.published, topic.dropped(), way)
        });
        counts.collect::<Vec<_>>()
    };
    for spec in ["/action none", "/action loss:0", "/obs delay:0,in-order"] {
        let linked = run(&own(3, &format!("link {spec}")));
        assert_eq!(linked.state, plain.state, "{spec}");
        assert_eq!(counts(&linked), counts(&plain), "{spec}");
    }
}

/// The number of seeds, out of six, that keep the pole up with this delay of actions.
fn balanced(control_hz: u32, delay_ms: u32) -> usize {
    let setup = format!("rate policy {control_hz}; link /action delay:{delay_ms}");
    let runs = (0..6).map(|seed| run(&own(seed, &setup)));
    runs.filter(|summary| !summary.verdict.is_lost()).count()
}

const DELAYS_MS: [u32; 8] = [0, 20, 40, 50, 60, 70, 80, 90];

/// Results of an independent program, by rate.
const BALANCED: [(u32, [usize; 8]); 4] = [
    (50, [6, 6, 6, 6, 6, 6, 6, 0]),
    (25, [6, 6, 6, 6, 6, 0, 0, 0]),
    (20, [6, 6, 6, 6, 0, 0, 0, 0]),
    (10, [6, 6, 1, 0, 0, 0, 0, 0]),
];

#[test]
fn all_delays_match_an_independent_program() {
    for (control_hz, counts) in BALANCED {
        let found = DELAYS_MS.map(|delay| balanced(control_hz, delay));
        assert_eq!(found, counts, "{control_hz} Hz");
    }
}

#[test]
fn a_crash_a_hang_or_a_wrong_clock_costs_a_node_what_the_table_says() {
    // After a restart the ticks due at 1.02 and at 1.04 are lost. Without a sensor the policy
    // continues with its last reading. A slow clock senses 15 ms before, with a stamp that is 5 ms
    // too early; one that drifts ticks once more in every hundred.
    for [list, figures] in rows(
        "1.01 crash sensor                          | verdict pole_fell; ticks sensor 51; overruns sensor 0; spent sensor 0; dropped /obs 0; dropped /action 0
         1.01 crash sensor; 1.05 restart sensor     | verdict balanced; ticks sensor 499; overruns sensor 0; spent sensor 0; dropped /obs 0; dropped /action 0
         1.01 crash policy; 1.05 restart policy     | verdict balanced; ticks policy 499; overruns policy 0; spent policy 0; dropped /obs 2; dropped /action 0
         1.01 crash actuator; 1.05 restart actuator | verdict balanced; ticks actuator 499; overruns actuator 0; spent actuator 0; dropped /obs 0; dropped /action 2
         1 hang policy 70                           | verdict balanced; ticks policy 498; overruns policy 3; spent policy 70; dropped /obs 3; dropped /action 1
         seed 0; clock sensor -5 0                  | ticks sensor 500; latency max 20
         seed 0; clock sensor 1000 0                | ticks sensor 501; latency max 0
         seed 0; clock sensor 0 10000               | ticks sensor 506",
    ) {
        let summary = run(&own(1, &list));
        check(&list, &summary, &figures);
        let policy = summary.node(POLICY).expect("a policy");
        assert!(policy.ticks > 60, "{list}");
    }
}

#[test]
fn a_node_without_a_restart_refuses_it() {
    let (_, snapshot, _) = bench(1.0, 10.0, "crash talker; restart talker");
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
    let ends = |list: &str| {
        // Counts its ticks, and ends the run at the fifth.
        let counter = system(|builder| {
            builder.node("counter", 10.0, 0, |wiring| {
                let (mut count, mut meter) = (0, wiring.meter("ticks"));
                move |_| {
                    count += 1;
                    meter.record(Duration::from_nanos(count));
                    if count < 5 { GO_ON } else { END }
                }
            })
        });
        let experiment = Experiment::new(counter, &config(list)).expect("a counter");
        let observer = experiment.observer();
        let end = experiment.run().expect("a run").sim_time;
        let ticks = observer.snapshot();
        let ticks = ticks.meter("counter", "ticks").expect("a meter").count();
        (end, ticks)
    };
    assert_eq!(ends(""), (secs(0.4), 5));
    assert_eq!(ends("0.25 restart counter"), (secs(0.7), 8));
    let crash = "0.05 crash counter; 1 restart counter";
    assert_eq!(ends(crash), (secs(1.4), 6));
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
    let (mut graph, topic) = (Graph::with(Effects), Topic::new("/test", depth(1)));
    talker(&mut graph, "talker", 50.0, 0, &topic, |_| Some(()));
    reader(&mut graph, "reader", 1.0, 1, &topic);
    let tap = TapHandle::of(&graph).topic(&topic, 10);
    let links = "0.01 link /test delay:30; 0.01 lose /test 2; 0.05 link /test none";
    run_virtual(&mut graph, links, secs(0.06));
    let arrives = |millis| Some(Time::ZERO + ms(millis));
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
