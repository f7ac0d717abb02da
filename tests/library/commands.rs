//! Commands are the only input of a running graph: they take effect between instants, in
//! the given order, and are logged with their run time.

use std::thread;

use crossbeam_channel::Sender;
use ratelab::{
    Clock, ClockExit, Command, Depth, END, Event, EventKind, GO_ON, Graph, Inbox, Speed, Time,
    Topic, VirtualClock,
};
use ratelab_account::Observer;
use ratelab_effects::Effects;
use ratelab_real_clock::RealClock;

use crate::support::{
    TickLog, applied, at, metronome, refused, run_timed, run_virtual, secs, set_depth, set_rate,
    talker,
};

fn seconds(times: &[Time]) -> Vec<f64> {
    times.iter().map(|time| time.as_secs_f64()).collect()
}

/// Three nodes at 10 Hz in the order a, b, c, the first of which gives
/// `commands` during its first tick.
fn trio(commander: Sender<Command>, commands: Vec<Command>) -> (TickLog, Graph) {
    let (log, mut graph) = (TickLog::default(), Graph::with(Effects));
    let mut commands = commands.into_iter();
    log.node_that(&mut graph, "a", 10.0, 0, move |_| {
        for command in commands.by_ref() {
            commander.send(command)?;
        }
        GO_ON
    });
    log.node(&mut graph, "b", 10.0, 1);
    log.node(&mut graph, "c", 10.0, 2);
    (log, graph)
}

#[test]
fn a_timed_rate_takes_effect_before_the_tick_that_is_due_then() {
    let (log, mut graph) = metronome();
    let slower = at(0.3, set_rate("a", 4.0));
    run_virtual(&mut graph, vec![slower], secs(0.75));
    assert_eq!(seconds(&log.of("a")), [0.0, 0.1, 0.2, 0.45, 0.7]);
}

#[test]
fn a_timed_depth_takes_effect_before_the_message_that_is_published_then() {
    let (topic, mut graph) = (Topic::new("/count", Depth::ONE), Graph::with(Effects));
    talker(&mut graph, "source", 10.0, 0, &topic, |_| Some(()));
    let subscription = topic.subscribe();
    // Published at 0, 0.1 … 0.5; the message at 0.3 finds room already.
    let deeper = at(0.3, set_depth("/count", 100));
    run_virtual(&mut graph, vec![deeper], secs(0.5));
    assert_eq!((topic.published(), subscription.dropped()), (6, 2));
}

#[test]
fn timed_commands_of_one_time_take_effect_in_the_order_given() {
    let (log, mut graph) = metronome();
    let timed = [2.0, 1.0, 5.0].map(|rate| at(0.0, set_rate("a", rate)));
    run_virtual(&mut graph, timed.to_vec(), secs(0.5));
    assert_eq!(seconds(&log.of("a")), [0.0, 0.2, 0.4]);
    let rates = applied(&graph.state().events(0));
    assert_eq!(rates, timed.map(|t| (t.at, t.command)).to_vec());
}

#[test]
fn a_timed_command_takes_effect_at_the_end_but_not_after_it() {
    let (_, mut graph) = metronome();
    let timed = [0.5, 0.6].map(|time| at(time, set_rate("a", 5.0)));
    assert_eq!(
        run_virtual(&mut graph, timed.to_vec(), secs(0.5)),
        ClockExit::Completed
    );
    let applied = applied(&graph.state().events(0));
    assert_eq!(applied, [(secs(0.5), set_rate("a", 5.0))]);
}

#[test]
fn a_stop_ends_the_run_before_the_ticks_due_then() {
    let (log, mut graph) = metronome();
    let exit = run_virtual(&mut graph, vec![at(0.3, Command::Stop)], Time::MAX);
    assert_eq!(exit, ClockExit::Stopped);
    assert_eq!(graph.now(), secs(0.3));
    assert_eq!(seconds(&log.of("a")), [0.0, 0.1, 0.2]);
}

#[test]
fn a_command_from_within_an_instant_takes_effect_after_the_whole_of_it() {
    // Also where a single step had it begin.
    for first in [None, Some(Command::Step)] {
        let (commander, mut inbox) = Inbox::new(Vec::new());
        first
            .iter()
            .for_each(|step| commander.send(step.clone()).expect("open"));
        let (log, mut graph) = trio(commander, vec![set_rate("b", 5.0), Command::Stop]);
        let exit = VirtualClock.run(&mut graph, &mut inbox, secs(1.0));
        assert_eq!(exit.expect("run"), ClockExit::Stopped);
        assert_eq!(log.all(), ["a", "b", "c"].map(|node| (node, Time::ZERO)));
        let after = Time::ZERO + Time::RESOLUTION;
        let expected = [(after, set_rate("b", 5.0)), (after, Command::Stop)];
        let applied = applied(&graph.state().events(0));
        assert_eq!(applied[usize::from(first.is_some())..], expected);
    }
}

#[test]
fn a_command_that_arrives_after_the_last_instant_comes_too_late() {
    for too_late in [Command::Stop, Command::Pause, set_rate("a", 1.0)] {
        let (commander, mut inbox) = Inbox::new(Vec::new());
        let (_, mut graph) = trio(commander, vec![too_late]);
        let exit = VirtualClock
            .run(&mut graph, &mut inbox, Time::ZERO)
            .expect("run");
        assert_eq!((exit, graph.now()), (ClockExit::Completed, Time::ZERO));
        assert_eq!(graph.state().events(0), []);
    }
}

#[test]
fn a_pause_without_senders_ends_the_run() {
    for clock in [
        &mut VirtualClock as &mut dyn Clock,
        &mut RealClock::default(),
    ] {
        let (_, mut graph) = metronome();
        let (_, mut inbox) = Inbox::new(vec![at(0.05, Command::Pause)]);
        let exit = clock.run(&mut graph, &mut inbox, Time::MAX).expect("run");
        assert_eq!(exit, ClockExit::Stopped);
        assert!(graph.now() >= secs(0.05));
    }
}

#[test]
fn commands_for_unknown_nodes_and_topics_are_refused_by_name() {
    for clock in [
        &mut VirtualClock as &mut dyn Clock,
        &mut RealClock::default(),
    ] {
        let (_, mut graph) = metronome();
        let timed = vec![
            at(0.0, set_rate("nobody", 1.0)),
            at(0.0, set_depth("/none", 1)),
        ];
        let (_, mut inbox) = Inbox::new(timed);
        let exit = clock.run(&mut graph, &mut inbox, secs(0.02)).expect("run");
        assert_eq!(exit, ClockExit::Completed);
        let refused = refused(&graph.state().events(0));
        let reasons: Vec<&str> = refused.iter().map(|(_, reason)| reason.as_str()).collect();
        assert_eq!(
            reasons,
            [
                "there is no node \"nobody\": expected one of a",
                "there is no topic \"/none\": the graph has none"
            ]
        );
    }
}

#[test]
fn the_real_clock_refuses_commands_for_virtual_time() {
    let (_, mut graph) = metronome();
    let only_virtual = [Command::Speed(Speed::Unlimited), Command::Step];
    let timed = only_virtual
        .clone()
        .map(|command| at(0.0, command))
        .to_vec();
    run_timed(&mut RealClock::default(), &mut graph, timed, secs(0.02));
    let refused = refused(&graph.state().events(0));
    let commands: Vec<Command> = refused.iter().map(|(command, _)| command.clone()).collect();
    assert_eq!(commands, only_virtual);
    assert!(
        refused
            .iter()
            .all(|(_, reason)| reason.contains("virtual clock"))
    );
}

#[test]
fn an_empty_graph_completes() {
    let exit = run_virtual(&mut Graph::with(Effects), Vec::new(), Time::MAX);
    assert_eq!(exit, ClockExit::Completed);
    let (real, mut graph) = (&mut RealClock::default(), Graph::with(Effects));
    let exit = run_timed(real, &mut graph, Vec::new(), secs(0.01));
    assert_eq!(exit, ClockExit::Completed);
}

#[test]
fn a_node_that_ends_the_run_is_named_with_the_time() {
    let (log, mut graph) = metronome();
    log.node_that(&mut graph, "judge", 10.0, 1, |now| {
        if now < secs(0.2) { GO_ON } else { END }
    });
    let (node, at) = ("judge".to_owned(), secs(0.2));
    let exit = run_virtual(&mut graph, Vec::new(), Time::MAX);
    assert_eq!(
        exit,
        ClockExit::Ended {
            node: node.clone(),
            at
        }
    );
    let what = EventKind::Ended { node };
    assert_eq!(graph.state().events(0), [Event { at, what }]);
}

#[test]
fn a_paused_run_stands_still_until_it_is_resumed() {
    let (log, mut graph) = metronome();
    let (commander, mut inbox) = Inbox::new(vec![at(0.0, Command::Pause)]);
    let observer = Observer::of(&graph);
    thread::scope(|scope| {
        let paused = log.clone();
        scope.spawn(move || {
            while !observer.snapshot().status.paused {
                thread::yield_now();
            }
            assert_eq!((paused.all().len(), observer.now()), (0, Time::ZERO));
            commander.send(Command::Resume).expect("paused");
        });
        let exit = VirtualClock.run(&mut graph, &mut inbox, secs(1.0));
        exit.expect("run");
    });
    assert_eq!(log.all().len(), 11);
}
