//! Triggers and executors under the virtual clock, against timelines worked out by hand
//! from the sources of rclcpp and TrueTime, and against the textbooks of scheduling.

use std::{collections::HashMap, fmt::Write, time::Duration};

use proptest::prelude::*;

use ratelab::{
    Clock, Depth, GO_ON, Graph, GraphError, Hz, Inbox, Knob, RealClock, Time, TimedCommand, Topic,
    VirtualClock,
};
use ratelab_account::{Lineage, Observer, TapHandle, TickRecord, TickWait, WaitsFor};
use ratelab_effects::{Callback, Effects, Executor, Executors, Match};

/// A graph whose nodes take time, in milliseconds.
struct Bench {
    graph: Graph,
    names: Vec<String>,
    topics: HashMap<String, Topic<u64>>,
    knobs: Vec<String>,
}

impl Default for Bench {
    fn default() -> Self {
        Self {
            graph: Graph::with(Effects),
            names: Default::default(),
            topics: Default::default(),
            knobs: Default::default(),
        }
    }
}

impl Bench {
    fn topic(&mut self, name: &str) -> Topic<u64> {
        let new = || Topic::new(name, Depth::new(1000).expect("a depth"));
        self.topics
            .entry(name.to_owned())
            .or_insert_with(new)
            .clone()
    }

    /// A node that ticks every `period`, takes `cost` and publishes to topics.
    fn timer(&mut self, name: &str, period: f64, cost: f64, publishes: &[&str]) {
        self.timer_with(name, 0, period, cost, publishes);
    }

    fn timer_with(&mut self, name: &str, priority: u32, period: f64, cost: f64, to: &[&str]) {
        let to: Vec<_> = to.iter().map(|topic| self.topic(topic)).collect();
        let hz = Hz::new(1000.0 / period).expect("a rate");
        let build = self.graph.node(name, hz, priority, |wiring| {
            let to: Vec<_> = to.iter().map(|topic| wiring.publisher(topic)).collect();
            move |now| {
                to.iter().for_each(|topic| topic.publish(0, now, None));
                GO_ON
            }
        });
        build.expect(name);
        self.names.push(name.to_owned());
        self.knobs.push(format!("takes {name} {cost}"));
    }

    /// A node that ticks on messages.
    fn on(&mut self, name: &str, from: &[&str], cost: f64, publishes: &[&str]) {
        self.on_matching(name, 0, Match::Each, from, cost, publishes)
            .expect(name);
    }

    fn on_matching(
        &mut self,
        name: &str,
        priority: u32,
        matching: Match,
        from: &[&str],
        cost: f64,
        to: &[&str],
    ) -> Result<(), GraphError> {
        let from: Vec<_> = from.iter().map(|topic| self.topic(topic)).collect();
        let to: Vec<_> = to.iter().map(|topic| self.topic(topic)).collect();
        self.graph.node(name, matching, priority, |wiring| {
            let mut from: Vec<_> = from.iter().map(|topic| wiring.trigger(topic)).collect();
            let to: Vec<_> = to.iter().map(|topic| wiring.publisher(topic)).collect();
            move |now| {
                let inputs = from.iter_mut().filter_map(|topic| topic.latest(now));
                let sensed = inputs.map(|message| message.sensed()).min();
                to.iter().for_each(|topic| topic.publish(0, now, sensed));
                GO_ON
            }
        })?;
        self.names.push(name.to_owned());
        self.knobs.push(format!("takes {name} {cost}"));
        Ok(())
    }

    /// Has an executor run nodes, in this order; `together` are in one group.
    fn executor(&mut self, executor: &str, nodes: &[&str], together: &[&str]) {
        let callbacks = nodes.iter().map(|node| match together.contains(node) {
            true => Callback::of(*node).in_group("together"),
            false => Callback::of(*node),
        });
        let executor: Executor = executor.parse().expect(executor);
        self.graph.executor(executor, callbacks).expect("nodes");
    }

    fn knob(&mut self, knob: &str) {
        self.knobs.push(knob.to_owned());
    }

    /// The ticks that begin by run time `until` (ms), as `node(due) start-end`, in the order
    /// of their starts and then of the nodes.
    fn run(self, until: f64) -> Vec<String> {
        let ticks = self.ticks(until);
        let text = |(name, due, start, end): &(String, f64, f64, f64)| {
            let end = if end.is_nan() {
                String::new()
            } else {
                end.to_string()
            };
            format!("{name}({due}) {start}-{end}")
        };
        ticks.iter().map(text).collect()
    }

    /// The same as node, due time, start and end (ms); the end of an unfinished one is no
    /// number.
    fn ticks(self, until: f64) -> Vec<(String, f64, f64, f64)> {
        let names = self.names.clone();
        let ticks = self.tick_records(until);
        // To the microsecond: a rate is kept in microhertz, which knows no period of 6 ms.
        let rounded = |ms: f64| (ms * 1e3).round() / 1e3;
        let ms = |time: Time| time.as_nanos() as f64 / 1e6;
        let mut all = Vec::new();
        for (name, ticks) in names.iter().zip(ticks) {
            for tick in ticks {
                let late = tick.lateness.unwrap_or(Duration::ZERO).as_nanos() as f64 / 1e6;
                let start = ms(tick.at);
                let end = tick.ends.map_or(f64::NAN, ms);
                all.push((
                    name.clone(),
                    rounded(start - late),
                    rounded(start),
                    rounded(end),
                ));
            }
        }
        all.sort_by(|a, b| a.2.total_cmp(&b.2));
        all
    }

    /// The ticks of each node that begin by run time `until` (ms).
    fn tick_records(mut self, until: f64) -> Vec<Vec<TickRecord>> {
        let taps = TapHandle::of(&self.graph).ticks(4096);
        let commands = self.knobs.iter().map(|knob| TimedCommand {
            at: Time::ZERO,
            command: knob.parse::<Knob>().expect(knob).into(),
        });
        let (_commander, mut inbox) = Inbox::new(commands.collect());
        let end = Time::from_nanos((until * 1e6) as u64);
        let exit = VirtualClock.run(&mut self.graph, &mut inbox, end);
        exit.expect("no fault");
        drop(self.graph);
        let ticks = taps.iter().map(|tap| tap.items().try_iter().collect());
        ticks.collect()
    }
}

/// The ticks as text, as they are written in the fixtures.
fn expect(ticks: &[String], fixture: &str) {
    let parts = fixture.split(['|', ',']).map(str::trim);
    let expected: Vec<_> = parts.collect();
    assert_eq!(ticks[..expected.len().min(ticks.len())], expected);
}

/// The graph of the first timeline: two timers, and a subscription to what the first sends.
fn two_timers(executor: &str) -> Bench {
    let mut bench = Bench::default();
    bench.timer("A", 10.0, 4.0, &["/x"]);
    bench.timer("B", 15.0, 7.0, &[]);
    bench.on("S", &["/x"], 3.0, &[]);
    // Where both are due, B is a few nanoseconds later, as it was registered later.
    bench.knob("offset B 0.00001");
    bench.executor(executor, &["A", "B", "S"], &[]);
    bench
}

#[test]
fn one_thread_serves_what_was_ready_when_it_looked_timers_first() {
    let expected = "A(10) 10-14 | S(14) 14-17 | B(15) 17-24 | A(20) 24-28 | S(28) 28-31 | \
        A(30) 31-35 | B(30) 35-42 | A(40) 42-46 | S(35) 46-49 | B(45) 49-56 | S(46) 56-59 | \
        A(50) 59-63 | A(60) 63-67 | B(60) 67-74 | S(63) 74-77";
    expect(&two_timers("single").run(77.0), expected);
    expect(&two_timers("multi:1").run(77.0), expected);
}

#[test]
fn an_events_executor_serves_in_the_order_of_the_events() {
    let expected = "A(10) 10-14 | S(14) 14-17 | B(15) 17-24 | A(20) 24-28 | S(28) 28-31 | \
        A(30) 31-35 | B(30) 35-42 | S(35) 42-45 | A(40) 45-49 | B(45) 49-56 | S(49) 56-59 | \
        A(50) 59-63 | A(60) 63-67 | B(60) 67-74 | S(63) 74-77";
    expect(&two_timers("events").run(77.0), expected);
}

#[test]
fn a_timer_that_takes_too_long_skips_the_instants_that_have_passed() {
    let busy = |executor| {
        let mut bench = Bench::default();
        bench.timer("A", 10.0, 25.0, &[]);
        bench.executor(executor, &["A"], &[]);
        bench.run(110.0)
    };
    let expected = "A(10) 10-35 | A(20) 35-60 | A(40) 60-85 | A(70) 85-110 | A(90) 110-";
    expect(&busy("single"), expected);
    let backlog = "A(10) 10-35 | A(20) 35-60 | A(30) 60-85 | A(40) 85-110 | A(50) 110-";
    expect(&busy("events"), backlog);
}

/// A timer that takes longer than its period, and a subscription.
fn overloaded(executor: &str, together: &[&str]) -> Vec<String> {
    let mut bench = Bench::default();
    bench.timer("A", 10.0, 12.0, &[]);
    bench.timer("sender", 10.0, 0.0, &["/x"]);
    bench.on("S", &["/x"], 1.0, &[]);
    bench.knob("offset sender 5");
    bench.executor(executor, &["A", "S"], together);
    let mut ticks = bench.run(74.0);
    ticks.retain(|tick| !tick.starts_with("sender"));
    ticks
}

#[test]
fn an_overloaded_timer_does_not_starve_a_subscription_of_one_thread() {
    let expected = "S(5) 5-6 | A(10) 10-22 | A(20) 22-34 | S(15) 34-35 | A(30) 35-47 | \
        S(25) 47-48 | A(40) 48-60 | S(35) 60-61 | A(50) 61-73 | S(45) 73-74 | A(70) 74-";
    expect(&overloaded("single", &[]), expected);
}

#[test]
fn an_overloaded_timer_starves_a_subscription_of_its_group_with_two_threads() {
    let expected = "S(5) 5-6 | A(10) 10-22 | A(20) 22-34 | A(30) 34-46 | A(40) 46-58 | A(50) 58-70";
    expect(&overloaded("multi:2", &["A", "S"]), expected);
}

#[test]
fn a_window_serves_one_message_of_each_subscription() {
    let mut bench = Bench::default();
    bench.timer("sender", 1000.0, 0.0, &["/x", "/x", "/x", "/y"]);
    bench.on("X", &["/x"], 2.0, &[]);
    bench.on("Y", &["/y"], 2.0, &[]);
    bench.executor("single", &["X", "Y"], &[]);
    let ticks = bench.run(10.0);
    expect(&ticks[1..], "X(0) 0-2 | Y(0) 2-4 | X(0) 4-6 | X(0) 6-8");
}

#[test]
fn a_deep_queue_makes_a_slow_subscription_read_old_messages() {
    for (depth, taken) in [
        (1, [10, 30, 50, 80, 100]),
        (2, [10, 20, 40, 70, 90]),
        (10, [10, 20, 30, 40, 50]),
    ] {
        for executor in ["single", "fixed-priority:1", ""] {
            let mut bench = Bench::default();
            bench.timer("sender", 10.0, 0.0, &["/x"]);
            bench.on("S", &["/x"], 24.0, &[]);
            bench.knob("offset sender 10");
            bench.knob(&format!("depth /x {depth}"));
            if !executor.is_empty() {
                bench.executor(executor, &["S"], &[]);
            }
            let mut ticks = bench.ticks(110.0);
            ticks.retain(|tick| tick.0 == "S");
            let starts: Vec<_> = ticks.iter().map(|tick| tick.2).collect();
            assert_eq!(starts, [10.0, 34.0, 58.0, 82.0, 106.0]);
            let due: Vec<_> = ticks.iter().map(|tick| tick.1).collect();
            assert_eq!(
                due,
                taken.map(f64::from),
                "depth {depth}, executor {executor:?}"
            );
        }
    }
}

#[test]
fn a_second_subscription_of_a_group_starves_with_two_threads() {
    // The graph of ros2/rclcpp#2645.
    let graph = |executor| {
        let mut bench = Bench::default();
        bench.timer("P", 1.0, 0.0, &["/t1", "/t2"]);
        bench.on("S2", &["/t2"], 5.0, &[]);
        bench.on("S1", &["/t1"], 5.0, &[]);
        bench.knob("depth /t1 100");
        bench.knob("depth /t2 100");
        bench.executor(executor, &["P", "S2", "S1"], &["S2", "S1"]);
        bench
    };
    let starts = |ticks: &[(String, f64, f64, f64)], name: &str| {
        let ticks = ticks.iter().filter(|tick| tick.0 == name);
        ticks.map(|tick| tick.2).collect::<Vec<_>>()
    };
    let ticks = graph("single").ticks(999.5);
    assert_eq!(starts(&ticks, "S2")[..3], [1.0, 11.0, 21.0]);
    assert_eq!(starts(&ticks, "S1")[..3], [6.0, 16.0, 26.0]);
    assert_eq!(starts(&ticks, "P")[..3], [1.0, 11.0, 21.0]);
    for executor in ["multi:2", "multi:3"] {
        let bench = graph(executor);
        let observer = Observer::of(&bench.graph);
        let ticks = bench.ticks(999.5);
        let first = starts(&ticks, "S2");
        assert_eq!((first.len(), &first[..3]), (200, &[1.0, 6.0, 11.0][..]));
        assert!(starts(&ticks, "S1").is_empty());
        let snapshot = observer.snapshot();
        let topic = snapshot.topic("/t1").expect("a topic");
        assert_eq!((topic.published, topic.dropped()), (999, 899));
    }
}

#[test]
fn a_second_timer_of_a_group_starves_with_two_threads() {
    // The graph of ros2/rclcpp#2360, a hundred times faster.
    let ticks = |executor| {
        let mut bench = Bench::default();
        bench.timer("A", 10.0, 10.0, &[]);
        bench.timer("B", 10.0, 10.0, &[]);
        bench.executor(executor, &["A", "B"], &["A", "B"]);
        bench.run(45.0)
    };
    expect(
        &ticks("single"),
        "A(10) 10-20 | B(10) 20-30 | A(20) 30-40 | B(30) 40-",
    );
    expect(
        &ticks("multi:2"),
        "A(10) 10-20 | A(20) 20-30 | A(30) 30-40 | A(40) 40-",
    );
}

#[test]
fn more_threads_starve_a_timer_although_the_machine_is_not_full() {
    // From Teper et al., TCAD 2024: a utilisation of 1.51 on two threads.
    let starts = |executor, name: &str| {
        let mut bench = Bench::default();
        for timer in ["t1", "t2", "t3"] {
            bench.timer(timer, 1000.0, 500.0, &[]);
        }
        bench.timer("t4", 1000.0, 10.0, &[]);
        bench.executor(executor, &["t1", "t2", "t3", "t4"], &["t3", "t4"]);
        let ticks = bench.ticks(6600.0).into_iter();
        let ticks = ticks.filter(|tick| tick.0 == name);
        ticks.map(|tick| tick.2).collect::<Vec<_>>()
    };
    assert_eq!(starts("multi:1", "t4")[..3], [2500.0, 4510.0, 6520.0]);
    assert_eq!(starts("multi:2", "t1")[..2], [1000.0, 2000.0]);
    assert_eq!(starts("multi:2", "t3")[..2], [1500.0, 2500.0]);
    assert!(starts("multi:2", "t4").is_empty());
    assert_eq!(starts("multi:3", "t4")[..2], [1500.0, 2500.0]);
}

/// TrueTime's three servos on one core: the ticks of 1 s.
fn three_servos(executor: &str) -> Vec<(String, f64, f64, f64)> {
    let mut bench = Bench::default();
    for (name, priority, period) in [("1", 2, 6.0), ("2", 1, 5.0), ("3", 0, 4.0)] {
        bench.timer_with(name, priority, period, 2.0, &[]);
    }
    bench.executor(executor, &["1", "2", "3"], &[]);
    bench.ticks(1000.0)
}

/// The jobs of a task that were done in a second, and of these the late ones.
fn done_and_missed(ticks: &[(String, f64, f64, f64)], name: &str, period: f64) -> (usize, usize) {
    let done = ticks
        .iter()
        .filter(|tick| tick.0 == name && tick.3 <= 1000.0);
    let done: Vec<_> = done.collect();
    let missed = done.iter().filter(|tick| tick.3 > tick.1 + period + 1e-3);
    (done.len(), missed.count())
}

#[test]
fn rate_monotonic_servos_miss_all_deadlines_of_the_slowest_task() {
    let ticks = three_servos("fixed-priority:1");
    let of = |name, period| done_and_missed(&ticks, name, period);
    assert_eq!(
        (of("1", 6.0), of("2", 5.0), of("3", 4.0)),
        ((50, 50), (200, 0), (250, 0))
    );
    let ends: Vec<_> = ticks
        .iter()
        .filter(|tick| tick.0 == "1")
        .map(|tick| tick.3)
        .collect();
    assert_eq!(ends[..4], [20.0, 40.0, 60.0, 80.0]);
    // Started in the gaps of the others, and preempted at once: 332233223322331233213322.
    let begun: Vec<_> = ticks
        .iter()
        .take(12)
        .map(|tick| (&*tick.0, tick.2))
        .collect();
    assert_eq!(
        begun,
        [
            ("3", 0.0),
            ("2", 2.0),
            ("3", 4.0),
            ("2", 6.0),
            ("3", 8.0),
            ("2", 10.0),
            ("3", 12.0),
            ("1", 14.0),
            ("2", 15.0),
            ("3", 16.0),
            ("3", 20.0),
            ("2", 22.0),
        ]
    );
}

#[test]
fn earliest_deadline_first_shares_an_overload_among_all_servos() {
    let ticks = three_servos("edf:1");
    let of = |name, period| done_and_missed(&ticks, name, period);
    assert_eq!(of("1", 6.0), (135, 133));
    assert_eq!(of("2", 5.0), (162, 160));
    assert_eq!(of("3", 4.0), (203, 201));
    let begun: String = ticks.iter().take(12).map(|tick| &*tick.0).collect();
    // 332211332211332233112233: each runs for 2 ms without a break.
    assert_eq!(begun, "321321323123");
}

#[test]
fn ticks_know_whom_they_waited_for_and_were_set_aside_for() {
    let mut bench = Bench::default();
    bench.timer_with("slow", 1, 20.0, 7.0, &[]);
    bench.timer_with("fast", 0, 10.0, 2.0, &[]);
    bench.timer_with("last", 2, 20.0, 1.0, &[]);
    bench.timer("apart", 5.0, 5.0, &[]);
    bench.knob("offset fast 3");
    bench.executor("fixed-priority:1", &["slow", "fast", "last"], &[]);
    bench.executor("single", &["apart"], &[]);
    let mut lineage = Lineage::new(bench.graph.topology());
    for (node, ticks) in bench.tick_records(20.0).into_iter().enumerate() {
        ticks.into_iter().for_each(|tick| lineage.tick(node, tick));
    }
    lineage.settle();
    let ms = |time: Time| time.as_nanos() / 1_000_000;
    let told = |waits: Vec<TickWait>| -> Vec<_> {
        let waits = waits.iter();
        waits
            .map(|wait| (ms(wait.from), ms(wait.to), wait.what))
            .collect()
    };
    // slow 0-3 and 5-9, fast 3-5, last 9-10: it waited from 0 on, mostly for slow.
    assert_eq!(told(lineage.set_aside(0, 0)), [(3, 5, WaitsFor::Node(1))]);
    assert_eq!(told(lineage.waits(2, 0)), [(0, 9, WaitsFor::Node(0))]);
    assert_eq!((lineage.waits(0, 0), lineage.waits(1, 0)), (vec![], vec![]));
    assert_eq!(lineage.set_aside(1, 0), []);
}

#[test]
fn with_logical_execution_time_outputs_appear_at_the_end_of_the_period() {
    let mut bench = Bench::default();
    bench.timer("A", 10.0, 3.0, &["/x"]);
    bench.on("S", &["/x"], 0.0, &[]);
    bench.timer("late", 10.0, 12.0, &[]);
    bench.executor("let", &["A", "late"], &[]);
    let ticks = bench.run(20.0);
    expect(
        &ticks,
        "A(0) 0-10 | late(0) 0-20 | A(10) 10-20 | S(10) 10-10 | A(20) 20- | S(20) 20-20 | late(20) 20-",
    );
}

#[test]
fn a_triggered_node_follows_its_message_within_the_instant_by_priority() {
    let mut bench = Bench::default();
    bench.timer_with("sensor", 0, 10.0, 0.0, &["/x"]);
    bench.on("filter", &["/x"], 0.0, &["/y"]);
    bench.on("policy", &["/y"], 4.0, &["/u"]);
    bench.on("driver", &["/u"], 0.0, &[]);
    let ticks = bench.run(10.0);
    expect(
        &ticks,
        "sensor(0) 0-0 | filter(0) 0-0 | policy(0) 0-4 | driver(4) 4-4 | sensor(10) 10-10",
    );
}

#[test]
fn links_delay_and_lose_triggers() {
    let mut bench = Bench::default();
    bench.timer("sender", 10.0, 0.0, &["/x"]);
    bench.on("S", &["/x"], 0.0, &[]);
    bench.knob("link /x delay:3");
    bench.knob("lose /x 1");
    bench.knob("postpone /x 2 15");
    let mut ticks = bench.run(50.0);
    ticks.retain(|tick| tick.starts_with('S'));
    // The third message is overtaken by the fourth.
    expect(&ticks, "S(3) 3-3 | S(33) 33-33 | S(43) 43-43");
}

#[test]
fn a_crashed_node_misses_its_triggers_and_a_late_thread_begins_late() {
    let mut bench = Bench::default();
    bench.timer("sender", 10.0, 0.0, &["/x"]);
    bench.on("S", &["/x"], 2.0, &[]);
    bench.knob("wakes S 1");
    bench.knob("depth /x 1");
    let mut ticks = bench.run(20.0);
    ticks.retain(|tick| tick.starts_with('S'));
    expect(&ticks, "S(0) 1-3 | S(10) 11-13");
}

#[test]
fn one_from_each_fires_with_the_newest_and_begins_anew() {
    let mut bench = Bench::default();
    bench.timer("fast", 10.0, 0.0, &["/fast"]);
    bench.timer("slow", 25.0, 0.0, &["/slow"]);
    bench.on("fusion", &["/fast", "/slow"], 0.0, &["/fused"]);
    bench.on("last", &["/fused"], 0.0, &[]);
    let mut ticks = bench.run(75.0);
    ticks.retain(|tick| tick.starts_with("fusion"));
    expect(
        &ticks,
        "fusion(0) 0-0 | fusion(25) 25-25 | fusion(50) 50-50 | fusion(75) 75-75",
    );
}

#[test]
fn exact_time_needs_equal_stamps_and_forgets_older_ones() {
    let mut bench = Bench::default();
    bench.timer("left", 10.0, 0.0, &["/left"]);
    bench.timer("right", 25.0, 0.0, &["/right"]);
    let matching = "exact:10".parse().expect("a match");
    bench
        .on_matching("stereo", 0, matching, &["/left", "/right"], 1.0, &[])
        .expect("a node");
    let mut ticks = bench.run(110.0);
    ticks.retain(|tick| tick.starts_with("stereo"));
    expect(
        &ticks,
        "stereo(0) 0-1 | stereo(50) 50-51 | stereo(100) 100-101",
    );
}

#[test]
fn invalid_triggers_and_executors_are_refused_with_a_remedy() {
    let mut bench = Bench::default();
    bench.on("a", &["/x"], 0.0, &["/y"]);
    bench.on("b", &["/y"], 0.0, &["/z"]);
    let each = Match::Each;
    let error = bench.on_matching("c", 0, each, &["/z"], 0.0, &["/x"]);
    let error = error.expect_err("a circle").to_string();
    assert_eq!(
        error,
        "nodes trigger each other in a circle: c → a → b → c; let one of them tick at a rate"
    );
    let error = bench.on_matching("self", 0, each, &["/s"], 0.0, &["/s"]);
    assert!(
        matches!(error, Err(GraphError::TriggerCycle(_))),
        "{error:?}"
    );
    let error = bench.on_matching("d", 0, each, &[], 0.0, &[]);
    assert!(matches!(error, Err(GraphError::NoTrigger(_))), "{error:?}");
    for (executor, node, part) in [
        ("single", "nobody", "there is no node \"nobody\""),
        ("let", "a", "give it a rate"),
        ("edf:1", "a", "give it a deadline"),
    ] {
        let executor: Executor = executor.parse().expect(executor);
        let error = bench.graph.executor(executor, [Callback::of(node)]);
        let error = error.expect_err(part).to_string();
        assert!(error.contains(part), "{error}");
    }
    bench.executor("single", &["a"], &[]);
    let error = bench.graph.executor(Executor::Events, [Callback::of("a")]);
    assert!(
        matches!(error, Err(GraphError::SecondExecutor(_))),
        "{error:?}"
    );
    for text in [
        "", "multi", "multi:0", "multi:x", "single:2", "rm:1", "edf:9999",
    ] {
        let error = text.parse::<Executor>().expect_err(text);
        assert!(error.contains("is not an executor: expected"), "{error}");
    }
    for text in [
        "single",
        "multi:3",
        "events",
        "fixed-priority:2",
        "edf:1",
        "let",
    ] {
        assert_eq!(text.parse::<Executor>().expect(text).to_string(), text);
    }
}

#[test]
fn the_real_clock_refuses_what_it_cannot_run_by_name() {
    for (executor, why) in [
        (
            "edf:1",
            "the real clock has no executor edf:1: choose the virtual clock",
        ),
        (
            "fixed-priority:1",
            "under the real clock fixed-priority:1 needs real-time priority (--realtime): choose \
             the virtual clock",
        ),
    ] {
        let mut bench = Bench::default();
        bench.timer("A", 10.0, 0.0, &["/x"]);
        bench.executor(executor, &["A"], &[]);
        let inbox = &mut Inbox::default();
        let run = RealClock::default().run(&mut bench.graph, inbox, Time::from_nanos(1));
        let refusal = run.expect_err("a refusal").to_string();
        assert_eq!(refusal, format!("node \"A\" failed at 0.000 s: {why}"));
    }
}

const GOLDEN: &str = include_str!("../golden/executors.txt");

/// The graph in a line of `executors.txt`, with the end of its run (ms).
fn golden_graph(line: &str) -> (Bench, f64) {
    let words = line.split(' ').filter_map(|word| word.split_once('='));
    let words: HashMap<_, _> = words.collect();
    let list = |text: &'static str, separator| {
        let parts = text
            .split(separator)
            .filter(|part| !part.is_empty() && *part != "-");
        parts.collect::<Vec<_>>()
    };
    // A test may keep what it reads.
    let words: HashMap<&str, &'static str> = words
        .into_iter()
        .map(|(key, text)| (key, &*text.to_owned().leak()))
        .collect();
    let (mut bench, mut callbacks) = (Bench::default(), Vec::new());
    for node in list(words["nodes"], ';') {
        let [name, priority, release, cost, group, place, publishes] = list_of_seven(node);
        let (priority, cost) = (priority.parse().expect(priority), cost.parse().expect(cost));
        let publishes = list(publishes, '+');
        match release.split_once(':').expect(release) {
            ("every", period) => {
                let period = period.parse().expect(period);
                bench.timer_with(name, priority, period, cost, &publishes);
            }
            (_, topics) => {
                let topics = list(topics, '+');
                bench
                    .on_matching(name, priority, Match::Each, &topics, cost, &publishes)
                    .expect(name);
            }
        }
        let callback = Callback::of(name);
        match (place, group) {
            ("thread", _) => {}
            (_, "-") => callbacks.push(callback),
            (_, group) => callbacks.push(callback.in_group(group)),
        }
    }
    for (knob, texts) in [("depth", words["depths"]), ("link", words["delays"])] {
        for text in list(texts, ',') {
            let (topic, value) = text.split_once(':').expect(text);
            let delay = if knob == "link" { "delay:" } else { "" };
            bench.knob(&format!("{knob} {topic} {delay}{value}"));
        }
    }
    let executor = words["executor"].parse().expect("an executor");
    bench.graph.executor(executor, callbacks).expect("nodes");
    (bench, words["until"].parse().expect("ms"))
}

fn list_of_seven(text: &'static str) -> [&'static str; 7] {
    let parts: Vec<_> = text.split(',').collect();
    parts.try_into().expect("seven parts")
}

fn fnv1a64(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

#[test]
fn random_graphs_do_what_an_independent_model_does() {
    // More of them: `python3 tests/golden/executors.py 5000 > FILE`.
    let file = std::env::var("RATELAB_EXECUTORS").ok();
    let file = file.map(|file| std::fs::read_to_string(file).expect("a file"));
    let cases = file.as_deref().unwrap_or(GOLDEN).trim().split("\n\n");
    for (number, case) in cases.enumerate() {
        let (line, expected) = case.split_once('\n').expect("two lines");
        let (bench, until) = golden_graph(line);
        let names = bench.names.clone();
        let ticks = bench.ticks(until);
        let mut text = String::new();
        for name in &names {
            for (_, due, start, end) in ticks.iter().filter(|tick| tick.0 == *name) {
                let end = if end.is_nan() {
                    "-".to_owned()
                } else {
                    end.to_string()
                };
                writeln!(text, "{name} {due} {start} {end}").expect("written");
            }
        }
        let got = format!("ticks={} hash={:016x}", ticks.len(), fnv1a64(&text));
        assert_eq!(got, expected, "graph {number}: {line}\n{text}");
    }
}

/// A set of independent periodic tasks: period and cost (ms).
type Tasks = Vec<(u32, u32)>;

fn tasks() -> impl Strategy<Value = Tasks> {
    let period = prop::sample::select(vec![4, 5, 8, 10, 16, 20, 40]);
    prop::collection::vec((period, 1u32..8), 2..5)
}

fn utilisation(tasks: &Tasks) -> f64 {
    let shares = tasks
        .iter()
        .map(|(period, cost)| f64::from(*cost) / f64::from(*period));
    shares.sum()
}

/// The ticks of the tasks in two hyper-periods, the most frequent first.
fn run_tasks(executor: &str, tasks: &Tasks) -> Vec<(String, f64, f64, f64)> {
    let mut bench = Bench::default();
    for (index, (period, cost)) in tasks.iter().enumerate() {
        let priority = u32::try_from(index).expect("few");
        let (period, cost) = (f64::from(*period), f64::from(*cost));
        bench.timer_with(&index.to_string(), priority, period, cost, &[]);
    }
    let names = bench.names.clone();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    bench.executor(executor, &names, &[]);
    bench.ticks(160.0)
}

/// Whether a job misses its deadline, the end of its period.
fn misses(tasks: &Tasks, ticks: &[(String, f64, f64, f64)]) -> bool {
    ticks.iter().any(|(name, due, _, end)| {
        let deadline = due + f64::from(tasks[name.parse::<usize>().expect("a number")].0);
        *end > deadline || (end.is_nan() && deadline <= 160.0)
    })
}

/// The worst response time of each task under fixed priorities (Joseph and Pandya, 1986).
fn response_times(tasks: &Tasks) -> Vec<Option<u32>> {
    let response = |(index, (period, cost)): (usize, &(u32, u32))| {
        let mut response = *cost;
        while response <= *period {
            let higher = tasks[..index].iter();
            let interference: u32 = higher.map(|(t, c)| response.div_ceil(*t) * c).sum();
            if cost + interference == response {
                return Some(response);
            }
            response = cost + interference;
        }
        None
    };
    tasks.iter().enumerate().map(response).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn the_worst_response_time_is_that_of_a_simultaneous_release(tasks in tasks()) {
        let ticks = run_tasks("fixed-priority:1", &tasks);
        for (task, expected) in response_times(&tasks).into_iter().enumerate() {
            let name = task.to_string();
            let of = ticks.iter().filter(|tick| tick.0 == name && !tick.3.is_nan());
            let responses: Vec<_> = of.map(|tick| tick.3 - tick.1).collect();
            let Some(expected) = expected.map(f64::from) else { break };
            prop_assert_eq!(responses.first().copied(), Some(expected));
            prop_assert!(responses.iter().all(|response| *response <= expected));
        }
    }

    #[test]
    fn rate_monotonic_keeps_all_deadlines_up_to_the_bound_of_liu_and_layland(tasks in tasks()) {
        let mut tasks = tasks;
        tasks.sort();
        let count = tasks.len() as f64;
        if utilisation(&tasks) <= count * (2f64.powf(1.0 / count) - 1.0) {
            prop_assert!(!misses(&tasks, &run_tasks("fixed-priority:1", &tasks)));
        }
    }

    #[test]
    fn earliest_deadline_first_keeps_all_deadlines_up_to_a_full_core(tasks in tasks()) {
        let missed = misses(&tasks, &run_tasks("edf:1", &tasks));
        prop_assert_eq!(missed, utilisation(&tasks) > 1.0 + 1e-9);
    }

    #[test]
    fn one_thread_serves_each_timer_within_two_windows(tasks in tasks()) {
        // Whatever the load: the rest of a window, and the next one.
        let window: u32 = tasks.iter().map(|(_, cost)| cost).sum();
        let ticks = run_tasks("single", &tasks);
        let late = ticks.iter().find(|tick| tick.3 - tick.1 > f64::from(2 * window));
        prop_assert_eq!(late, None);
    }
}

#[test]
fn the_age_of_an_action_has_a_part_for_the_wait_for_the_executor() {
    let mut bench = Bench::default();
    bench.timer("sensor", 20.0, 0.0, &["/obs"]);
    bench.timer("load", 20.0, 7.0, &[]);
    bench.on("policy", &["/obs"], 3.0, &["/action"]);
    bench.on("actuator", &["/action"], 0.0, &[]);
    bench.executor("single", &["load", "policy"], &[]);
    let (topology, names) = (bench.graph.topology(), bench.names.clone());
    let taps = TapHandle::of(&bench.graph);
    let heads = ["/obs", "/action"].map(|topic| taps.topic(&bench.topics[topic], 100));
    let ticks = bench.tick_records(55.0);
    let mut lineage = Lineage::new(topology);
    for (index, tap) in heads.iter().enumerate() {
        for tapped in tap.items().try_iter() {
            lineage.message(index, &tapped.head);
        }
    }
    for (node, ticks) in ticks.into_iter().enumerate() {
        ticks.into_iter().for_each(|tick| lineage.tick(node, tick));
    }
    lineage.settle();
    let actuator = names
        .iter()
        .position(|name| name == "actuator")
        .expect("a node");
    let push = lineage.push_at(actuator, Time::from_nanos(30_000_001));
    let parts = push.expect("a push").parts(Time::from_nanos(30_000_000));
    assert_eq!(
        parts.sentence(lineage.topology()),
        "this push is 10 ms old: 7 waiting for the executor of the policy + 3 thinking"
    );
}
