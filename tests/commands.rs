//! Commands are the only way into a running graph, and what they did can be
//! done again: stamped with the run time at which they took effect, between
//! instants, to the bit.

mod common;

use std::{
    sync::atomic::{AtomicU64, Ordering},
    thread,
    time::Duration,
};

use common::{
    END, GO_ON, TickLog, applied, at, brain, collect, hz, message_bytes, messages_of, refused,
    run_bytes, run_timed, secs, set_depth, set_rate, tell, ticks,
};
use crossbeam_channel::Sender;
use proptest::prelude::*;
use ratelab::{
    cartpole::{
        ACTUATOR, Action, Actuator, NotFinite, Observation, POLICY, Plant, PolicyNode,
        SENSE_TO_ACT, SENSOR, Sensor, SharedPlant,
    },
    experiment::{ACTION, Config, Experiment, OBS, STATE},
    policy::{Policy, PolicyKind},
    runtime::{
        Clock, ClockKind, Command, Depth, Exit, Fault, Graph, Inbox, Panicked, RealClock, Speed,
        Time, TimedCommand, Topic, VirtualClock, clock,
        telemetry::{Event, Happening},
    },
};

fn run_virtual(graph: &mut Graph, timed: Vec<TimedCommand>, until: Time) -> Exit {
    run_timed(&mut VirtualClock, graph, timed, until)
}

fn seconds(times: &[Time]) -> Vec<f64> {
    times.iter().map(|time| time.as_secs_f64()).collect()
}

/// One node at 10 Hz.
fn metronome() -> (TickLog, Graph) {
    let (log, mut graph) = (TickLog::default(), Graph::new());
    log.node(&mut graph, "a", 10.0, 0);
    (log, graph)
}

/// Three nodes at 10 Hz in the order a, b, c, the first of which gives
/// `commands` during its first tick.
fn trio(commander: Sender<Command>, commands: Vec<Command>) -> (TickLog, Graph) {
    let (log, mut graph) = (TickLog::default(), Graph::new());
    let mut commands = commands.into_iter();
    log.node_that(&mut graph, "a", 10.0, 0, move |_| {
        commands.try_for_each(|command| commander.send(command))?;
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
    let topic = Topic::new("/count", Depth::ONE);
    let mut graph = Graph::new();
    let source = |wiring: &mut ratelab::runtime::Wiring<'_>| {
        let count = wiring.publisher(&topic);
        move |now| {
            count.publish((), now, None);
            GO_ON
        }
    };
    graph.node("source", hz(10.0), 0, source).expect("node");
    let subscription = topic.subscribe();
    // Published at 0, 0.1 … 0.5; what comes at 0.3 finds room already.
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
    let rates = applied(&graph.observer().events(0));
    assert_eq!(rates, timed.map(|t| (t.at, t.command)).to_vec());
}

#[test]
fn a_timed_command_takes_effect_at_the_end_but_not_after_it() {
    let (_, mut graph) = metronome();
    let timed = [0.5, 0.6].map(|time| at(time, set_rate("a", 5.0)));
    assert_eq!(
        run_virtual(&mut graph, timed.to_vec(), secs(0.5)),
        Exit::Completed
    );
    let applied = applied(&graph.observer().events(0));
    assert_eq!(applied, [(secs(0.5), set_rate("a", 5.0))]);
}

#[test]
fn events_tell_what_was_replaced() {
    let (_, mut graph) = metronome();
    run_virtual(&mut graph, vec![at(0.1, set_rate("a", 2.5))], secs(0.2));
    let told: Vec<String> = graph
        .observer()
        .events(0)
        .iter()
        .map(Event::to_string)
        .collect();
    assert_eq!(told, ["0.100 s: a at 2.5 Hz (was 10 Hz)"]);
}

#[test]
fn a_stop_ends_the_run_before_what_is_due_then() {
    let (log, mut graph) = metronome();
    let exit = run_virtual(&mut graph, vec![at(0.3, Command::Stop)], Time::MAX);
    assert_eq!(exit, Exit::Stopped);
    assert_eq!(graph.now(), secs(0.3));
    assert_eq!(seconds(&log.of("a")), [0.0, 0.1, 0.2]);
}

#[test]
fn a_command_from_within_an_instant_takes_effect_after_the_whole_of_it() {
    let (commander, mut inbox) = Inbox::new(Vec::new());
    let (log, mut graph) = trio(commander, vec![set_rate("b", 5.0), Command::Stop]);
    let exit = VirtualClock
        .run(&mut graph, &mut inbox, secs(1.0))
        .expect("run");
    assert_eq!(exit, Exit::Stopped);
    assert_eq!(log.all(), ["a", "b", "c"].map(|node| (node, Time::ZERO)));
    let after = Time::ZERO + Time::TICK;
    let expected = [(after, set_rate("b", 5.0)), (after, Command::Stop)];
    assert_eq!(applied(&graph.observer().events(0)), expected);
}

#[test]
fn a_command_after_a_single_step_first_lets_the_rest_of_the_instant_run() {
    let (commander, mut inbox) = Inbox::new(Vec::new());
    commander.send(Command::Step).expect("open");
    let (log, mut graph) = trio(commander, vec![set_rate("b", 5.0), Command::Stop]);
    VirtualClock
        .run(&mut graph, &mut inbox, secs(1.0))
        .expect("run");
    assert_eq!(log.all(), ["a", "b", "c"].map(|node| (node, Time::ZERO)));
    let events = applied(&graph.observer().events(0));
    assert_eq!(events[1], (Time::ZERO + Time::TICK, set_rate("b", 5.0)));
}

#[test]
fn a_command_that_arrives_after_the_last_instant_comes_too_late() {
    for too_late in [Command::Stop, Command::Pause, set_rate("a", 1.0)] {
        let (commander, mut inbox) = Inbox::new(Vec::new());
        let (_, mut graph) = trio(commander, vec![too_late]);
        let exit = VirtualClock
            .run(&mut graph, &mut inbox, Time::ZERO)
            .expect("run");
        assert_eq!((exit, graph.now()), (Exit::Completed, Time::ZERO));
        assert_eq!(graph.observer().events(0), []);
    }
}

#[test]
fn a_pause_that_nobody_can_end_ends_the_run() {
    for clock in [
        &mut VirtualClock as &mut dyn Clock,
        &mut RealClock::default(),
    ] {
        let (_, mut graph) = metronome();
        let (_, mut inbox) = Inbox::new(vec![at(0.05, Command::Pause)]);
        let exit = clock.run(&mut graph, &mut inbox, Time::MAX).expect("run");
        assert_eq!(exit, Exit::Stopped);
        assert!(graph.now() >= secs(0.05));
    }
}

#[test]
fn commands_for_nodes_and_topics_that_are_not_there_are_refused_by_name() {
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
        assert_eq!(exit, Exit::Completed);
        let refused = refused(&graph.observer().events(0));
        let reasons: Vec<&str> = refused.iter().map(|(_, reason)| reason.as_str()).collect();
        assert_eq!(
            reasons,
            ["there is no node \"nobody\"", "there is no topic \"/none\""]
        );
    }
}

#[test]
fn the_real_clock_refuses_what_only_virtual_time_can_do() {
    let (_, mut graph) = metronome();
    let only_virtual = [Command::Speed(Speed::FlatOut), Command::Step];
    let timed = only_virtual
        .clone()
        .map(|command| at(0.0, command))
        .to_vec();
    run_timed(&mut RealClock::default(), &mut graph, timed, secs(0.02));
    let refused = refused(&graph.observer().events(0));
    let commands: Vec<Command> = refused.iter().map(|(command, _)| command.clone()).collect();
    assert_eq!(commands, only_virtual);
    assert!(
        refused
            .iter()
            .all(|(_, reason)| reason.contains("virtual clock"))
    );
}

#[test]
fn a_graph_is_not_handed_to_the_clock_that_runs_it() {
    for kind in [ClockKind::Virtual, ClockKind::Real] {
        let (_, mut graph) = metronome();
        let (_, mut inbox) = Inbox::new(vec![at(0.0, Command::HandOver(kind))]);
        let real = &mut RealClock::default();
        let exit = clock::run(&mut graph, &mut inbox, secs(0.02), kind, real).expect("run");
        assert_eq!(exit, Exit::Completed);
        assert_eq!(refused(&graph.observer().events(0)).len(), 1);
    }
}

#[test]
fn an_empty_graph_is_soon_done() {
    let mut graph = Graph::new();
    assert_eq!(
        run_virtual(&mut graph, Vec::new(), Time::MAX),
        Exit::Completed
    );
    let mut graph = Graph::new();
    let exit = run_timed(
        &mut RealClock::default(),
        &mut graph,
        Vec::new(),
        secs(0.01),
    );
    assert_eq!(exit, Exit::Completed);
}

/// The fault of a graph whose second node works like this from 0.02 s on.
fn fault_of(clock: &mut dyn Clock, work: fn() -> ratelab::runtime::Tick) -> (Fault, Vec<Event>) {
    let (log, mut graph) = (TickLog::default(), Graph::new());
    log.node(&mut graph, "healthy", 100.0, 0);
    log.node_that(&mut graph, "sick", 100.0, 1, move |now| {
        if now < secs(0.02) { GO_ON } else { work() }
    });
    let (_commander, mut inbox) = Inbox::new(Vec::new());
    let fault = clock
        .run(&mut graph, &mut inbox, Time::MAX)
        .expect_err("a fault");
    assert_eq!(log.of("sick").last(), Some(&fault.at));
    (fault, graph.observer().events(0))
}

fn check_fault(work: fn() -> ratelab::runtime::Tick, cause: &str) -> Fault {
    let (fault, events) = fault_of(&mut RealClock::default(), work);
    assert!(fault.at >= secs(0.02));
    let node = "sick".to_owned();
    let what = Happening::Faulted {
        node,
        cause: cause.to_owned(),
    };
    assert_eq!(events, [Event { at: fault.at, what }]);
    let (fault, _) = fault_of(&mut VirtualClock, work);
    let expected = format!("node \"sick\" failed at 0.020 s: {cause}");
    assert_eq!(fault.to_string(), expected);
    fault
}

#[test]
fn a_node_that_returns_an_error_gives_a_fault_with_its_name_and_the_time() {
    check_fault(|| Err("out of cheese".into()), "out of cheese");
}

#[test]
fn a_node_that_panics_gives_a_fault_with_its_name_and_the_time() {
    let fault = check_fault(|| panic!("no {}", "brakes"), "it panicked: no brakes");
    assert!(fault.cause.is::<Panicked>());
}

/// Answers the same whatever it sees.
struct Stubborn(f32);

impl Policy for Stubborn {
    fn name(&self) -> &str {
        "stubborn"
    }

    fn act(&mut self, _: &Observation) -> Action {
        Action(self.0)
    }
}

#[test]
fn a_policy_that_answers_no_number_gives_a_fault_with_its_name_and_what_it_saw() {
    for answer in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let brain = Box::new(Stubborn(answer));
        let experiment = Experiment::with_policy(&Config::default(), brain).expect("experiment");
        let fault = experiment
            .run(&mut RealClock::default())
            .expect_err("a fault");
        assert_eq!((fault.node.as_str(), fault.at), (POLICY, Time::ZERO));
        assert!(fault.cause.is::<NotFinite>());
        let start = Plant::new(0).expect("plant").observe();
        for part in ["stubborn", &answer.to_string(), &format!("{start:?}")] {
            assert!(fault.to_string().contains(part), "{fault} lacks {part}");
        }
    }
}

/// Runs an experiment as configured while `person` gives commands.
fn run_live(config: &Config, person: impl FnOnce(Sender<Command>) + Send) -> common::RunBytes {
    let experiment = Experiment::new(config).expect("experiment");
    let commander = experiment.commands();
    thread::scope(|scope| {
        scope.spawn(|| person(commander));
        collect(experiment)
    })
}

/// Every message of the cart-pole under `timed` commands, headless.
fn replay(config: &Config, timed: Vec<TimedCommand>) -> Vec<u8> {
    let plant = SharedPlant::new(Plant::new(config.seed).expect("plant"));
    let observations = Topic::new(OBS, config.queue_depth);
    let actions = Topic::new(ACTION, config.queue_depth);
    let steps = Topic::new(STATE, Depth::ONE);
    let mut graph = Graph::new();
    let sensor = graph.node(SENSOR, config.sensor_hz, 0, |wiring| Sensor {
        plant: plant.clone(),
        observations: wiring.publisher(&observations),
    });
    let policy = graph.node(POLICY, config.control_hz, 1, |wiring| PolicyNode {
        policy: brain(config),
        observations: wiring.subscription(&observations),
        actions: wiring.publisher(&actions),
    });
    let actuator = graph.node(ACTUATOR, hz(50.0), 2, |wiring| Actuator {
        plant: plant.clone(),
        actions: wiring.subscription(&actions),
        steps: wiring.publisher(&steps),
        sense_to_act: wiring.meter(SENSE_TO_ACT),
    });
    sensor.and(policy).and(actuator).expect("graph");
    let room = 1_000_000;
    let taps = (
        graph.tap(&observations, room),
        graph.tap(&actions, room),
        graph.tap(&steps, room),
    );
    run_virtual(&mut graph, timed, config.end);
    drop((graph, observations, actions, steps));
    message_bytes(
        &messages_of(&taps.0),
        &messages_of(&taps.1),
        &messages_of(&taps.2),
    )
}

fn replayable(events: &[Event]) -> Vec<TimedCommand> {
    events.iter().filter_map(Event::replayable).collect()
}

fn live_config() -> Config {
    Config {
        speed: Speed::times(100.0).expect("speed"),
        end: secs(4.0),
        ..Config::default()
    }
}

fn any_command() -> impl Strategy<Value = Command> {
    let node = prop_oneof![Just(SENSOR), Just(POLICY), Just(ACTUATOR)];
    let brain = prop_oneof![
        Just("scripted"),
        Just("lqr"),
        Just("random"),
        Just("no brain")
    ];
    let topic = prop_oneof![Just(OBS), Just(ACTION), Just(STATE)];
    prop_oneof![
        3 => (node, 10.0..200.0f64).prop_map(|(node, rate)| set_rate(node, rate)),
        2 => brain.prop_map(|brain| tell(POLICY, brain)),
        2 => (topic, 1..20usize).prop_map(|(topic, messages)| set_depth(topic, messages)),
        1 => Just(Command::Pause),
        2 => Just(Command::Resume),
        2 => Just(Command::Step),
        1 => (30.0..100.0f64).prop_map(|f| Command::Speed(Speed::times(f).expect("speed"))),
    ]
}

proptest! {
    // A case depends on when its commands arrive, so it is not worth keeping.
    #![proptest_config(ProptestConfig {
        cases: 24,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn a_session_executed_again_is_the_same_to_the_bit(
        script in proptest::collection::vec((any_command(), 0..4_000u64), 1..30),
        seed in 0..100u64,
        policy in prop_oneof![Just(PolicyKind::Scripted), Just(PolicyKind::Random)],
    ) {
        let config = Config { seed, policy: policy.into(), ..live_config() };
        let live = run_live(&config, |commander| {
            for (command, pause_us) in script {
                thread::sleep(Duration::from_micros(pause_us));
                // The run may be over by now.
                let _ = commander.send(command);
            }
            let _ = commander.send(Command::Resume);
        });
        let again = replay(&config, replayable(&live.summary.events));
        prop_assert!(live.bytes() == again, "{:?}", live.summary.events);
    }
}

#[test]
fn a_session_that_was_stopped_ends_at_the_same_message_when_executed_again() {
    let live = run_live(&live_config(), |commander| {
        for command in [set_rate(POLICY, 20.0), set_depth(OBS, 3), Command::Stop] {
            thread::sleep(Duration::from_millis(5));
            let _ = commander.send(command);
        }
    });
    let timed = replayable(&live.summary.events);
    assert!(live.bytes() == replay(&live_config(), timed));
}

#[test]
fn timed_knobs_and_live_commands_replay_together() {
    let config = Config {
        knobs: vec![
            "1 control-hz 20".parse().expect("knob"),
            "2 queue-depth 5".parse().expect("knob"),
        ],
        ..live_config()
    };
    let live = run_live(&config, |commander| {
        for rate in [100.0, 25.0, 60.0] {
            thread::sleep(Duration::from_millis(8));
            let _ = commander.send(set_rate(SENSOR, rate));
        }
    });
    let events = &live.summary.events;
    assert!(applied(events).contains(&(secs(1.0), set_rate(POLICY, 20.0))));
    assert!(live.bytes() == replay(&live_config(), replayable(events)));
}

#[test]
fn the_graph_of_an_experiment_is_the_one_that_replays_it() {
    let config = Config {
        control_hz: hz(15.0),
        ..Config::default()
    };
    assert!(run_bytes(&config).bytes() == replay(&config, Vec::new()));
}

#[test]
fn the_pace_of_a_run_does_not_change_it() {
    let paced = Config {
        control_hz: hz(15.0),
        ..live_config()
    };
    let flat_out = Config {
        speed: Speed::FlatOut,
        ..paced.clone()
    };
    let paced = run_bytes(&paced).bytes();
    assert!(!paced.is_empty());
    assert!(paced == run_bytes(&flat_out).bytes());
}

#[test]
fn single_stepping_through_a_whole_run_is_the_run() {
    let config = Config {
        control_hz: hz(15.0),
        end: secs(1.0),
        ..Config::default()
    };
    let whole = run_bytes(&config);
    let total: u64 = whole.summary.nodes.iter().map(|node| node.ticks).sum();
    let experiment = Experiment::new(&config).expect("experiment");
    let (commander, observer) = (experiment.commands(), experiment.observer());
    commander.send(Command::Pause).expect("open");
    let stepped = thread::scope(|scope| {
        scope.spawn(move || {
            for done in 0..total {
                assert_eq!(ticks(&observer), done, "one step is one tick");
                commander.send(Command::Step).expect("the run goes on");
                while ticks(&observer) == done {
                    thread::yield_now();
                }
            }
        });
        collect(experiment)
    });
    assert!(stepped.bytes() == whole.bytes());
    assert_eq!(stepped.summary.verdict, whole.summary.verdict);
}

#[test]
fn a_graph_that_is_handed_over_and_back_goes_on_where_it_was() {
    let (log, mut graph) = (TickLog::default(), Graph::new());
    let rates = [("fast", 200.0), ("medium", 50.0), ("odd", 33.3)];
    let topic = Topic::new("/numbers", Depth::ONE);
    for (name, rate) in rates {
        let publisher = topic.publisher();
        log.node_that(&mut graph, name, rate, 0, move |now| {
            publisher.publish(name, now, None);
            GO_ON
        });
    }
    let tap = graph.tap(&topic, 1_000);
    let timed = vec![
        at(0.5, Command::HandOver(ClockKind::Real)),
        at(0.6, Command::HandOver(ClockKind::Virtual)),
    ];
    let (_, mut inbox) = Inbox::new(timed);
    let real = &mut RealClock::default();
    let exit = clock::run(&mut graph, &mut inbox, secs(2.0), ClockKind::Virtual, real);
    assert_eq!(exit.expect("run"), Exit::Completed);

    let hand_overs = applied(&graph.observer().events(0));
    let (to_real, to_virtual) = (hand_overs[0].0, hand_overs[1].0);
    assert_eq!(to_real, secs(0.5));
    assert!(to_virtual >= secs(0.6));
    let snapshot = graph.observer().snapshot();
    for (name, rate) in rates {
        let node = snapshot.node(name).expect("node");
        let periods = (2.0 * rate + 1e-9).floor() as u64 + 1;
        assert_eq!(node.ticks + node.overruns, periods, "{name}");
        let times = log.of(name);
        assert_eq!(times.len() as u64, node.ticks, "{name}");
        assert!(times.is_sorted_by(|a, b| a < b), "{name}: {times:?}");
        let virtual_again = |time: &&Time| **time < to_real || **time > to_virtual;
        let grid: Vec<Time> = (0..periods).map(|tick| secs(tick as f64 / rate)).collect();
        for time in times.iter().filter(virtual_again) {
            let near = |due: &Time| due.since(*time).max(time.since(*due)) <= Time::TICK;
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
fn a_graph_goes_on_from_one_end_to_the_next_as_if_there_was_none() {
    let (log, mut graph) = metronome();
    for end in [0.25, 0.3, 1.0] {
        run_virtual(&mut graph, Vec::new(), secs(end));
    }
    let (whole, mut graph) = metronome();
    run_virtual(&mut graph, Vec::new(), secs(1.0));
    assert_eq!(log.all(), whole.all());
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
        Exit::Ended {
            node: node.clone(),
            at
        }
    );
    let what = Happening::Ended { node };
    assert_eq!(graph.observer().events(0), [Event { at, what }]);
}

#[test]
fn a_paused_run_stands_still_until_it_is_resumed() {
    static TICKS: AtomicU64 = AtomicU64::new(0);
    let (commander, mut inbox) = Inbox::new(Vec::new());
    let mut graph = Graph::new();
    let counter = |_: &mut ratelab::runtime::Wiring<'_>| {
        |_: Time| {
            TICKS.fetch_add(1, Ordering::Relaxed);
            GO_ON
        }
    };
    graph.node("a", hz(10.0), 0, counter).expect("node");
    commander.send(Command::Pause).expect("open");
    let observer = graph.observer();
    thread::scope(|scope| {
        scope.spawn(move || {
            while !observer.snapshot().status.paused {
                thread::yield_now();
            }
            assert_eq!(TICKS.load(Ordering::Relaxed), 0);
            assert_eq!(observer.now(), Time::ZERO);
            commander.send(Command::Resume).expect("paused");
        });
        VirtualClock
            .run(&mut graph, &mut inbox, secs(1.0))
            .expect("run");
    });
    assert_eq!(TICKS.load(Ordering::Relaxed), 11);
}
