//! Triggers and executors under the real clock: what comes of a run is the same when it is
//! executed again, also with stretches of virtual time in it.

use std::{ops::Range, time::Duration};

use ratelab::{Clock, ClockKind, Command, GO_ON, Graph, Inbox, Time, TimedCommand, Topic};
use ratelab_account::{Observer, TapHandle, TickRecord};
use ratelab_effects::{Callback, Effects, Executor, Executors, Match};
use ratelab_real_clock::RealClock;
use ratelab_replay::RunLog;

use crate::support::{self, depth, knob, rerun_of, secs, talker};

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

/// Its nodes but for the controller are those of `executor`, if there is one.
fn robot(executor: Option<Executor>) -> Robot {
    let mut graph = Graph::with(Effects);
    let names = [
        "/image", "/scan", "/objects", "/fused", "/command", "/closest",
    ];
    let [image, scan, objects, fused, command, close] =
        names.map(|name| Topic::new(name, depth(4)));
    for (name, rate, topic) in [("camera", 200.0, &image), ("lidar", 100.0, &scan)] {
        talker(&mut graph, name, rate, 0, topic, |now| {
            Some(now.as_nanos() % 7)
        });
    }
    adder(&mut graph, "detector", Match::Each, &[&image], &objects);
    adder(
        &mut graph,
        "fusion",
        Match::Each,
        &[&objects, &scan],
        &fused,
    );
    let added = graph.node("control", 100.0, 0, |wiring| {
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
    adder(&mut graph, "closest", closest, &[&image, &scan], &close);
    if let Some(executor) = executor {
        let [camera, lidar, detector, fusion, closest] =
            ["camera", "lidar", "detector", "fusion", "closest"].map(Callback::of);
        let group = [fusion, closest].map(|callback| callback.in_group("slow"));
        let nodes = [camera, lidar.in_reentrant_group(), detector];
        let nodes = nodes.into_iter().chain(group);
        graph.executor(executor, nodes).expect("nodes");
    }
    Robot {
        graph,
        fused,
        command,
    }
}

/// All that comes of a run: the ticks of each node, the messages of two topics, and the drops.
type Outcome = (Vec<Vec<TickRecord>>, [Vec<(u64, u64, Time)>; 2], Vec<u64>);

/// Timed commands, one a line: seconds and a knob, or a clock to go on under.
fn commands(list: &str) -> Vec<TimedCommand> {
    let lines = list.lines().map(|line| {
        let (seconds, text) = line.trim().split_once(' ').expect("a command");
        let command = match text {
            "real" => Command::HandOver(ClockKind::Real),
            "virtual" => Command::HandOver(ClockKind::Virtual),
            text => knob(text).into(),
        };
        support::at(seconds.parse().expect("seconds"), command)
    });
    lines.collect()
}

/// Runs a robot for 0.2 s, first under `real`, then as it hands itself over.
fn run(
    real: &mut dyn Clock,
    executor: Option<Executor>,
    timed: Vec<TimedCommand>,
) -> (Observer, Outcome) {
    let Robot {
        mut graph,
        fused,
        command,
    } = robot(executor);
    RunLog::of(&graph.state());
    let taps = TapHandle::of(&graph);
    let (ticks, messages) = (
        taps.ticks(4096),
        [fused, command].map(|topic| taps.topic(&topic, 4096)),
    );
    let (_commander, mut inbox) = Inbox::new(timed);
    let exit = ratelab::run(&mut graph, &mut inbox, secs(0.2), ClockKind::Real, real);
    exit.expect("no fault");
    let ticks = ticks.iter().map(|tap| tap.items().try_iter().collect());
    let messages = messages.each_ref().map(|tap| {
        let items = tap.items().try_iter();
        items
            .map(|item| (item.message.data, item.message.seq, item.head.at))
            .collect()
    });
    let observer = Observer::of(&graph);
    let topics = observer.snapshot().topics;
    let dropped = topics.iter().map(|topic| topic.dropped()).collect();
    (observer, (ticks.collect(), messages, dropped))
}

/// What the clock of the wall took: under the virtual clock that is not the run's.
fn without_took(mut outcome: Outcome, virtual_time: &Range<Time>) -> Outcome {
    for tick in outcome.0.iter_mut().flatten() {
        tick.took = tick.took.filter(|_| !virtual_time.contains(&tick.at));
    }
    outcome
}

const KNOBS: &str =
    "0 takes detector 2\n0 takes control 3\n0 link /scan delay:4\n0.03 takes detector 12";

/// From the real clock to the virtual one, and back.
const HAND_OVERS: &str = "\n0.08 virtual\n0.14 real";

/// Runs and executes again, until a run was on time enough for what `shows` looks for.
fn until(
    executor: Option<Executor>,
    list: &str,
    virtual_time: Range<Time>,
    shows: impl Fn(&[Vec<TickRecord>]) -> bool,
) {
    let timed = commands(list);
    let under_virtual =
        |timed: &&TimedCommand| virtual_time.start < timed.at && timed.at <= virtual_time.end;
    // Given again: what the log of the threads does not have.
    let given: Vec<_> = timed.iter().filter(under_virtual).cloned().collect();
    for _ in 0..20 {
        let (observer, recorded) = run(&mut RealClock::default(), executor, timed.clone());
        let shown = shows(&recorded.0);
        let recorded = without_took(recorded, &virtual_time);
        for perturbed in [false, true] {
            let mut rerun = rerun_of(&observer);
            if perturbed {
                rerun.perturb();
            }
            let (again, outcome) = run(&mut rerun, executor, given.clone());
            assert_eq!(rerun.difference(), None);
            assert_eq!(without_took(outcome, &virtual_time), recorded);
            assert_eq!(again.events(0), observer.events(0));
            let logs = [&again, &observer].map(|observer| RunLog::of(observer).log());
            assert_eq!(logs[0], logs[1], "its log is another one");
        }
        if shown {
            return;
        }
    }
    panic!("no run was on time");
}

#[test]
fn a_run_with_triggers_comes_back_to_the_bit() {
    until(None, KNOBS, Time::ZERO..Time::ZERO, |ticks| {
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

const EXECUTORS: [&str; 4] = ["single", "multi:2", "multi:3", "events"];

/// Everything that may change what an executor plans.
const UPHEAVAL: &str = "\
    0.02 rate camera 333\n0.04 crash fusion\n0.05 crash lidar\n0.06 restart fusion
    0.07 restart lidar\n0.09 offset lidar 2\n0.1 takes camera busy 1\n0.12 depth /image 2
    0.13 hang closest 9\n";

#[test]
fn a_run_with_an_executor_comes_back_to_the_bit() {
    for executor in EXECUTORS {
        let executor = Some(executor.parse().expect(executor));
        until(
            executor,
            &format!("{UPHEAVAL}{KNOBS}"),
            Time::ZERO..Time::ZERO,
            |ticks| ticks.iter().all(|ticks| ticks.len() > 1),
        );
    }
}

#[test]
fn triggers_and_executors_go_on_under_the_other_clock() {
    let (from, to) = (secs(0.08), secs(0.14));
    let goes_on = |executor, list: &str, node: usize| {
        until(
            executor,
            &format!("{list}{KNOBS}{HAND_OVERS}"),
            from..to,
            |ticks| {
                let ticked =
                    |range: Range<Time>| ticks[node].iter().any(|tick| range.contains(&tick.at));
                ticked(Time::ZERO..from) && ticked(from..to) && ticked(to..secs(0.2))
            },
        );
    };
    goes_on(None, "", 3);
    for executor in EXECUTORS {
        goes_on(Some(executor.parse().expect(executor)), UPHEAVAL, 2);
    }
}

#[test]
fn the_threads_of_an_executor_are_as_many_as_it_says() {
    for (executor, most) in [("single", 1), ("events", 1), ("multi:2", 2)] {
        let mut robot = robot(Some(executor.parse().expect("a text")));
        let taps = TapHandle::of(&robot.graph).ticks(4096);
        let costs = "0 takes camera 3\n0 takes detector 4\n0 takes lidar 5\n0 takes closest 2";
        let (_commander, mut inbox) = Inbox::new(commands(costs));
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
