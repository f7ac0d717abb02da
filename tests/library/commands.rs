//! Commands are the only input of a running graph: they take effect between instants, in
//! the given order, and are logged with their run time.

use std::thread;

use crossbeam_channel::Sender;

use crate::{support::*, swap::listener, table::rows};

fn seconds(times: &[Time]) -> String {
    let times = times.iter().map(|time| time.as_secs_f64().to_string());
    times.collect::<Vec<_>>().join(" ")
}

/// Three nodes at 10 Hz in the order a, b, c, the first of which gives
/// `commands` during its first tick.
fn trio(commander: Sender<Command>, commands: Vec<Command>) -> (TickLog, Graph) {
    let (log, mut graph) = (TickLog::default(), Graph::new());
    let mut commands = commands.into_iter();
    log.node_that(&mut graph, "a", 10.0, 0, move |_: &mut Tick| {
        for command in commands.by_ref() {
            commander.send(command)?;
        }
        Ok(Flow::Continue)
    });
    log.node(&mut graph, "b", 10.0, 1);
    log.node(&mut graph, "c", 10.0, 2);
    (log, graph)
}

#[test]
fn timed_commands_take_effect_before_what_is_due_then() {
    for [case, commands, until, ticks, dropped, events] in rows(
        r"
        a rate           | 0.3 rate a 4        | 0.75 | 0 0.1 0.2 0.45 0.7    | 4 | 0.300 s: a at 4 Hz (was 10 Hz)
        a depth          | 0.3 depth /said 100 | 0.5  | 0 0.1 0.2 0.3 0.4 0.5 | 2 | 0.300 s: /said depth 100 (was 1)
        the order given  | 0 rate a 2; 0 rate a 1; 0 rate a 5 | 0.5 | 0 0.2 0.4 | 2 | 0.000 s: a at 2 Hz (was 10 Hz)\n0.000 s: a at 1 Hz (was 2 Hz)\n0.000 s: a at 5 Hz (was 1 Hz)
        the end          | 0.2 rate a 5; 0.3 rate a 5 | 0.2 | 0 0.1           | 1 | 0.200 s: a at 5 Hz (was 10 Hz)
        a stop           | 0.3 stop            | 9    | 0 0.1 0.2             | 2 | 0.300 s: stop
        ",
    ) {
        let (topic, mut graph) = (Topic::new("/said", Depth::ONE), Graph::new());
        talker(&mut graph, "a", 10.0, 0, &topic, Some);
        let (subscription, tap) = (topic.subscribe(), TapHandle::new(&graph).topic(&topic, 100));
        let until = secs(until.parse().expect(&case));
        let exit = run_virtual(&mut graph, &commands, until);
        let said: Vec<Time> = tapped(&tap).iter().map(|message| message.data).collect();
        assert_eq!(seconds(&said), ticks, "{case}");
        assert_eq!(subscription.dropped().to_string(), dropped, "{case}");
        assert_eq!(self::events(&graph).join("\n"), events, "{case}");
        let end = if commands.ends_with("stop") {
            (ClockExit::Stopped, secs(0.3))
        } else {
            (ClockExit::Completed, until)
        };
        assert_eq!((exit, graph.now()), end, "{case}");
    }
}

#[test]
fn a_command_from_within_an_instant_takes_effect_after_the_whole_of_it() {
    // Also where a single step had it begin.
    for first in [None, Some(Command::Step)] {
        let (commander, mut inbox) = Inbox::new(Vec::new());
        let first = first.map(|step| commander.send(step).expect("open"));
        let commands = vec![command("rate b 5"), Command::Stop];
        let (log, mut graph) = trio(commander, commands.clone());
        let exit = VirtualClock.run(&mut graph, &mut inbox, secs(1.0));
        assert_eq!(exit.expect("run"), ClockExit::Stopped);
        assert_eq!(log.all(), ["a", "b", "c"].map(|node| (node, Time::ZERO)));
        let after = Time::ZERO + Time::RESOLUTION;
        let expected: Vec<_> = commands.into_iter().map(|known| (after, known)).collect();
        let applied = applied(&graph.state().events(0));
        assert_eq!(applied[usize::from(first.is_some())..], expected);
    }
}

#[test]
fn a_command_that_arrives_after_the_last_instant_comes_too_late() {
    for too_late in ["stop", "pause", "rate a 1"] {
        let (commander, mut inbox) = Inbox::new(Vec::new());
        let (_, mut graph) = trio(commander, vec![command(too_late)]);
        let exit = VirtualClock.run(&mut graph, &mut inbox, Time::ZERO);
        let end = (exit.expect("run"), graph.now());
        assert_eq!(end, (ClockExit::Completed, Time::ZERO));
        assert_eq!(graph.state().events(0), []);
    }
}

#[test]
fn both_clocks_end_alike() {
    for mut clock in clocks() {
        let mut run = |graph: &mut Graph, commands, until| {
            let exit = run_timed(&mut *clock, graph, commands, until);
            (exit, graph.now())
        };
        // An empty graph, a stop, and a pause that nobody can end.
        let (exit, _) = run(&mut Graph::new(), "", secs(0.01));
        assert_eq!(exit, ClockExit::Completed);
        for last in ["0.05 stop", "0.05 pause"] {
            let (exit, now) = run(&mut metronome().1, last, Time::MAX);
            assert_eq!(exit, ClockExit::Stopped, "{last}");
            assert!(now >= secs(0.05), "{last}: {now}");
        }
    }
}

#[test]
fn a_command_that_cannot_be_obeyed_is_refused_with_the_reason() {
    const WALL: &str =
        "the real clock knows one speed, that of the wall; hand over to the virtual clock";
    for [clocks_of_it, command, reason] in rows(
        r#"
        virtual, real | rate nobody 1   | there is no node "nobody": expected one of a, deaf
        virtual, real | send nobody one | there is no node "nobody": expected one of a, deaf
        virtual, real | depth /none 1   | there is no topic "/none": the graph has none
        virtual, real | send deaf one   | this node takes no orders
        virtual, real | send a no       | not that
        virtual       | virtual         | it runs under that clock already
        real          | real            | it runs under that clock already
        real          | step            | WALL
        real          | speed 2         | WALL
        "#,
    ) {
        for (mut clock, name) in clocks().into_iter().zip(["virtual", "real"]) {
            if clocks_of_it.contains(name) {
                let mut graph = listener();
                run_timed(&mut *clock, &mut graph, &format!("0 {command}"), secs(0.02));
                let refused = refused(&graph.state().events(0));
                assert_eq!(refused, [reason.replace("WALL", WALL)], "{name}: {command}");
            }
        }
    }
}

#[test]
fn a_paused_run_stands_still_until_it_is_resumed() {
    let (log, mut graph) = metronome();
    let (commander, mut inbox) = Inbox::new(timed("0 pause"));
    let (observer, paused) = (Observer::new(&graph), log.clone());
    thread::scope(|scope| {
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

/// Publishes when a parameter is set.
struct Button(Publisher<()>);

impl Node for Button {
    fn tick(&mut self, _: &mut Tick) -> TickResult {
        Ok(Flow::Continue)
    }

    fn set_parameter(&mut self, _: &str, _: &str, now: Time) -> Result<String, NodeError> {
        Tick::at(now).publish(&self.0, ());
        Ok(String::new())
    }
}

#[test]
fn a_message_that_a_node_publishes_as_it_obeys_triggers_its_reader_at_once() {
    let (pressed, mut graph) = (Topic::new("/pressed", Depth::ONE), Graph::new());
    let button = |wiring: &mut Wiring<'_>| Button(wiring.publisher(&pressed));
    let hz = Hz::new(1.0).expect("a rate");
    graph.node("button", hz, 0, button).expect("a node");
    let ticks = triggered(&mut graph, "lamp", 1, &pressed);
    run_virtual(&mut graph, "0.25 set button down 1", secs(0.5));
    assert!(ticks.try_iter().eq([secs(0.25)]));
}

#[test]
fn a_reader_that_a_node_has_only_since_its_restart_counts_for_no_other_node() {
    let (word, mut graph) = (Topic::new("/word", Depth::ONE), Graph::new());
    talker(&mut graph, "talker", 10.0, 0, &word, |_| Some(()));
    let _heard = reader(&mut graph, "first", 10.0, 1, &word);
    let mut ears = 0;
    let build = move |wiring: &mut Wiring<'_>| {
        ears += 1;
        let mut ends: Vec<_> = (0..ears).map(|_| wiring.subscription(&word)).collect();
        move |tick: &mut Tick| {
            tick.read(&mut ends[0]);
        }
    };
    let hz = Hz::new(10.0).expect("a rate");
    let added = graph.restartable_node("second", hz, 2, build, None);
    added.expect("a node");
    run_timed(
        &mut VirtualClock,
        &mut graph,
        "0.25 restart second",
        secs(1.0),
    );
    let readers = &snapshot(&graph).topics[0].readers;
    let (dropped, reads): (Vec<_>, Vec<_>) =
        readers.iter().map(|r| (r.dropped, r.ages.count())).unzip();
    assert_eq!((dropped, reads), (vec![0, 0], vec![11, 11]));
}
