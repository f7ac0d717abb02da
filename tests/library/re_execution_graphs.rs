//! A graph whose nodes share state or threads comes back from its log, and may be held between any
//! two operations of ticks that overlap.

use std::{
    sync::atomic::{AtomicBool, AtomicUsize, Ordering},
    thread,
    time::Instant,
};

use crossbeam_channel::Sender;

use crate::support::*;

/// Two nodes that add to one number, which is shared as `name`, and publish it.
fn adders(name: &str) -> (Graph, Arc<Shared<u64>>, Topic<u64>) {
    let mut graph = Graph::new();
    let (shared, topic) = (Arc::new(Shared::new(name, 0)), graph.topic("/sum"));
    for name in ["one", "other"] {
        let shared = shared.clone();
        talker(&mut graph, name, 1_000.0, 0, &topic, move |_| {
            let mut number = shared.lock();
            *number += 1;
            Some(*number)
        });
    }
    (graph, shared, topic)
}

/// Runs `graph` with these commands for so long with a log; its observer.
fn run_on(clock: &mut dyn Clock, graph: &mut Graph, commands: &str, seconds: f64) -> Observer {
    RunLog::attach(&graph.state());
    run_timed(clock, graph, commands, secs(seconds));
    Observer::new(graph)
}

fn run_really(graph: &mut Graph, seconds: f64) -> Observer {
    run_on(&mut RealClock::default(), graph, "", seconds)
}

/// Runs graphs of `build` until ticks overlap in one; its observer.
fn with_an_overlap(build: impl Fn() -> Graph) -> Observer {
    let mut runs = (0..).map(|_| run_really(&mut build(), 0.1));
    let overlaps = |observer: &Observer| !re_execution_of(observer).overlaps().is_empty();
    runs.find(overlaps).expect("one of them")
}

/// Executes `graph` with `re_execution`, held after each operation of overlap number `overlap` in turn:
/// `look` sees how many are done.
fn held_in(
    mut graph: Graph,
    mut re_execution: ReExecution,
    overlap: usize,
    mut look: impl FnMut(usize),
) {
    let all = re_execution.overlaps()[overlap].operations.len();
    re_execution.hold(overlap, 0);
    let watch = re_execution.watch();
    thread::scope(|scope| {
        scope.spawn(|| {
            let end = re_execution.run(&mut graph, &mut Inbox::default(), secs(0.1));
            end.expect("no fault");
        });
        for operations in 0..=all {
            watch.allow(operations);
            let done = loop {
                assert_eq!(watch.difference(), None);
                match watch.held() {
                    Some(done) if done >= operations => break done,
                    _ => thread::yield_now(),
                }
            };
            look(done);
        }
        watch.end();
    });
}

#[test]
fn a_run_is_held_between_any_two_operations_of_ticks_that_overlap() {
    let observer = with_an_overlap(|| adders("total").0);
    let overlaps = re_execution_of(&observer).overlaps();
    for (number, overlap) in overlaps.iter().enumerate().take(5) {
        assert!(overlap.from <= overlap.to);
        let (graph, total, topic) = adders("total");
        let turn = |name: &str, done: usize| {
            let here = |at: &usize| &*overlap.operations[*at].takes == name;
            let before = (0..done).rev().find(here);
            let next = (done..overlap.operations.len()).find(here);
            let before = before.map(|at| overlap.operations[at].turn + 1);
            before
                .or(next.map(|at| overlap.operations[at].turn))
                .expect("one")
        };
        held_in(graph, re_execution_of(&observer), number, |done| {
            assert_eq!(*total.peek(), turn("total", done), "after {done}");
            assert_eq!(topic.published(), turn("/sum", done), "after {done}");
        });
    }
}

#[test]
fn a_lock_within_another_one_does_not_hang_a_run_that_is_held() {
    let build = || {
        let [one, other] = ["one", "other"].map(|name| Arc::new(Shared::new(name, 0)));
        let mut graph = Graph::new();
        let (first, second) = (one.clone(), other.clone());
        let both = move |_: &mut Tick| {
            let mut first = first.lock();
            *first += 1;
            *second.lock() += *first;
        };
        let by_turns = move |_: &mut Tick| {
            *other.lock() += 1;
            *one.lock() += 1;
        };
        worker(&mut graph, "both", 2_000.0, 0, both);
        worker(&mut graph, "by turns", 2_000.0, 0, by_turns);
        graph
    };
    let observer = with_an_overlap(build);
    for (number, overlap) in re_execution_of(&observer)
        .overlaps()
        .iter()
        .enumerate()
        .take(20)
    {
        let mut last = 0;
        held_in(build(), re_execution_of(&observer), number, |done| {
            last = done
        });
        assert_eq!(last, overlap.operations.len());
    }
}

#[test]
fn shared_state_comes_back_in_the_same_order_and_a_node_that_does_something_else_is_named() {
    let observer = run_really(&mut adders("total").0, 0.2);
    for perturbed in [false, true] {
        let mut re_execution = re_execution_of(&observer);
        if perturbed {
            re_execution.perturb();
        }
        let again = run_on(&mut re_execution, &mut adders("total").0, "", 0.2);
        assert_eq!(re_execution.difference(), None);
        let logs = [&again, &observer].map(|observer| RunLog::attach(observer).log());
        assert_eq!(logs[0], logs[1], "its log is another one");
    }
    let mut re_execution = re_execution_of(&observer);
    // Another name for what the nodes share is another lock.
    run_on(&mut re_execution, &mut adders("sum").0, "", 0.2);
    let difference = re_execution.difference().expect("another run");
    assert!(
        difference.contains("took sum where the recorded run took total"),
        "{difference}"
    );
}

#[test]
fn a_node_that_waits_in_vain_is_named_by_the_watch() {
    let graph = |input: crossbeam_channel::Receiver<()>| {
        let mut graph = Graph::new();
        worker(&mut graph, "waits", 100.0, 0, move |_: &mut Tick| {
            let _ = input.recv();
        });
        graph
    };
    let (sender, input) = crossbeam_channel::unbounded();
    (0..1_000).for_each(|_| sender.send(()).expect("open"));
    let mut re_execution = re_execution_of(&run_really(&mut graph(input), 0.05));
    let (sender, input) = crossbeam_channel::unbounded();
    let (mut again, watch) = (graph(input), re_execution.watch());
    thread::scope(|scope| {
        scope.spawn(move || {
            let node = loop {
                if let Some(node) = watch.doing().node {
                    break node;
                }
                thread::yield_now();
            };
            assert_eq!(&*node.name, "waits");
            assert!(!node.took.is_zero(), "a long tick may be long again");
            drop(sender);
        });
        run_on(&mut re_execution, &mut again, "", 0.05);
    });
    assert_eq!(re_execution.difference(), None);
}

#[test]
fn a_log_of_an_earlier_release_is_named_as_such() {
    let (_, graph) = metronome();
    // A tick as it was logged then, without operations.
    let tick = [1, 0, 2, 0, 5, 0];
    let log: Log = [(0, vec![1, 0]), (1, tick.to_vec())].into_iter().collect();
    let error = ReExecution::new(&log, &[], &graph.topology()).expect_err("an earlier log");
    assert_eq!(error, LogError::Earlier);
}

/// Two nodes of an executor with two threads; the first one's ticks take 60 ms.
fn shared_threads() -> Graph {
    counted_threads(&Arc::default())
}

/// Such a graph, whose ticks count how many of them began.
fn counted_threads(began: &Arc<AtomicUsize>) -> Graph {
    let mut graph = Graph::new();
    for (name, rate) in [("slow", 10.0), ("fast", 100.0)] {
        let began = began.clone();
        worker(&mut graph, name, rate, 0, move |_: &mut Tick| {
            began.fetch_add(1, Ordering::Relaxed);
        });
    }
    graph.set(&knob("takes slow 60")).expect("a node");
    share_threads(&mut graph, ["slow", "fast"]);
    graph
}

/// Has two threads execute these nodes.
fn share_threads(graph: &mut Graph, nodes: [&str; 2]) {
    let executor = "multi:2".parse().expect("an executor");
    graph
        .executor(executor, nodes.map(Callback::new))
        .expect("nodes");
}

#[test]
fn a_branch_leaves_no_tick_of_an_executor_half_done() {
    let observer = run_really(&mut shared_threads(), 0.45);
    let rests = re_execution_of(&observer).rests();
    assert!(!rests.is_empty());
    for rest in rests {
        let began = Arc::default();
        let mut again = counted_threads(&began);
        let taps = TapHandle::new(&again).ticks(ROOM);
        let mut re_execution = re_execution_of(&observer);
        re_execution.branch(rest, Vec::new());
        let inbox = &mut Inbox::default();
        let exit = ratelab::run(
            &mut again,
            inbox,
            secs(0.45),
            ClockKind::Real,
            &mut re_execution,
        );
        exit.expect("a run");
        let recorded = taps.iter().map(|tap| tap.items().try_iter().count());
        let (began, recorded) = (began.load(Ordering::Relaxed), recorded.sum::<usize>());
        assert_eq!(began, recorded, "left at {rest}");
    }
}

#[test]
fn a_command_that_is_refused_comes_back_where_threads_share_nodes() {
    let hello = "0.1 send fast hello";
    let observer = run_on(&mut RealClock::default(), &mut shared_threads(), hello, 0.2);
    let mut re_execution = re_execution_of(&observer);
    re_execution.expect_refusals(|_| true);
    let again = run_on(&mut re_execution, &mut shared_threads(), "", 0.2);
    assert_eq!(re_execution.difference(), None);
    assert_eq!(observer.events(0).len(), 1);
    assert_eq!(again.events(0), observer.events(0));
}

/// Doubles a shared number, and says so after it was told to.
struct Doubler {
    number: Arc<Shared<u64>>,
    told: bool,
    done: Arc<AtomicBool>,
}

impl Node for Doubler {
    fn tick(&mut self, _: &mut Tick) -> TickResult {
        *self.number.lock() *= 2;
        if self.told {
            self.done.store(true, Ordering::SeqCst);
        }
        Ok(Flow::Continue)
    }

    fn on_order(&mut self, _: &str) -> Result<String, NodeError> {
        self.told = true;
        Ok(String::new())
    }
}

#[test]
fn a_command_for_a_node_beside_one_in_a_tick_does_not_hang_the_run_that_comes_back() {
    // In the first run the first node waits in its tick until the second one has obeyed and ticked.
    let graph = |mut commander: Option<Sender<Command>>| {
        let number = Arc::new(Shared::new("number", 1));
        let (mut graph, done) = (Graph::new(), Arc::<AtomicBool>::default());
        let (shared, is_done) = (number.clone(), done.clone());
        worker(&mut graph, "adder", 10.0, 0, move |_: &mut Tick| {
            if let Some(commander) = commander.take() {
                commander.send(command("send doubler now"))?;
                let patience = Instant::now() + Duration::from_secs(20);
                while !is_done.load(Ordering::SeqCst) && Instant::now() < patience {
                    thread::yield_now();
                }
            }
            *shared.lock() += 1;
            Ok(Flow::Continue)
        });
        let told = false;
        let doubler = Doubler { number, told, done };
        graph.node("doubler", 20.0, 0, |_| doubler).expect("a node");
        share_threads(&mut graph, ["adder", "doubler"]);
        graph
    };
    let (commander, mut inbox) = Inbox::new(Vec::new());
    let (mut first, end) = (graph(Some(commander)), secs(0.4));
    RunLog::attach(&first.state());
    let exit = RealClock::default().run(&mut first, &mut inbox, end);
    exit.expect("a run");
    let observer = Observer::new(&first);
    for _ in 0..5 {
        let mut re_execution = re_execution_of(&observer);
        let (sender, ended) = crossbeam_channel::bounded(1);
        let mut again = graph(None);
        thread::spawn(move || {
            let exit = re_execution.run(&mut again, &mut Inbox::default(), end);
            sender.send(exit.map(|_| re_execution.difference()))
        });
        let difference = ended.recv_timeout(Duration::from_secs(60));
        assert_eq!(difference.expect("it hangs").expect("a run"), None);
    }
}

#[test]
fn a_log_with_messages_for_inputs_that_no_node_has_harms_nobody() {
    let (graph, mut again) = (shared_threads(), shared_threads());
    let mut bytes = vec![1, 0];
    // A message for input 7 of node 1, and one for node 9; then a look at 100 ms.
    bytes.extend([16, 0, 1, 7, 0, 16, 0, 9, 0, 0]);
    bytes.extend([17, 0x80, 0x84, 0xaf, 0x5f, 0]);
    let threads = [(0, vec![1, 0]), (1, bytes), (2, vec![1, 0])];
    let log: Log = threads.into_iter().collect();
    if let Ok(mut re_execution) = ReExecution::from_torn(&log, &[], &graph.topology()) {
        let exit = re_execution.run(&mut again, &mut Inbox::default(), secs(1.0));
        assert_eq!(exit.expect("no panic"), ClockExit::Stopped);
    }
}
