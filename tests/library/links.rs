//! Links and faults of nodes, set by knobs, with the fate of every message. The virtual
//! clock's bytes are tested in `time.rs`.

use std::{
    collections::BTreeSet,
    sync::{Arc, Mutex},
    time::Duration,
};

use proptest::prelude::*;
use ratelab::{ClockKind, Command, END, GO_ON, Graph, Knob, Time, TimedCommand, Topic};
use ratelab_account::{Observer, Snapshot, TapHandle};
use ratelab_cart_pole::{ACTION, ACTUATOR, CartPole, OBS, POLICY, SENSOR};
use ratelab_effects::{Effects, checked};
use ratelab_study::{
    experiment::{Config, Experiment, Summary},
    system::{BuildError, Builder, System, WorldKind},
};

use crate::support::{depth, hz, run_virtual, secs, specs::almost_link};

fn knob(text: &str) -> Knob {
    checked(text.parse().expect(text)).expect(text)
}

#[test]
fn knobs_of_links_and_faults_are_read_back_from_text_and_from_json() {
    for text in [
        "link /obs delay:30",
        "link /obs delay:5..40.5,in-order",
        "link /obs delay:lognormal:10,50,loss:0.2,burst:0.01,4.5,reliable:40",
        "link /obs none",
        "read /obs oldest",
        "read /obs newest",
        "lose /obs 17",
        "postpone /obs 17 0.5",
        "crash policy",
        "restart policy",
        "hang policy 90",
        "clock sensor -12.5 40",
    ] {
        let knob = knob(text);
        assert_eq!(knob.to_string(), text);
        let json = serde_json::to_string(&Command::Set(knob.clone())).expect("json");
        let command: Command = serde_json::from_str(&json).expect("a command");
        assert_eq!(command, Command::Set(knob));
    }
    let spec = knob("link /obs burst:0.1,3, delay:lognormal:5,9,loss:0");
    assert_eq!(
        spec.to_string(),
        "link /obs delay:lognormal:5,9,burst:0.1,3"
    );
    assert!(!knob("lose /obs 1").is_of(&knob("lose /obs 2")));
}

#[test]
fn invalid_links_and_faults_are_refused_with_the_accepted_values() {
    for (text, part) in [
        ("link /obs", "expected link TOPIC SPEC"),
        ("link /obs delay:-1", "delay:lognormal:MEDIAN,P99"),
        ("link /obs delay:NaN", "\"NaN\" is no delay"),
        ("link /obs delay:9..3", "delay:A..B"),
        ("link /obs delay:recorded:a.rrd", "is no delay"),
        ("link /obs loss:1.5", "expected 0 to 1"),
        ("link /obs loss:NaN", "expected 0 to 1"),
        ("link /obs loss:-0.1", "expected 0 to 1"),
        ("link /obs burst:0.1", "expected burst:P,N"),
        ("link /obs burst:0.1,0.5", "expected 1 to"),
        ("link /obs loss:0.1,loss:0.2", "loss is there twice"),
        ("link /obs loss:1,reliable:40", "expected less than 1"),
        ("link /obs slow", "\"slow\" is no part of a link"),
        ("link /obs delay:3,,loss:0.1", "\"\" is no part of a link"),
        ("link /obs none,loss:0.1", "\"none\" is no part"),
        ("read /obs first", "expected newest or oldest"),
        ("lose /obs -1", "expected lose TOPIC N"),
        ("postpone /obs 3", "expected postpone TOPIC N MS"),
        ("postpone /obs 3 -4", "expected milliseconds"),
        ("crash policy now", "expected crash NODE"),
        ("crash", "is not a knob"),
        ("hang policy long", "expected milliseconds"),
        ("clock policy 5", "expected OFFSET_MS DRIFT_PPM"),
        ("clock policy 5 1e9", "500000 ppm"),
        ("clock policy NaN 0", "is no error of a clock"),
    ] {
        let knob = text.parse::<Knob>().map_err(|error| error.to_string());
        let error = knob.and_then(checked).expect_err(text);
        assert!(error.contains(part), "{text}: {error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}

/// A publisher of 50 Hz for `seconds`, a reader and what it read, with these knobs
/// turned before the run.
fn bench(seconds: f64, read_hz: f64, knobs: &[Knob]) -> (Vec<(Time, u64)>, Snapshot) {
    let (read, snapshot, _) = tapped_bench(seconds, read_hz, knobs);
    (read, snapshot)
}

/// The same, and when each message arrives, if it does.
fn tapped_bench(
    seconds: f64,
    read_hz: f64,
    knobs: &[Knob],
) -> (Vec<(Time, u64)>, Snapshot, Vec<Option<Time>>) {
    let (mut graph, topic) = (Graph::with(Effects), Topic::new("/test", depth(1)));
    graph.set_seed(7);
    let talker = graph.node("talker", hz(50.0), 0, |wiring| {
        let publisher = wiring.publisher(&topic);
        move |now| {
            if now < secs(seconds) {
                publisher.publish((), now, None);
            }
            GO_ON
        }
    });
    talker.expect("a node");
    let read = Arc::<Mutex<Vec<(Time, u64)>>>::default();
    let log = read.clone();
    let reader = graph.node("reader", hz(read_hz), 1, |wiring| {
        let mut messages = wiring.subscription(&topic);
        move |now| {
            let message = messages.latest(now);
            let seq = message.map(|message| message.seq);
            log.lock().expect("log").extend(seq.map(|seq| (now, seq)));
            GO_ON
        }
    });
    reader.expect("a node");
    let tap = TapHandle::of(&graph).topic(&topic, 1_000);
    let timed = knobs.iter().cloned().map(|knob| TimedCommand {
        at: Time::ZERO,
        command: Command::Set(knob),
    });
    run_virtual(&mut graph, timed.collect(), secs(3.0));
    let read = read.lock().expect("log").clone();
    let arrivals = tap.items().try_iter().map(|tapped| tapped.head.arrives);
    (read, Observer::of(&graph).snapshot(), arrivals.collect())
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
    prop_assert_eq!(
        (
            topic.lost,
            topic.overtaken,
            topic.dropped(),
            topic.in_flight()
        ),
        (
            expected.lost,
            expected.overtaken,
            expected.dropped,
            expected.in_flight
        )
    );
    let seen: BTreeSet<u64> = read.iter().map(|(_, seq)| *seq).collect();
    let Ledger {
        passed_over,
        queued,
        ..
    } = expected;
    let delivered = seen.len() as u64 + passed_over + topic.overtaken + topic.dropped() + queued;
    prop_assert_eq!(topic.published, delivered + topic.lost + topic.in_flight());
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
        let mut knobs = vec![
            knob(&format!("depth /test {keeps}")),
            knob(&format!("read /test {order}")),
        ];
        knobs.extend(ways.iter().map(|(seq, way)| knob(&match way {
            Some(late) => format!("postpone /test {seq} {late}"),
            None => format!("lose /test {seq}"),
        })));
        let (read, snapshot) = bench(9.0, read_hz as f64, &knobs);
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
        (hz, read_hz, keeps) in (5..150u64, 5..120u64, 1..12usize),
        oldest: bool,
    ) {
        let Ok(link) = format!("link /test {spec}").parse() else {
            return Ok(());
        };
        let order = if oldest { "oldest" } else { "newest" };
        let knobs = [
            link,
            knob(&format!("depth /test {keeps}")),
            knob(&format!("read /test {order}")),
            knob(&format!("rate talker {hz}")),
        ];
        let (read, snapshot, arrivals) = tapped_bench(9.0, read_hz as f64, &knobs);
        let ways = arrivals.iter().map(|arrives| arrives.map(Time::as_nanos));
        check_ledger(&read, &snapshot, expected((read_hz, keeps, oldest), ways))?;
    }

    #[test]
    fn who_reads_fast_and_from_the_old_end_reads_all_that_a_link_delivers(spec in almost_link()) {
        let Ok(link) = format!("link /test {spec}").parse() else {
            return Ok(());
        };
        let knobs = [link, knob("depth /test 1000"), knob("read /test oldest")];
        let (read, snapshot) = bench(2.0, 1_000.0, &knobs);
        let topic = snapshot.topic("/test").expect("a topic");
        let seen: BTreeSet<u64> = read.iter().map(|(_, seq)| *seq).collect();
        let ways = seen.len() as u64 + topic.overtaken + topic.lost + topic.in_flight();
        prop_assert_eq!((ways, topic.dropped()), (100, 0), "{}", spec);
        prop_assert!(read.is_sorted_by_key(|(_, seq)| *seq));
    }
}

#[test]
fn a_deep_queue_behind_a_slightly_slower_reader_ages_without_a_drop() {
    let age = |order: &str| {
        let knobs = [knob("depth /test 10"), knob(&format!("read /test {order}"))];
        let (read, snapshot) = bench(9.0, 49.0, &knobs);
        assert_eq!(snapshot.topic("/test").expect("a topic").dropped(), 0);
        let (at, seq) = *read.last().expect("read");
        at - Time::from_nanos(seq * 20_000_000)
    };
    assert!(age("newest").as_millis() < 20);
    assert!(age("oldest").as_millis() >= 60);
}

fn with(knobs: &[&str], config: Config) -> Config {
    let mut config = config;
    config.setup.extend(knobs.iter().map(|text| knob(text)));
    config
}

fn own(seed: u64) -> Config {
    Config {
        seed,
        world: WorldKind::OWN,
        ..Config::default()
    }
}

fn run(config: &Config) -> Summary {
    let experiment = Experiment::new(Arc::new(CartPole::default()), config);
    experiment.expect("an experiment").run().expect("a run")
}

fn refusal(knob: &str) -> String {
    let config = with(&[knob], own(0));
    let experiment = Experiment::new(Arc::new(CartPole::default()), &config);
    experiment.err().expect("a refusal").to_string()
}

#[test]
fn unknown_targets_are_refused_with_the_known_ones() {
    for (knob, part) in [
        (
            "link /state delay:3",
            "/state has no reader: expected one of /obs, /action",
        ),
        (
            "read /nothing oldest",
            "expected one of /state, /obs, /action",
        ),
        (
            "crash nobody",
            "expected one of world, sensor, policy, actuator",
        ),
        ("crash world", "the world moves by itself"),
        ("clock world 1 0", "the world moves by itself"),
    ] {
        let error = refusal(knob);
        assert!(error.contains(part), "{knob}: {error}");
    }
}

#[test]
fn a_perfect_link_is_no_link() {
    let plain = run(&own(3));
    for spec in [
        "link /action none",
        "link /action loss:0",
        "link /obs delay:0,in-order",
    ] {
        let linked = run(&with(&[spec], own(3)));
        assert_eq!(linked.state, plain.state, "{spec}");
        assert_eq!(linked.topics, plain.topics, "{spec}");
    }
}

/// The number of seeds, out of six, that keep the pole up with this delay of actions.
fn balanced(control_hz: u32, delay_ms: u32) -> usize {
    let knobs = [
        format!("rate policy {control_hz}"),
        format!("link /action delay:{delay_ms}"),
    ];
    let knobs = knobs.each_ref().map(String::as_str);
    let runs = (0..6).map(|seed| run(&with(&knobs, own(seed))));
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
fn a_crashed_node_is_silent_until_it_is_restarted_and_its_ticks_go_on() {
    let knobs = |text: &str| Config {
        knobs: CartPole::KNOBS.parse_list(text).expect("knobs"),
        ..own(1)
    };
    let dead = run(&knobs("1.01 crash sensor"));
    assert!(dead.verdict.is_lost());
    assert_eq!(dead.node(SENSOR).expect("a sensor").ticks, 51);
    // The policy continues with its last reading.
    assert!(dead.node(POLICY).expect("a policy").ticks > 60);

    let back = run(&knobs("1.01 crash policy\n1.05 restart policy"));
    assert!(!back.verdict.is_lost());
    // The ticks due at 1.02 and at 1.04 are lost in the crash.
    assert_eq!(back.node(POLICY).expect("a policy").ticks, 499);
    assert_eq!(back.node(POLICY).expect("a policy").overruns, 0);
}

#[test]
fn a_node_that_hangs_takes_its_time_once() {
    let config = Config {
        knobs: CartPole::KNOBS
            .parse_list("1 hang policy 70")
            .expect("knobs"),
        ..own(1)
    };
    let policy = run(&config).node(POLICY).expect("a policy").clone();
    assert_eq!((policy.ticks, policy.overruns), (498, 3));
    assert_eq!(policy.tick_time.sum().as_millis(), 70);
}

#[test]
fn a_node_without_a_restart_refuses_it() {
    let (_, snapshot) = bench(1.0, 10.0, &[knob("crash talker"), knob("restart talker")]);
    let talker = snapshot.node("talker").expect("a node");
    assert!(talker.crashed);
    assert_eq!(talker.ticks, 0);
}

/// Knobs of `text` in a run of the own world.
fn timed(text: &str) -> Config {
    Config {
        knobs: CartPole::KNOBS.parse_list(text).expect("knobs"),
        ..own(1)
    }
}

#[test]
fn a_sensor_or_an_actuator_that_crashed_is_started_again() {
    for node in [SENSOR, ACTUATOR] {
        let back = run(&timed(&format!("1.01 crash {node}\n1.05 restart {node}")));
        assert!(!back.verdict.is_lost(), "{node}");
        // Due at 1.02 and at 1.04, and dead.
        assert_eq!(back.node(node).expect(node).ticks, 499);
        let dropped = back.topics.iter().map(|topic| topic.dropped).sum::<u64>();
        assert_eq!(dropped, if node == ACTUATOR { 2 } else { 0 });
    }
}

#[test]
fn a_node_that_is_built_once_more_has_the_message_of_its_setup() {
    let stale = |live: &str| {
        let config = with(&["send actuator zero:0", "link /obs delay:1"], timed(live));
        run(&config).sim_time
    };
    let never_pushed = stale("");
    assert!(never_pushed < secs(1.0), "a push that is 20 ms old");
    assert_eq!(stale("0.01 send actuator hold"), secs(10.0));
    let sent = "0.01 send actuator hold\n0.03 restart actuator";
    assert!(stale(sent) < secs(1.0), "it forgot what it was sent");
}

/// Counts its ticks, and ends the run at the fifth.
struct Counter;

impl System for Counter {
    fn name(&self) -> &'static str {
        "counter"
    }

    fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
        builder.node("counter", 10.0, 0, |wiring| {
            let (mut count, mut meter) = (0, wiring.meter("ticks"));
            move |_| {
                count += 1;
                meter.record(Duration::from_nanos(count));
                if count < 5 { GO_ON } else { END }
            }
        })
    }
}

#[test]
fn any_node_of_a_system_is_started_again_without_knowing_how() {
    let ends = |knobs: &str| {
        let config = Config {
            knobs: CartPole::KNOBS.parse_list(knobs).expect("knobs"),
            ..Config::default()
        };
        let experiment = Experiment::new(Arc::new(Counter), &config).expect("a counter");
        let observer = experiment.observer();
        let end = experiment.run().expect("a run").sim_time;
        let ticks = observer.snapshot();
        let ticks = ticks.meter("counter", "ticks").expect("a meter").count();
        (end, ticks)
    };
    assert_eq!(ends(""), (secs(0.4), 5));
    assert_eq!(ends("0.25 restart counter"), (secs(0.7), 8));
    assert_eq!(
        ends("0.05 crash counter\n1 restart counter"),
        (secs(1.4), 6)
    );
}

#[test]
fn a_clock_that_is_fast_shifts_due_times_and_stamps() {
    let ticks = |summary: &Summary| summary.node(SENSOR).expect("a sensor").ticks;
    // Taken 15 ms before, with a stamp that is 5 ms too early.
    let slow = run(&with(&["clock sensor -5 0"], own(0)));
    assert_eq!(ticks(&slow), 500);
    assert_eq!(slow.latency.max(), Some(Duration::from_millis(20)));
    let fast = run(&with(&["clock sensor 1000 0"], own(0)));
    assert_eq!(ticks(&fast), 501);
    assert_eq!(fast.latency.max(), Some(Duration::ZERO));
    // One tick more in every hundred.
    let drifts = run(&with(&["clock sensor 0 10000"], own(0)));
    assert_eq!(ticks(&drifts), 506);
}

#[test]
fn a_delay_is_the_wall_s_under_the_real_clock() {
    let config = Config {
        clock: ClockKind::Real,
        end: Time::from_nanos(400_000_000),
        ..own(0)
    };
    let summary = run(&with(
        &["link /obs delay:80", "link /action loss:1"],
        config,
    ));
    let (obs, action) = (summary.topic(OBS), summary.topic(ACTION));
    assert!(obs.in_flight >= 3 && obs.published > 10, "{obs:?}");
    assert!(
        action.published > 0 && action.lost == action.published,
        "{action:?}"
    );
    assert_eq!(summary.latency.count(), 0);
}

#[test]
fn a_tap_holds_every_message_with_its_arrival() {
    let (mut graph, topic) = (Graph::with(Effects), Topic::new("/test", depth(1)));
    let talker = graph.node("talker", hz(50.0), 0, |wiring| {
        let publisher = wiring.publisher(&topic);
        move |now| {
            publisher.publish((), now, None);
            GO_ON
        }
    });
    talker.expect("a node");
    let reader = graph.node("reader", hz(1.0), 1, |wiring| {
        let mut messages = wiring.subscription(&topic);
        move |now| {
            messages.latest(now);
            GO_ON
        }
    });
    reader.expect("a node");
    let tap = TapHandle::of(&graph).topic(&topic, 10);
    let timed = [
        (0.01, "link /test delay:30"),
        (0.01, "lose /test 2"),
        (0.05, "link /test none"),
    ];
    let timed = timed.map(|(seconds, text)| crate::support::at(seconds, knob(text).into()));
    run_virtual(&mut graph, timed.to_vec(), secs(0.06));
    let tapped: Vec<_> = tap.items().try_iter().collect();
    let ms = |ms: u64| Some(Time::from_nanos(ms * 1_000_000));
    let arrivals: Vec<_> = tapped.iter().map(|tapped| tapped.head.arrives).collect();
    assert_eq!(arrivals, [ms(0), ms(50), None, ms(60)]);
    let seqs = tapped.iter().map(|tapped| tapped.message.seq);
    assert!(seqs.eq(0..4));
}
