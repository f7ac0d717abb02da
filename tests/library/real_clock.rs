//! Timing of the real clock: deadlines are absolute, missed periods are skipped and
//! counted, a command ends any wait at once, and no node waits for an observer.
//!
//! No test asserts a speed: on a busy machine these tests are slower but still correct.

use std::thread;

use crossbeam_channel::Sender;

use crate::support::*;

fn run_real(graph: &mut Graph, commands: &str, until: Time) -> ClockExit {
    run_timed(&mut RealClock::default(), graph, commands, until)
}

/// Runs `graph` without an end while `person` observes it and gives commands.
fn run_watched(
    graph: &mut Graph,
    person: impl FnOnce(Sender<Command>, Observer) + Send,
) -> ClockExit {
    let (commander, mut inbox) = Inbox::new(Vec::new());
    let observer = Observer::new(graph);
    thread::scope(|scope| {
        scope.spawn(|| person(commander, observer));
        let real = &mut RealClock::default();
        real.run(graph, &mut inbox, Time::MAX).expect("no fault")
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
    let summary = run(&config("real; until 1"));
    check("1 s", &summary, "verdict balanced; end 1");
    assert!(summary.steps > 40, "{} steps", summary.steps);
    assert_eq!(summary.steps, summary.nodes[2].ticks);
    for node in &summary.nodes {
        let periods = grid(node.hz, secs(1.0)).len() as u64;
        assert!(node.ticks + node.overruns >= periods, "{node:?}");
        assert_eq!(node.lateness.count(), node.ticks);
        assert_eq!(node.tick_time.count(), node.ticks);
    }
}

#[test]
fn a_node_that_overruns_skips_the_periods_it_missed_and_counts_them() {
    const BUSY: Duration = Duration::from_millis(30);
    let (mut graph, until) = (Graph::new(), secs(0.5));
    worker(&mut graph, "slow", 50.0, 0, |_: &mut Tick| {
        thread::sleep(BUSY);
    });
    let taps = TapHandle::new(&graph).ticks(ROOM);
    assert_eq!(run_real(&mut graph, "", until), ClockExit::Completed);
    let (node, ticks) = (&snapshot(&graph).nodes[0], taps[0].items().try_iter());
    let (grid, ticks) = (grid(node.hz, until), ticks.collect::<Vec<_>>());
    assert!(node.overruns > 0);
    assert!(node.ticks + node.overruns >= grid.len() as u64);
    assert_eq!(ticks.len() as u64, node.ticks);
    for pair in ticks.windows(2) {
        let due = pair[1].due();
        assert!(grid.contains(&due), "{due} is not when it was due");
        assert!(due >= pair[0].at + BUSY, "a missed period was made up for");
    }
}

#[test]
fn a_new_rate_reaches_a_node_that_waits_for_its_next_tick() {
    let (log, mut graph) = (TickLog::default(), Graph::new());
    let mut ticks_left = 5;
    log.node_that(&mut graph, "sleeper", 0.001, 0, move |_: &mut Tick| {
        ticks_left -= 1;
        if ticks_left > 0 {
            Flow::Continue
        } else {
            Flow::End
        }
    });
    let exit = run_watched(&mut graph, |commander, observer| {
        wait_until(|| ticks(&observer) > 0);
        commander
            .send(command("rate sleeper 100"))
            .expect("running");
    });
    assert!(matches!(exit, ClockExit::Ended { node, .. } if node == "sleeper"));
    let set = applied(&graph.state().events(0));
    assert_eq!(set[0].1, command("rate sleeper 100"));
    let times = log.ticks("sleeper");
    assert!(times[1] >= set[0].0, "ticked before the rate was set");
}

#[test]
fn run_time_stands_still_while_paused() {
    let (log, mut graph) = (TickLog::default(), Graph::new());
    log.node(&mut graph, "a", 200.0, 0);
    log.node(&mut graph, "b", 333.0, 0);
    let topic = Topic::<()>::new("/unused", Depth::ONE);
    talker(&mut graph, "c", 0.001, 0, &topic, |_| None);
    let exit = run_watched(&mut graph, |commander, observer| {
        let send = |text| commander.send(command(text)).expect("running");
        let events = || observer.events(0).len();
        wait_until(|| ticks(&observer) > 10);
        send("pause");
        send("depth /unused 2");
        wait_until(|| events() == 2);
        let (now, done) = (observer.now(), ticks(&observer));
        thread::sleep(ms(50));
        assert_eq!((observer.now(), ticks(&observer)), (now, done));
        send("depth /unused 3");
        send("resume");
        wait_until(|| ticks(&observer) > done + 10);
        send("stop");
    });
    assert_eq!(exit, ClockExit::Stopped);
    let applied = applied(&graph.state().events(0));
    let times: Vec<Time> = applied.iter().map(|(at, _)| *at).collect();
    let [paused, first, second, resumed, stopped] = times[..] else {
        panic!("{times:?}");
    };
    // Everything received during the pause has the same run time.
    assert!(paused <= first);
    assert_eq!((first, second), (second, resumed));
    assert!(resumed < stopped);
    for node in ["a", "b"] {
        assert!(log.ticks(node).is_sorted_by(|a, b| a < b));
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
            let text = ["pause", "resume"][round % 2];
            commander.send(command(text)).expect("running");
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
fn a_full_tap_loses_and_counts_and_blocks_no_node() {
    let (mut graph, topic) = (Graph::new(), Topic::new("/busy", Depth::ONE));
    let mut left = 50;
    talker(&mut graph, "talker", 1_000.0, 0, &topic, move |_| {
        left -= 1;
        (left >= 0).then_some(())
    });
    let (taps, all) = (TapHandle::new(&graph), topic.clone());
    let tap = taps.topic(&topic, 4);
    // One that nobody holds any more.
    drop(taps.topic(&topic, 1));
    let exit = run_watched(&mut graph, |commander, _| {
        wait_until(|| all.published() == 50);
        commander.send(Command::Stop).expect("running");
    });
    assert_eq!(exit, ClockExit::Stopped);
    assert_eq!((topic.published(), tap.lost()), (50, 46));
    assert_eq!(seqs(&tap), [0, 1, 2, 3]);
}

#[test]
fn a_slow_node_on_its_own_thread_delays_no_other() {
    let (log, mut graph) = (TickLog::default(), Graph::new());
    let (report, reports) = crossbeam_channel::bounded(1);
    log.node_that(&mut graph, "waits", 100.0, 0, move |_: &mut Tick| {
        // Returns only after ten ticks of the other node.
        reports.recv()?;
        Ok(Flow::End)
    });
    let mut ticks = 0;
    log.node_that(&mut graph, "works", 100.0, 0, move |_: &mut Tick| {
        ticks += 1;
        if ticks == 10 {
            report.send(())?;
        }
        Ok(Flow::Continue)
    });
    let exit = run_real(&mut graph, "", Time::MAX);
    assert!(matches!(exit, ClockExit::Ended { node, .. } if node == "waits"));
    assert_eq!(log.ticks("waits").len(), 1);
}

#[test]
fn a_pause_stops_the_schedule_of_a_node_that_is_busy() {
    let mut graph = Graph::new();
    worker(&mut graph, "busy", 50.0, 0, |_: &mut Tick| {
        thread::sleep(ms(300));
    });
    // The pause comes during the first tick, and nothing ends it.
    let exit = run_real(&mut graph, "0.05 pause", Time::MAX);
    assert_eq!(exit, ClockExit::Stopped);
    let node = &snapshot(&graph).nodes[0];
    let periods = grid(hz(50.0), graph.now()).len() as u64;
    assert_eq!(node.ticks, 1);
    let overruns = node.overruns;
    assert!(node.ticks + overruns <= periods, "{overruns} overruns");
}

/// Niceness and scheduling policy of the calling thread, by the kernel.
#[cfg(target_os = "linux")]
fn scheduling() -> (i32, u32) {
    let stat = std::fs::read_to_string("/proc/thread-self/stat").expect("Linux");
    let (_, after) = stat.rsplit_once(") ").expect("a name");
    let fields: Vec<&str> = after.split(' ').collect();
    // Fields 19 and 41 of proc(5), whose first two are before.
    let nice = fields[16].parse().expect("a number");
    (nice, fields[38].parse().expect("a number"))
}

#[cfg(target_os = "linux")]
#[test]
fn a_low_priority_is_that_of_an_ordinary_thread_with_a_small_share() {
    const ORDINARY: u32 = 0;
    let lowered = std::thread::spawn(|| {
        ratelab_real_clock::lower_priority();
        scheduling()
    });
    let (nice, policy) = lowered.join().expect("a thread");
    assert_eq!(policy, ORDINARY);
    assert!((5..=15).contains(&nice), "{nice}");
}
