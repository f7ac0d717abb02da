//! Triggers and executors under the virtual clock, against timelines worked out by hand, an
//! independent model of random graphs, and the textbooks of scheduling.

use std::{collections::HashMap, fmt::Write};

use proptest::prelude::*;

use crate::{support::*, table::rows};

/// A graph whose nodes take time, in milliseconds.
struct Bench {
    graph: Graph,
    names: Vec<String>,
    topics: HashMap<String, Topic<u64>>,
    /// The multiples (ms) that the messages of a timer are stamped by, where a topic has some.
    steps: HashMap<String, u64>,
    knobs: Vec<String>,
}

/// A tick: its node, due time, start and end (ms); the end of an unfinished one is no number.
type Ticked = (String, f64, f64, f64);

impl Bench {
    fn new() -> Self {
        Self {
            graph: Graph::new(),
            names: Vec::new(),
            topics: HashMap::new(),
            steps: HashMap::new(),
            knobs: Vec::new(),
        }
    }

    /// The graph in a line of `executors.txt`, with the end of its run (ms).
    fn read(line: &str) -> (Self, f64) {
        let fields = fields(line);
        let list = |key| fields.get(key).copied().unwrap_or_default();
        let (mut bench, mut callbacks) = (Self::new(), Vec::new());
        let steps = split(list("stamps"), ',').into_iter();
        bench.steps = steps
            .filter_map(|text| text.rsplit_once(':'))
            .map(|(topic, step)| (topic.to_owned(), step.parse().expect(step)))
            .collect();
        for node in split(list("nodes"), ';') {
            let parts: Vec<_> = node.split(',').collect();
            let [name, priority, release, cost, group, place, to] = parts[..] else {
                panic!("{node}");
            };
            let (release, from) = read_release(release);
            let (priority, cost) = (priority.parse().expect(node), cost.parse().expect(node));
            let to = split(to, '+');
            bench
                .node(name, priority, release, &from, cost, &to)
                .expect(name);
            let callback = Callback::new(name);
            match (place, group) {
                ("thread", _) => {}
                (_, "-") => callbacks.push(callback),
                (_, group) => callbacks.push(callback.in_group(group)),
            }
        }
        for (key, knob, value) in [("depths", "depth", " "), ("delays", "link", " delay:")] {
            let texts = split(list(key), ',').into_iter();
            let knobs = texts.map(|text| format!("{knob} {}", text.replace(':', value)));
            bench.knobs.extend(knobs);
        }
        let more = split(list("knobs"), ',').into_iter();
        bench.knobs.extend(more.map(|knob| knob.replace('_', " ")));
        if !callbacks.is_empty() {
            let executor = list("executor").parse().expect("an executor");
            bench.graph.executor(executor, callbacks).expect("nodes");
        }
        (bench, list("until").parse().expect("ms"))
    }

    fn topics(&mut self, names: &[&str]) -> Vec<Topic<u64>> {
        let topics = names.iter().map(|name| {
            let known = self.topics.entry((*name).to_owned());
            known
                .or_insert_with(|| Topic::new(*name, depth(1000)))
                .clone()
        });
        topics.collect()
    }

    fn node(
        &mut self,
        name: &str,
        priority: u32,
        release: Release,
        from: &[&str],
        cost: f64,
        to: &[&str],
    ) -> Result<(), GraphError> {
        let steps: Vec<_> = to
            .iter()
            .map(|topic| self.steps.get(*topic).copied())
            .collect();
        let (from, to) = (self.topics(from), self.topics(to));
        self.graph.node(name, release, priority, |wiring| {
            let mut from: Vec<_> = from.iter().map(|topic| wiring.trigger(topic)).collect();
            let to: Vec<_> = to.iter().map(|topic| wiring.publisher(topic)).collect();
            move |tick: &mut Tick| {
                let now = tick.now();
                let inputs = from.iter_mut().filter_map(|topic| tick.read(topic));
                let sensed = inputs.map(|message| message.sensed()).min();
                for (topic, step) in to.iter().zip(&steps) {
                    let stamp = || step.map(|step| rounded_down(now, step * 1_000_000));
                    tick.publish_stamped(topic, 0, sensed.or_else(stamp));
                }
            }
        })?;
        self.names.push(name.to_owned());
        self.knobs.push(format!("takes {name} {cost}"));
        Ok(())
    }

    /// The ticks that begin by run time `until` (ms), in the order of their starts.
    fn ticks(self, until: f64) -> Vec<Ticked> {
        // To the microsecond: a rate is kept in microhertz, which knows no period of 6 ms.
        let rounded = |ms: f64| (ms * 1e3).round() / 1e3;
        let ms = |time: Time| time.as_nanos() as f64 / 1e6;
        let mut all = Vec::new();
        for (name, ticks) in self.names.clone().iter().zip(self.tick_taps(until)) {
            all.extend(ticks.items().try_iter().map(|tick| {
                let late = tick.lateness.unwrap_or(Duration::ZERO).as_nanos() as f64 / 1e6;
                let (start, end) = (ms(tick.at), tick.ends.map_or(f64::NAN, ms));
                let [due, start, end] = [start - late, start, end].map(rounded);
                (name.clone(), due, start, end)
            }));
        }
        all.sort_by(|a, b| a.2.total_cmp(&b.2));
        all
    }

    /// The ticks of each node that begin by run time `until` (ms).
    fn tick_taps(mut self, until: f64) -> Vec<Tap<TickRecord>> {
        let taps = TapHandle::new(&self.graph).ticks(4096);
        let end = Time::from_nanos((until * 1e6) as u64);
        run_virtual(&mut self.graph, &at_once(&self.knobs.join(";")), end);
        taps
    }
}

/// The last multiple of `step` (ns) up to a run time.
fn rounded_down(at: Time, step: u64) -> Time {
    Time::from_nanos(at.as_nanos() / step * step)
}

fn split(list: &str, by: char) -> Vec<&str> {
    let parts = list.split(by);
    parts
        .filter(|part| !part.is_empty() && *part != "-")
        .collect()
}

/// When a node ticks, and the topics that trigger it.
fn read_release(text: &str) -> (Release, Vec<&str>) {
    let (kind, topics) = text.rsplit_once(':').expect("a kind");
    match kind {
        "every" => {
            let period: f64 = topics.parse().expect("a period");
            (Release::AtRate(hz(1000.0 / period)), Vec::new())
        }
        kind => {
            let matching: Match = kind.parse().expect(kind);
            (matching.into(), split(topics, '+'))
        }
    }
}

/// The end of a tick, or `none` for that of an unfinished one.
fn end(end: f64, none: &str) -> String {
    if end.is_nan() {
        none.to_owned()
    } else {
        end.to_string()
    }
}

#[test]
fn the_timelines_are_those_that_were_worked_out_by_hand() {
    let cases = include_str!("../fixtures/timelines.txt");
    let cases = cases.trim().split("\n\n").skip(1);
    let mut count = 0;
    for case in cases {
        let lines: Vec<_> = case.lines().collect();
        let [name, graph, expected] = lines[..] else {
            panic!("{case}");
        };
        let named = |node: &str| expected.contains(&format!("{node}("));
        let (bench, until) = Bench::read(graph);
        let ticks = bench.ticks(until).into_iter().filter(|tick| named(&tick.0));
        let ticks = ticks
            .map(|(node, due, start, ends)| format!("{node}({due}) {start}-{}", end(ends, "")));
        let expected: Vec<_> = expected.split(", ").collect();
        let ticks: Vec<_> = ticks.take(expected.len()).collect();
        assert_eq!(ticks, expected, "{name}");
        count += 1;
    }
    assert_eq!(count, 33);
}

#[test]
fn random_graphs_do_what_an_independent_model_does() {
    // More of them: `python3 tests/golden/executors.py 5000 > FILE`.
    let known = include_str!("../golden/executors.txt");
    let cases = golden_blocks(known, "RATELAB_EXECUTORS");
    for (number, case) in cases.iter().enumerate() {
        let (line, expected) = case.split_once('\n').expect("two lines");
        let (bench, until) = Bench::read(line);
        let (names, ticks, mut text) = (bench.names.clone(), bench.ticks(until), String::new());
        for name in &names {
            for (_, due, start, ends) in ticks.iter().filter(|tick| tick.0 == *name) {
                writeln!(text, "{name} {due} {start} {}", end(*ends, "-")).expect("written");
            }
        }
        let got = format!(
            "ticks={} hash={:016x}",
            ticks.len(),
            fnv1a64(text.as_bytes())
        );
        assert_eq!(got, expected, "graph {number}: {line}\n{text}");
    }
}

#[test]
fn ticks_know_whom_they_waited_for_and_were_set_aside_for() {
    let (mut bench, until) = Bench::read(
        "until=20 executor=fixed-priority:1 nodes=slow,1,every:20,7,-,executor,-;\
         fast,0,every:10,2,-,executor,-;last,2,every:20,1,-,executor,-;\
         apart,0,every:5,5,-,thread,- knobs=offset_fast_3",
    );
    let apart = [Callback::new("apart")];
    bench
        .graph
        .executor("single".parse().expect("an executor"), apart)
        .expect("a node");
    let lineage = Lineage::new(bench.graph.topology(), &[]);
    let lineage = settled(lineage, &bench.tick_taps(until));
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
fn invalid_triggers_and_executors_are_refused_with_a_remedy() {
    let mut bench = Bench::new();
    for [name, from, to, expected] in rows(
        "a | /x | /y |
         b | /y | /z |
         c | /z | /x | nodes trigger each other in a circle: c → a → b → c; let one of them tick at a rate
         d | /s | /s | nodes trigger each other in a circle: d → d; let one of them tick at a rate
         d |    |    | no topic triggers \"d\": take one with Wiring::trigger, or give the node a rate",
    ) {
        let (from, to) = (split(&from, '+'), split(&to, '+'));
        let added = bench.node(&name, 0, Match::Each.into(), &from, 0.0, &to);
        let said = added.map_err(|error| error.to_string()).err();
        assert_eq!(said.unwrap_or_default(), expected, "{name}");
    }
    for [executor, node, part] in rows(
        "single | nobody | there is no node \"nobody\"
         let    | a      | give it a rate
         edf:1  | a      | give it a deadline
         single | a      |
         events | a      | node \"a\" is already in an executor",
    ) {
        let kind: Executor = executor.parse().expect(&executor);
        let refused = bench.graph.executor(kind, [Callback::new(&node)]);
        let said = refused.map_err(|error| error.to_string()).err();
        let said = said.unwrap_or_default();
        assert!(
            said.contains(&part) && said.is_empty() == part.is_empty(),
            "{executor}: {said}"
        );
    }
}

#[test]
fn an_executor_is_read_from_its_name_or_refused() {
    for text in " multi multi:0 multi:x single:2 rm:1 edf:9999".split(' ') {
        let error = text.parse::<Executor>().expect_err(text);
        assert!(
            error.to_string().contains("is not an executor: expected"),
            "{error}"
        );
    }
    for text in "single multi:3 events fixed-priority:2 edf:1 let".split(' ') {
        assert_eq!(text.parse::<Executor>().expect(text).to_string(), text);
    }
}

#[test]
fn the_real_clock_refuses_what_it_cannot_run_by_name() {
    for executor in ["edf:1", "fixed-priority:1"] {
        let line = format!("until=1 executor={executor} nodes=A,0,every:10,0,-,executor,/x");
        let (mut bench, _) = Bench::read(&line);
        let inbox = &mut Inbox::default();
        let run = RealClock::default().run(&mut bench.graph, inbox, Time::from_nanos(1));
        let refusal = run.expect_err("a refusal").to_string();
        let said = format!(
            "node \"A\" failed at 0.000 s: under the real clock {executor} needs real-time priority \
             (--realtime): choose the virtual clock"
        );
        assert_eq!(refusal, said);
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
fn run_tasks(executor: &str, tasks: &Tasks) -> Vec<Ticked> {
    let nodes = tasks.iter().enumerate().map(|(index, (period, cost))| {
        format!("{index},{index},every:{period},{cost},-,executor,-")
    });
    let nodes: Vec<_> = nodes.collect();
    let line = format!("until=160 executor={executor} nodes={}", nodes.join(";"));
    let (bench, until) = Bench::read(&line);
    bench.ticks(until)
}

/// Whether a job misses its deadline, the end of its period.
fn misses(tasks: &Tasks, ticks: &[Ticked]) -> bool {
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
