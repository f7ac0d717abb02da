//! Timing of the real clock: deadlines are absolute, missed periods are skipped and
//! counted, a command ends any wait at once, and no node waits for an observer.
//!
//! No test asserts a speed: on a busy machine these tests are slower but still correct.

use std::{
    sync::{Arc, Mutex, OnceLock},
    thread,
    time::Duration,
};

use crossbeam_channel::Sender;
use ratelab::{
    Clock, ClockExit, ClockKind, Command, Depth, END, GO_ON, Graph, Hz, Inbox, Rate, Time, Topic,
};
use ratelab_account::{Observer, TapHandle};
use ratelab_cart_pole::{POLICY, verdict};
use ratelab_real_clock::RealClock;
use ratelab_study::experiment::{Config, Summary};

use crate::support::{
    TickLog, applied, at, config, hz, knobs, run_timed, secs, set_depth, set_rate, ticks,
};

/// Runs the cart-pole under the real clock.
fn run_experiment(config: Config) -> Summary {
    crate::support::run(&Config {
        clock: ClockKind::Real,
        ..config
    })
}

fn run_real(graph: &mut Graph, until: Time) -> ClockExit {
    run_timed(&mut RealClock::default(), graph, Vec::new(), until)
}

/// Runs `graph` without an end while `person` observes it and gives commands.
fn run_watched(
    graph: &mut Graph,
    person: impl FnOnce(Sender<Command>, Observer) + Send,
) -> ClockExit {
    let (commander, mut inbox) = Inbox::new(Vec::new());
    let observer = Observer::of(graph);
    thread::scope(|scope| {
        scope.spawn(|| person(commander, observer));
        let exit = RealClock::default().run(graph, &mut inbox, Time::MAX);
        exit.expect("no fault")
    })
}

fn wait_until(mut happened: impl FnMut() -> bool) {
    while !happened() {
        thread::sleep(Duration::from_millis(1));
    }
}

/// The due times of `rate` from zero to `until`.
fn grid(rate: Hz, until: Time) -> Vec<Time> {
    let mut rate = Rate::new(rate, Time::ZERO);
    let mut grid = Vec::new();
    while rate.due() <= until {
        grid.push(rate.due());
        rate.advance();
    }
    grid
}

#[test]
fn the_pole_balances_and_every_period_is_accounted_for() {
    let end = secs(2.0);
    let summary = run_experiment(Config {
        end,
        ..Config::default()
    });
    assert_eq!(*summary.verdict.kind, verdict::BALANCED);
    assert_eq!(summary.sim_time, end);
    assert!(summary.steps > 80, "{} steps", summary.steps);
    assert_eq!(summary.steps, summary.nodes[2].ticks);
    for node in &summary.nodes {
        let periods = grid(node.hz, end).len() as u64;
        assert!(node.ticks + node.overruns >= periods, "{node:?}");
        assert_eq!(node.lateness.count(), node.ticks);
        assert_eq!(node.tick_time.count(), node.ticks);
    }
}

#[test]
fn the_pole_falls_when_control_is_slow() {
    let summary = run_experiment(config("control-hz 5"));
    assert_eq!(*summary.verdict.kind, verdict::POLE_FELL);
}

/// One tick of a slow node, as recorded by the node itself.
struct Start {
    /// Its ticks and overruns so far: its position in the sequence of due times.
    place: usize,
    began: Time,
}

#[test]
fn a_node_that_overruns_skips_the_periods_it_missed_and_counts_them() {
    const BUSY: Duration = Duration::from_millis(30);
    let until = secs(1.0);
    let mut graph = Graph::new();
    let observer = Arc::new(OnceLock::<Observer>::new());
    let starts = Arc::new(Mutex::new(Vec::new()));
    let (own_observer, own_starts) = (observer.clone(), starts.clone());
    let slow = move |began| {
        let snapshot = own_observer.get().expect("set").snapshot();
        let node = &snapshot.nodes[0];
        let place = (node.ticks - 1 + node.overruns) as usize;
        own_starts
            .lock()
            .expect("starts")
            .push(Start { place, began });
        thread::sleep(BUSY);
        GO_ON
    };
    graph.node("slow", hz(50.0), 0, |_| slow).expect("node");
    observer.set(Observer::of(&graph)).expect("once");
    assert_eq!(run_real(&mut graph, until), ClockExit::Completed);

    let node = &Observer::of(&graph).snapshot().nodes[0];
    assert!(node.overruns > 0);
    assert!(node.ticks + node.overruns >= grid(node.hz, until).len() as u64);
    let starts = starts.lock().expect("starts");
    let due = |start: &Start| Time::ZERO + Duration::from_millis(20) * start.place as u32;
    assert_eq!(starts.len() as u64, node.ticks);
    for start in starts.iter() {
        assert!(start.began >= due(start), "began before it was due");
    }
    for pair in starts.windows(2) {
        assert!(pair[1].place > pair[0].place, "two starts in one period");
        assert!(
            due(&pair[1]) >= pair[0].began + BUSY,
            "a missed period was made up for"
        );
    }
}

#[test]
fn a_stop_ends_a_long_wait_at_once() {
    let (log, mut graph) = (TickLog::default(), Graph::new());
    log.node(&mut graph, "patient", 0.001, 0);
    let exit = run_watched(&mut graph, |commander, observer| {
        wait_until(|| ticks(&observer) > 0);
        commander.send(Command::Stop).expect("running");
    });
    assert_eq!(exit, ClockExit::Stopped);
    assert_eq!(log.all().len(), 1);
}

#[test]
fn a_new_rate_reaches_a_node_that_waits_for_its_next_tick() {
    let (log, mut graph) = (TickLog::default(), Graph::new());
    let mut ticks_left = 5;
    log.node_that(&mut graph, "sleeper", 0.001, 0, move |_| {
        ticks_left -= 1;
        if ticks_left > 0 { GO_ON } else { END }
    });
    let exit = run_watched(&mut graph, |commander, observer| {
        wait_until(|| ticks(&observer) > 0);
        commander.send(set_rate("sleeper", 100.0)).expect("running");
    });
    assert!(matches!(exit, ClockExit::Ended { node, .. } if node == "sleeper"));
    let set = applied(&graph.state().events(0));
    assert_eq!(set[0].1, set_rate("sleeper", 100.0));
    let times = log.of("sleeper");
    assert!(times[1] >= set[0].0, "ticked before the rate was set");
}

#[test]
fn run_time_stands_still_while_paused() {
    let (log, mut graph) = (TickLog::default(), Graph::new());
    log.node(&mut graph, "a", 200.0, 0);
    log.node(&mut graph, "b", 333.0, 0);
    let topic = Topic::<()>::new("/unused", Depth::ONE);
    let c = graph.node("c", hz(0.001), 0, |wiring| {
        let _end = wiring.publisher(&topic);
        |_| GO_ON
    });
    c.expect("node");
    let exit = run_watched(&mut graph, |commander, observer| {
        let send = |command| commander.send(command).expect("running");
        let events = || observer.events(0).len();
        wait_until(|| ticks(&observer) > 10);
        send(Command::Pause);
        send(set_depth("/unused", 2));
        wait_until(|| events() == 2);
        let (now, done) = (observer.now(), ticks(&observer));
        thread::sleep(Duration::from_millis(50));
        assert_eq!((observer.now(), ticks(&observer)), (now, done));
        send(set_depth("/unused", 3));
        send(Command::Resume);
        wait_until(|| ticks(&observer) > done + 10);
        send(Command::Stop);
    });
    assert_eq!(exit, ClockExit::Stopped);
    let times: Vec<Time> = applied(&graph.state().events(0))
        .iter()
        .map(|a| a.0)
        .collect();
    let [paused, first, second, resumed, stopped] = times[..] else {
        panic!("{times:?}");
    };
    // Everything received during the pause has the same run time.
    assert!(paused <= first);
    assert_eq!((first, second), (second, resumed));
    assert!(resumed < stopped);
    for node in ["a", "b"] {
        assert!(log.of(node).is_sorted_by(|a, b| a < b));
    }
}

#[test]
fn run_time_never_goes_back_through_pauses() {
    let (log, mut graph) = (TickLog::default(), Graph::new());
    for name in ["a", "b", "c"] {
        log.node(&mut graph, name, 2_000.0, 0);
    }
    run_watched(&mut graph, |commander, observer| {
        let mut now = Time::ZERO;
        for round in 0..100 {
            let command = if round % 2 == 0 {
                Command::Pause
            } else {
                Command::Resume
            };
            commander.send(command).expect("running");
            wait_until(|| {
                let later = observer.now();
                assert!(later >= now, "from {now:?} to {later:?}");
                now = later;
                observer.events(0).len() > round
            });
        }
        commander.send(Command::Stop).expect("running");
    });
    let events = graph.state().events(0);
    assert!(events.is_sorted_by_key(|event| event.at), "{events:?}");
}

#[test]
fn timed_knobs_take_effect_under_the_real_clock() {
    let summary = run_experiment(Config {
        end: secs(0.3),
        knobs: knobs("0.1 control-hz 25"),
        ..Config::default()
    });
    let [(when, command)] = &applied(&summary.events)[..] else {
        panic!("{:?}", summary.events);
    };
    assert_eq!(*command, set_rate(POLICY, 25.0));
    assert!(*when >= secs(0.1));
    assert_eq!(summary.nodes[1].hz, hz(25.0));
}

#[test]
fn a_timed_stop_ends_the_run() {
    let (_, mut graph) = (TickLog::default(), Graph::new());
    let stop = vec![at(0.05, Command::Stop)];
    let exit = run_timed(&mut RealClock::default(), &mut graph, stop, Time::MAX);
    assert_eq!(exit, ClockExit::Stopped);
    assert!(graph.now() >= secs(0.05));
}

#[test]
fn a_full_tap_loses_and_counts_and_blocks_no_node() {
    const MESSAGES: u64 = 50;
    let topic = Topic::new("/busy", Depth::ONE);
    let mut graph = Graph::new();
    let node = graph.node("talker", hz(1_000.0), 0, |wiring| {
        let publisher = wiring.publisher(&topic);
        let mut said = 0;
        move |now| {
            publisher.publish((), now, None);
            said += 1;
            if said < MESSAGES { GO_ON } else { END }
        }
    });
    node.expect("node");
    let tap = TapHandle::of(&graph).topic(&topic, 4);
    let exit = run_real(&mut graph, Time::MAX);
    assert!(matches!(exit, ClockExit::Ended { .. }));
    assert_eq!((topic.published(), tap.lost()), (MESSAGES, MESSAGES - 4));
    let kept: Vec<u64> = tap
        .items()
        .try_iter()
        .map(|tapped| tapped.message.seq)
        .collect();
    assert_eq!(kept, [0, 1, 2, 3]);
}

#[test]
fn a_slow_node_on_its_own_thread_delays_no_other() {
    let (log, mut graph) = (TickLog::default(), Graph::new());
    let (report, reports) = crossbeam_channel::bounded(1);
    log.node_that(&mut graph, "waits", 100.0, 0, move |_| {
        // Returns only after ten ticks of the other node.
        reports.recv()?;
        END
    });
    let mut ticks = 0;
    log.node_that(&mut graph, "works", 100.0, 0, move |_| {
        ticks += 1;
        if ticks == 10 {
            report.send(())?;
        }
        GO_ON
    });
    let exit = run_real(&mut graph, Time::MAX);
    assert!(matches!(exit, ClockExit::Ended { node, .. } if node == "waits"));
    assert_eq!(log.of("waits").len(), 1);
}

#[test]
fn a_pause_stops_the_schedule_of_a_node_that_is_busy() {
    let mut graph = Graph::new();
    graph
        .node("busy", hz(50.0), 0, |_| {
            |_| {
                thread::sleep(Duration::from_millis(500));
                GO_ON
            }
        })
        .expect("node");
    // The pause comes during the first tick, and nothing ends it.
    let pause = ratelab::TimedCommand {
        at: secs(0.05),
        command: Command::Pause,
    };
    let exit = run_timed(
        &mut RealClock::default(),
        &mut graph,
        vec![pause],
        Time::MAX,
    );
    assert_eq!(exit, ClockExit::Stopped);
    let node = Observer::of(&graph).snapshot().nodes.remove(0);
    let periods = grid(hz(50.0), graph.now()).len() as u64;
    assert_eq!(node.ticks, 1);
    assert!(
        node.ticks + node.overruns <= periods,
        "{} overruns",
        node.overruns
    );
}
