//! A graph contains all state of its run, so it can be handed over from clock to clock,
//! or run in pieces, and continues where it was.

use crossbeam_channel::Sender;

use crate::support::*;

#[test]
fn a_graph_that_is_handed_over_and_back_continues_where_it_was() {
    let mut graph = Graph::new();
    let rates = [("fast", 200.0), ("medium", 50.0), ("odd", 33.3)];
    let topic = Topic::new("/numbers", Depth::ONE);
    for (name, rate) in rates {
        talker(&mut graph, name, rate, 0, &topic, move |now| {
            Some((name, now))
        });
    }
    let tap = TapHandle::new(&graph).topic(&topic, 1_000);
    let (_, mut inbox) = Inbox::new(timed("0.5 real; 0.6 virtual"));
    let (virtual_first, real) = (ClockKind::Virtual, &mut RealClock::default());
    let exit = ratelab::run(&mut graph, &mut inbox, secs(2.0), virtual_first, real);
    assert_eq!(exit.expect("run"), ClockExit::Completed);

    let hand_overs = applied(&graph.state().events(0));
    let (to_real, to_virtual) = (hand_overs[0].0, hand_overs[1].0);
    assert_eq!(to_real, secs(0.5));
    assert!(to_virtual >= secs(0.6));
    let (snapshot, messages) = (snapshot(&graph), tapped(&tap));
    for (name, rate) in rates {
        let node = snapshot.node(name).expect("node");
        let periods = (2.0 * rate + 1e-9).floor() as u64 + 1;
        assert_eq!(node.ticks + node.overruns, periods, "{name}");
        let its = messages.iter().filter(|message| message.data.0 == name);
        let times: Vec<Time> = its.map(|message| message.data.1).collect();
        assert_eq!(times.len() as u64, node.ticks, "{name}");
        assert!(times.is_sorted_by(|a, b| a < b), "{name}: {times:?}");
        // A due node may begin slightly after the command.
        let after = to_virtual + ms(10);
        let virtual_again = |time: &&Time| **time < to_real || **time > after;
        let grid: Vec<Time> = (0..periods).map(|tick| secs(tick as f64 / rate)).collect();
        for time in times.iter().filter(virtual_again) {
            let near = |due: &Time| due.since(*time).max(time.since(*due)) <= Time::RESOLUTION;
            assert!(grid.iter().any(near), "{name} left its grid at {time:?}");
        }
    }
    let seqs = messages.iter().map(|message| message.seq);
    assert!(seqs.eq(0..topic.published()));
    assert!(tap.lost() == 0 && messages.len() > 500);
}

#[test]
fn a_graph_continues_after_an_end_as_if_there_was_none() {
    let [pieces, whole] = [&[0.25, 0.3, 1.0][..], &[1.0]].map(|ends| {
        let (log, mut graph) = metronome();
        for end in ends {
            run_virtual(&mut graph, "", secs(*end));
        }
        log.all()
    });
    assert_eq!(pieces, whole);
    assert_eq!(whole.len(), 11);
}

#[test]
fn messages_in_flight_at_a_hand_over_trigger_their_nodes() {
    for executor in [None, Some("single".parse().expect("an executor"))] {
        let (mut graph, far) = (Graph::new(), Topic::new("/far", Depth::ONE));
        let ticks = triggered(&mut graph, "reader", 0, &far);
        if let Some(executor) = executor {
            let reader = [Callback::new("reader")];
            graph.executor(executor, reader).expect("a node");
        }
        graph.set(&knob("link /far delay:30")).expect("a topic");
        // As threads that are stopped: nobody hears of the arrival.
        let task_sets = graph.apart();
        Tick::at(Time::ZERO).publish(&far.publisher(), 1);
        drop(task_sets);
        run_virtual(&mut graph, "", secs(0.5));
        assert!(ticks.try_iter().eq([secs(0.03)]));
    }
}

/// The moment at which node `b` is slowed down.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Slowed {
    Never,
    /// Before any late node has ticked.
    First,
    /// While the first of them ticks.
    Amid,
}

/// A graph as the real clock may hand it over: run time is past the due times of `a` and `b`, and
/// at that of `c`.
fn late(slowed: Slowed, commander: Sender<Command>) -> (Graph, TickLog) {
    let slower = command("rate b 7");
    if slowed == Slowed::First {
        commander.send(slower.clone()).expect("open");
    }
    let mut amid = (slowed == Slowed::Amid).then_some(slower);
    let (mut graph, log) = (Graph::new(), TickLog::default());
    for (name, rate) in [("a", 100.0), ("b", 50.0), ("c", 40.0)] {
        let (commander, mut amid) = (commander.clone(), amid.take());
        log.node_that(&mut graph, name, rate, 0, move |tick: &mut Tick| {
            let now = tick.now();
            if let Some(slower) = amid.take_if(|_| now > Time::ZERO) {
                commander.send(slower)?;
            }
            Ok(Flow::Continue)
        });
    }
    let (task_sets, supervision) = graph.apart();
    for (_, worker) in task_sets
        .groups()
        .iter_mut()
        .flat_map(|group| &mut group.workers)
    {
        worker.find(Time::ZERO, None);
        worker.begin(Time::ZERO);
        assert!(worker.done(Time::ZERO, Time::ZERO).is_none());
    }
    drop((task_sets, supervision));
    graph.run_writer().set_now(secs(0.025));
    (graph, log)
}

/// What ticked after the first time, and the events.
fn run_late(
    slowed: Slowed,
    timed: Vec<TimedCommand>,
    end: f64,
) -> (Vec<(&'static str, Time)>, Vec<Event>) {
    let (commander, mut inbox) = Inbox::new(timed);
    let (mut graph, log) = late(slowed, commander);
    let exit = VirtualClock.run(&mut graph, &mut inbox, secs(end));
    assert_eq!(exit.expect("no fault"), ClockExit::Completed);
    (log.all().split_off(3), graph.state().events(0))
}

#[test]
fn a_live_command_and_the_same_as_a_timed_one_follow_the_ticks_of_late_nodes() {
    for slowed in [Slowed::First, Slowed::Amid] {
        let (ticks, events) = run_late(slowed, Vec::new(), 0.5);
        let now = secs(0.025);
        assert_eq!(
            ticks[..3],
            ["a", "b", "c"].map(|node| (node, now)),
            "{slowed:?}"
        );
        assert_eq!(events[0].at, now + Time::RESOLUTION, "{slowed:?}");
        let timed = events.iter().filter_map(Event::replayable).collect();
        assert_eq!(
            run_late(Slowed::Never, timed, 0.5),
            (ticks, events),
            "{slowed:?}"
        );
    }
}

#[test]
fn after_the_end_only_those_tick_that_were_due_before_and_no_command_is_obeyed() {
    let (ticks, events) = run_late(Slowed::Never, timed("0.01 stop"), 0.02);
    assert_eq!(ticks, ["a", "b"].map(|node| (node, secs(0.025))));
    assert_eq!(events, []);
}
