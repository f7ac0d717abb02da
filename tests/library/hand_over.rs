//! A graph contains all state of its run, so it can be handed over from clock to clock,
//! or run in pieces, and continues where it was.

use ratelab::{ClockExit, ClockKind, Command, Depth, GO_ON, Graph, Inbox, Time, Topic, run};
use ratelab_account::{Observer, TapHandle};
use ratelab_effects::{Callback, Effects, Executor, Executors, Match};
use ratelab_real_clock::RealClock;

use crate::support::{TickLog, applied, at, messages_of, metronome, refused, run_virtual, secs};

#[test]
fn a_graph_is_not_handed_to_the_clock_that_runs_it() {
    for kind in [ClockKind::Virtual, ClockKind::Real] {
        let (_, mut graph) = metronome();
        let (_, mut inbox) = Inbox::new(vec![at(0.0, Command::HandOver(kind))]);
        let real = &mut RealClock::default();
        let exit = run(&mut graph, &mut inbox, secs(0.02), kind, real).expect("run");
        assert_eq!(exit, ClockExit::Completed);
        assert_eq!(refused(&graph.state().events(0)).len(), 1);
    }
}

#[test]
fn a_graph_that_is_handed_over_and_back_continues_where_it_was() {
    let (log, mut graph) = (TickLog::default(), Graph::with(Effects));
    let rates = [("fast", 200.0), ("medium", 50.0), ("odd", 33.3)];
    let topic = Topic::new("/numbers", Depth::ONE);
    for (name, rate) in rates {
        let publisher = topic.publisher();
        log.node_that(&mut graph, name, rate, 0, move |now| {
            publisher.publish(name, now, None);
            GO_ON
        });
    }
    let tap = TapHandle::of(&graph).topic(&topic, 1_000);
    let timed = vec![
        at(0.5, Command::HandOver(ClockKind::Real)),
        at(0.6, Command::HandOver(ClockKind::Virtual)),
    ];
    let (_, mut inbox) = Inbox::new(timed);
    let real = &mut RealClock::default();
    let exit = run(&mut graph, &mut inbox, secs(2.0), ClockKind::Virtual, real);
    assert_eq!(exit.expect("run"), ClockExit::Completed);

    let hand_overs = applied(&graph.state().events(0));
    let (to_real, to_virtual) = (hand_overs[0].0, hand_overs[1].0);
    assert_eq!(to_real, secs(0.5));
    assert!(to_virtual >= secs(0.6));
    let snapshot = Observer::of(&graph).snapshot();
    for (name, rate) in rates {
        let node = snapshot.node(name).expect("node");
        let periods = (2.0 * rate + 1e-9).floor() as u64 + 1;
        assert_eq!(node.ticks + node.overruns, periods, "{name}");
        let times = log.of(name);
        assert_eq!(times.len() as u64, node.ticks, "{name}");
        assert!(times.is_sorted_by(|a, b| a < b), "{name}: {times:?}");
        // A due node may begin slightly after the command.
        let after = Time::from_nanos(to_virtual.as_nanos() + 10_000_000);
        let virtual_again = |time: &&Time| **time < to_real || **time > after;
        let grid: Vec<Time> = (0..periods).map(|tick| secs(tick as f64 / rate)).collect();
        for time in times.iter().filter(virtual_again) {
            let near = |due: &Time| due.since(*time).max(time.since(*due)) <= Time::RESOLUTION;
            assert!(grid.iter().any(near), "{name} left its grid at {time:?}");
        }
    }
    drop((log, graph));
    drop(topic);
    let seqs: Vec<u64> = messages_of(&tap)
        .iter()
        .map(|message| message.seq)
        .collect();
    assert_eq!(tap.lost(), 0);
    assert_eq!(seqs, Vec::from_iter(0..seqs.len() as u64));
}

#[test]
fn a_graph_continues_after_an_end_as_if_there_was_none() {
    let (log, mut graph) = metronome();
    for end in [0.25, 0.3, 1.0] {
        run_virtual(&mut graph, Vec::new(), secs(end));
    }
    let (whole, mut graph) = metronome();
    run_virtual(&mut graph, Vec::new(), secs(1.0));
    assert_eq!(log.all(), whole.all());
}

#[test]
fn messages_in_flight_at_a_hand_over_trigger_their_nodes() {
    for executor in [None, Some(Executor::Single)] {
        let (mut graph, far) = (Graph::with(Effects), Topic::new("/far", Depth::ONE));
        let (sender, ticks) = crossbeam_channel::unbounded();
        let reader = graph.node("reader", Match::Each, 0, |wiring| {
            let _ = wiring.trigger(&far);
            move |now| {
                sender.send(now)?;
                GO_ON
            }
        });
        reader.expect("a node");
        if let Some(executor) = executor {
            let reader = [Callback::of("reader")];
            graph.executor(executor, reader).expect("a node");
        }
        let link = "link /far delay:30".parse().expect("a knob");
        graph.turn(&link).expect("a topic");
        // As threads that are stopped: nobody hears of the arrival.
        let task_sets = graph.apart();
        far.publisher().publish(1, Time::ZERO, None);
        drop(task_sets);
        run_virtual(&mut graph, Vec::new(), secs(0.5));
        assert!(ticks.try_iter().eq([secs(0.03)]));
    }
}
