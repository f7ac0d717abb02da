//! Triggers and executors under the real clock: what comes of a run is the same when it is
//! executed again, also with stretches of virtual time in it.

use std::{ops::Range, time::Duration};

use ratelab::{
    Clock, ClockExit, ClockKind, Command, GO_ON, Graph, Inbox, Knob, RealClock, Time, TimedCommand,
    Topic, VirtualClock,
};
use ratelab_account::{Observer, TapHandle, TickRecord};
use ratelab_effects::{Callback, Effects, Executor, Executors, Match};
use ratelab_replay::{Rerun, RunLog};

use crate::support::{self, depth, hz, secs};

/// A camera and a lidar, a detector for each image, a fusion of both, and a controller with
/// logical execution time.
struct Robot {
    graph: Graph,
    fused: Topic<u64>,
    command: Topic<u64>,
}

/// A node that adds what it reads, and publishes the sum.
fn adder(graph: &mut Graph, name: &str, matching: Match, from: &[&Topic<u64>], to: &Topic<u64>) {
    let added = graph.node(name, matching, 1, |wiring| {
        let mut from: Vec<_> = from.iter().map(|topic| wiring.trigger(topic)).collect();
        let to = wiring.publisher(to);
        let mut total = 0;
        move |now| {
            let read = from.iter_mut().filter_map(|topic| topic.latest(now));
            total += read.map(|message| message.data + message.seq).sum::<u64>();
            to.publish(total, now, None);
            GO_ON
        }
    });
    added.expect(name);
}

/// The nodes of an executor, the last two in a group.
fn callbacks() -> [Callback; 5] {
    let apart = ["camera", "detector"].map(Callback::of);
    let [camera, detector] = apart;
    let reentrant = Callback::of("lidar").in_reentrant_group();
    let group = ["fusion", "closest"].map(|name| Callback::of(name).in_group("slow"));
    let [fusion, closest] = group;
    [camera, reentrant, detector, fusion, closest]
}

/// Its nodes but for the controller are those of `executor`, if there is one.
fn robot(executor: Option<Executor>) -> Robot {
    let mut graph = Graph::with(Effects);
    let [image, scan, objects, fused, command] =
        ["/image", "/scan", "/objects", "/fused", "/command"]
            .map(|name| Topic::new(name, depth(4)));
    for (name, rate, topic) in [("camera", 200.0, &image), ("lidar", 100.0, &scan)] {
        let added = graph.node(name, hz(rate), 0, |wiring| {
            let topic = wiring.publisher(topic);
            move |now: Time| {
                topic.publish(now.as_nanos() % 7, now, None);
                GO_ON
            }
        });
        added.expect(name);
    }
    adder(&mut graph, "detector", Match::Each, &[&image], &objects);
    adder(
        &mut graph,
        "fusion",
        Match::Each,
        &[&objects, &scan],
        &fused,
    );
    let added = graph.node("control", hz(100.0), 0, |wiring| {
        let (mut fused, command) = (wiring.subscription(&fused), wiring.publisher(&command));
        move |now| {
            let read = fused.latest(now).map_or(0, |message| message.data);
            command.publish(read, now, None);
            GO_ON
        }
    });
    added.expect("control");
    let callback = [Callback::of("control")];
    graph.executor(Executor::Let, callback).expect("a rate");
    let closest: Match = "approximate:4".parse().expect("a text");
    adder(
        &mut graph,
        "closest",
        closest,
        &[&image, &scan],
        &Topic::new("/closest", depth(4)),
    );
    if let Some(executor) = executor {
        graph.executor(executor, callbacks()).expect("nodes");
    }
    Robot {
        graph,
        fused,
        command,
    }
}

/// All that comes of a run.
#[derive(Debug, PartialEq)]
struct Result {
    ticks: Vec<Vec<TickRecord>>,
    fused: Vec<(u64, u64, Time)>,
    commands: Vec<(u64, u64, Time)>,
    dropped: Vec<u64>,
}

fn command(at: f64, text: &str) -> TimedCommand {
    let knob: Knob = text.parse().expect(text);
    support::at(at, knob.into())
}

fn hand_over(at: f64, clock: ClockKind) -> TimedCommand {
    support::at(at, Command::HandOver(clock))
}

/// Runs a robot for 0.2 s, first under `real`, then as it hands itself over.
fn run(
    real: &mut dyn Clock,
    executor: Option<Executor>,
    timed: Vec<TimedCommand>,
) -> (Observer, Result) {
    let mut robot = robot(executor);
    RunLog::of(&robot.graph.state());
    let taps = TapHandle::of(&robot.graph).ticks(4096);
    let [fused, commands] =
        [&robot.fused, &robot.command].map(|topic| TapHandle::of(&robot.graph).topic(topic, 4096));
    let (_commander, mut inbox) = Inbox::new(timed);
    let mut exit = ClockExit::HandedOver(ClockKind::Real);
    while let ClockExit::HandedOver(clock) = exit {
        let clock: &mut dyn Clock = match clock {
            ClockKind::Real => real,
            ClockKind::Virtual => &mut VirtualClock,
        };
        exit = clock
            .run(&mut robot.graph, &mut inbox, secs(0.2))
            .expect("no fault");
    }
    let messages = |tap: ratelab_account::Tap<ratelab_account::TapMessage<u64>>| {
        let items = tap.items().try_iter();
        items
            .map(|item| (item.message.data, item.message.seq, item.head.at))
            .collect()
    };
    let observer = Observer::of(&robot.graph);
    let topics = observer.snapshot().topics;
    let result = Result {
        ticks: taps
            .iter()
            .map(|tap| tap.items().try_iter().collect())
            .collect(),
        fused: messages(fused),
        commands: messages(commands),
        dropped: topics.iter().map(|topic| topic.dropped()).collect(),
    };
    (observer, result)
}

/// What the clock of the wall took: under the virtual clock that is not the run's.
fn without_took(mut result: Result, virtual_time: Range<Time>) -> Result {
    for tick in result.ticks.iter_mut().flatten() {
        if virtual_time.contains(&tick.at) {
            tick.took = None;
        }
    }
    result
}

fn knobs() -> Vec<TimedCommand> {
    vec![
        command(0.0, "takes detector 2"),
        command(0.0, "takes control 3"),
        command(0.0, "link /scan delay:4"),
        command(0.03, "takes detector 12"),
    ]
}

fn comes_back(
    first: (Observer, Result),
    executor: Option<Executor>,
    given: &[TimedCommand],
    virtual_time: Range<Time>,
) {
    let (observer, recorded) = first;
    let recorded = without_took(recorded, virtual_time.clone());
    for perturbed in [false, true] {
        let rerun = Rerun::new(
            &RunLog::of(&observer).log(),
            &observer.events(0),
            &observer.topology(),
        );
        let mut rerun = rerun.expect("a log");
        if perturbed {
            rerun.perturb();
        }
        let (again, result) = run(&mut rerun, executor, given.to_vec());
        assert_eq!(rerun.difference(), None);
        assert_eq!(without_took(result, virtual_time.clone()), recorded);
        assert_eq!(again.events(0), observer.events(0));
        assert_eq!(
            RunLog::of(&again).log(),
            RunLog::of(&observer).log(),
            "its log is another one"
        );
    }
}

/// Runs and executes again, until a run was on time enough for what `shows` looks for.
fn until(
    executor: Option<Executor>,
    timed: &[TimedCommand],
    virtual_time: Range<Time>,
    shows: impl Fn(&[Vec<TickRecord>]) -> bool,
) {
    let under_virtual =
        |timed: &&TimedCommand| virtual_time.start < timed.at && timed.at <= virtual_time.end;
    // Given again: what the log of the threads does not have.
    let given: Vec<_> = timed.iter().filter(under_virtual).cloned().collect();
    for _ in 0..20 {
        let first = run(&mut RealClock::default(), executor, timed.to_vec());
        let shown = shows(&first.1.ticks);
        comes_back(first, executor, &given, virtual_time.clone());
        if shown {
            return;
        }
    }
    panic!("no run was on time");
}

#[test]
fn a_run_with_triggers_comes_back_to_the_bit() {
    until(None, &knobs(), Time::ZERO..Time::ZERO, |ticks| {
        let [_, _, detector, fusion, control, closest] = ticks else {
            panic!("six nodes");
        };
        let ms = Duration::from_millis;
        // A delayed message arrives with its link: nothing is fused before.
        let delayed = fusion.iter().all(|tick| tick.at >= Time::ZERO + ms(4));
        // What comes of a tick is there at the end of its period, and not before.
        let ended: Vec<_> = control
            .iter()
            .filter_map(|tick| Some(tick.ends? - tick.at))
            .collect();
        // The first ticks may come before the commands.
        delayed
            && detector.len() > 10
            && fusion.len() > 5
            && closest.len() > 3
            && ended.iter().all(|took| *took > ms(3))
            && ended.iter().any(|took| *took > ms(8))
    });
}

#[test]
fn triggers_go_on_under_the_other_clock() {
    let (from, to) = (secs(0.08), secs(0.14));
    let mut timed = knobs();
    timed.push(hand_over(0.08, ClockKind::Virtual));
    timed.push(hand_over(0.14, ClockKind::Real));
    until(None, &timed, from..to, |ticks| {
        let fused = |range: Range<Time>| ticks[3].iter().any(|tick| range.contains(&tick.at));
        fused(Time::ZERO..from) && fused(from..to) && fused(to..secs(0.2))
    });
}

#[test]
fn every_message_triggers_a_tick_or_is_dropped() {
    let mut robot = robot(None);
    let run = RealClock::default().run(&mut robot.graph, &mut Inbox::default(), secs(0.3));
    run.expect("no fault");
    let snapshot = Observer::of(&robot.graph).snapshot();
    let published = snapshot.topics[0].published;
    let (ticks, dropped) = (snapshot.nodes[2].ticks, snapshot.topics[0].dropped());
    // The last one may come after the end.
    let accounted = ticks + dropped;
    assert!(
        accounted == published || accounted + 1 == published,
        "{ticks} ticks and {dropped} dropped of {published}"
    );
}

fn executors() -> impl Iterator<Item = Option<Executor>> {
    let texts = ["single", "multi:2", "multi:3", "events"];
    texts
        .map(|text| Some(text.parse().expect("a text")))
        .into_iter()
}

/// Everything that may change what an executor plans.
fn upheaval() -> Vec<TimedCommand> {
    let mut timed = knobs();
    timed.extend([
        command(0.02, "rate camera 333"),
        command(0.04, "crash fusion"),
        command(0.05, "crash lidar"),
        command(0.06, "restart fusion"),
        command(0.07, "restart lidar"),
        command(0.09, "offset lidar 2"),
        command(0.1, "takes camera busy 1"),
        command(0.12, "depth /image 2"),
        command(0.13, "hang closest 9"),
    ]);
    timed
}

#[test]
fn a_run_with_an_executor_comes_back_to_the_bit() {
    for executor in executors() {
        until(executor, &upheaval(), Time::ZERO..Time::ZERO, |ticks| {
            ticks.iter().all(|ticks| ticks.len() > 1)
        });
    }
}

#[test]
fn an_executor_goes_on_under_the_other_clock() {
    let (from, to) = (secs(0.08), secs(0.14));
    let mut timed = upheaval();
    timed.push(hand_over(0.08, ClockKind::Virtual));
    timed.push(hand_over(0.14, ClockKind::Real));
    for executor in executors() {
        until(executor, &timed, from..to, |ticks| {
            let ticked = |range: Range<Time>| ticks[2].iter().any(|tick| range.contains(&tick.at));
            ticked(Time::ZERO..from) && ticked(from..to) && ticked(to..secs(0.2))
        });
    }
}

#[test]
fn the_threads_of_an_executor_are_as_many_as_it_says() {
    for (executor, most) in [("single", 1), ("events", 1), ("multi:2", 2)] {
        let mut robot = robot(Some(executor.parse().expect("a text")));
        let taps = TapHandle::of(&robot.graph).ticks(4096);
        let (_commander, mut inbox) = Inbox::new(
            [
                "takes camera 3",
                "takes detector 4",
                "takes lidar 5",
                "takes closest 2",
            ]
            .map(|text| command(0.0, text))
            .to_vec(),
        );
        let run = RealClock::default().run(&mut robot.graph, &mut inbox, secs(0.3));
        run.expect("no fault");
        let ticks: Vec<TickRecord> = taps
            .iter()
            .enumerate()
            .filter(|(node, _)| *node != 4)
            .flat_map(|(_, tap)| tap.items().try_iter())
            .collect();
        let at_once = |at: Time| {
            let holds = |tick: &&TickRecord| tick.at <= at && tick.ends.is_some_and(|end| at < end);
            ticks.iter().filter(holds).count()
        };
        let busiest = ticks.iter().map(|tick| at_once(tick.at)).max();
        assert_eq!(busiest, Some(most), "{executor}");
    }
}
