//! A graph contains all state of its run, so it can be handed over from clock to clock,
//! or run in pieces, and continues where it was.

use crate::support::*;

/// Runs `graph` with these commands, first under a clock of `kind`.
fn run_from(kind: ClockKind, graph: &mut Graph, commands: &str, until: f64) {
    let (_, mut inbox) = Inbox::new(timed(commands));
    let real = &mut RealClock::default();
    let exit = ratelab::run(graph, &mut inbox, secs(until), kind, real);
    assert_eq!(exit.expect("run"), ClockExit::Completed);
}

#[test]
fn a_graph_is_not_handed_to_the_clock_that_runs_it() {
    for (kind, same) in [
        (ClockKind::Virtual, "0 virtual"),
        (ClockKind::Real, "0 real"),
    ] {
        let (_, mut graph) = metronome();
        run_from(kind, &mut graph, same, 0.02);
        assert_eq!(refused(&graph.state().events(0)).len(), 1);
    }
}

#[test]
fn a_graph_that_is_handed_over_and_back_continues_where_it_was() {
    let mut graph = Graph::with(Effects);
    let rates = [("fast", 200.0), ("medium", 50.0), ("odd", 33.3)];
    let topic = Topic::new("/numbers", Depth::ONE);
    for (name, rate) in rates {
        talker(&mut graph, name, rate, 0, &topic, move |now| {
            Some((name, now))
        });
    }
    let tap = TapHandle::of(&graph).topic(&topic, 1_000);
    run_from(ClockKind::Virtual, &mut graph, "0.5 real; 0.6 virtual", 2.0);

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
        graph.set(&knob("link /far delay:30")).expect("a topic");
        // As threads that are stopped: nobody hears of the arrival.
        let task_sets = graph.apart();
        far.publisher().publish(1, Time::ZERO, None);
        drop(task_sets);
        run_virtual(&mut graph, "", secs(0.5));
        assert!(ticks.try_iter().eq([secs(0.03)]));
    }
}
