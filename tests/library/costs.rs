//! Duration, lateness and due times of ticks, set by knobs, under both clocks. The
//! virtual clock's bytes are tested in `golden.rs`.

use std::{sync::Arc, time::Duration};

use ratelab::{
    Clock, ClockKind, Command, Depth, GO_ON, Graph, Inbox, Knob, Message, Time, TimedCommand,
    Topic, VirtualClock,
};
use ratelab_account::{Observer, TapHandle};
use ratelab_cart_pole::POLICY;
use ratelab_effects::{Draw, Effects, draw, with_draw};
use ratelab_real_clock::RealClock;
use ratelab_study::experiment::{Config, Experiment, Summary};

use crate::{
    own_costs::Robot,
    support::{RunBytes, knob, knobs, own, refusal, run, run_bytes, talker, tapped, with},
};

fn ms(ms: u64) -> Duration {
    Duration::from_millis(ms)
}

fn at(millis: u64) -> Time {
    Time::ZERO + ms(millis)
}

/// The knob `text`, with durations as if loaded from its recording.
fn loaded(text: &str, durations: &[Duration]) -> Result<Knob, String> {
    let knob = knob(text);
    let Some(Draw::Recorded(recorded)) = draw(&knob)? else {
        panic!("{text} names no recording");
    };
    let measured = recorded.with_durations(durations.to_vec())?;
    Ok(with_draw(knob, measured.into()))
}

#[test]
fn recorded_durations_are_drawn_once_they_are_loaded_and_known_by_their_digest() {
    let text = "takes policy recorded:real.rrd";
    let missing = refusal(&with(&[text], Config::default()));
    assert!(missing.contains("real.rrd were not loaded"), "{missing}");

    let durations = [ms(7), ms(3), ms(5)];
    let knob = loaded(text, &durations).expect("loaded");
    let mut config = Config::default();
    config.setup.set(knob.clone());
    let summary = run(&config);
    let costs = &summary.node(POLICY).expect("a policy").tick_time;
    let drawn: Vec<Duration> = costs.bars().map(|(duration, _)| duration).collect();
    // All ticks except the one that starts at the very end.
    assert_eq!((drawn, costs.count()), (vec![ms(3), ms(5), ms(7)], 500));

    let pinned = knob.to_string();
    assert!(
        pinned.starts_with("takes policy recorded:real.rrd@sha256:"),
        "{pinned}"
    );
    loaded(&pinned, &[ms(3), ms(5), ms(7)]).expect("the same durations in any order");
    let changed = loaded(&pinned, &[ms(3)]).expect_err("others");
    assert!(
        changed.contains("real.rrd has other durations"),
        "{changed}"
    );
    assert!(loaded(text, &[]).is_err());
}

#[test]
fn one_knob_changes_no_draw_of_another() {
    let costs = |knobs: &[&str]| {
        let summary = run(&with(knobs, Config::default()));
        let policy = summary.node(POLICY).expect("a policy");
        policy.tick_time.bars().collect::<Vec<_>>()
    };
    let alone = costs(&["takes policy 0..15"]);
    let others = [
        "takes policy 0..15",
        "takes sensor 0..15",
        "wakes actuator 1..2",
    ];
    assert_eq!(costs(&others), alone);
}

#[test]
fn a_live_knob_is_logged_with_its_old_value() {
    let config = Config {
        knobs: knobs(
            "1 takes policy 30\n2 offset policy 3.5\n3 takes policy none\n4 control-hz 2.5",
        ),
        ..Config::default()
    };
    let events = run(&config).events;
    let events: Vec<String> = events.iter().map(ToString::to_string).collect();
    assert_eq!(
        events,
        [
            "1.000 s: policy takes 30 (was none)",
            "2.000 s: policy offset 3.5 ms (was 0 ms)",
            "3.000 s: policy takes none (was 30)",
            "4.000 s: policy at 2.5 Hz (was 50 Hz)",
            "5.480 s: actuator ended the run",
        ]
    );
}

/// A node that publishes the start times of its ticks, with its topic.
fn beacon(hz: f64) -> (Graph, Topic<Time>) {
    let (mut graph, began) = (Graph::with(Effects), Topic::new("/began", Depth::ONE));
    talker(&mut graph, "beacon", hz, 0, &began, Some);
    (graph, began)
}

fn messages(
    clock: &mut dyn Clock,
    graph: &mut Graph,
    topic: &Topic<Time>,
    commands: &[(u64, Command)],
    until: Time,
) -> Vec<Message<Time>> {
    let tap = TapHandle::of(graph).topic(topic, 1_000);
    let timed = commands.iter().map(|(millis, command)| TimedCommand {
        at: at(*millis),
        command: command.clone(),
    });
    let (_live, mut inbox) = Inbox::new(timed.collect());
    clock.run(graph, &mut inbox, until).expect("no fault");
    tapped(&tap)
}

#[test]
fn the_real_clock_spends_the_cost_and_publishes_at_its_end() {
    for spec in ["12", "busy 12"] {
        let (mut graph, topic) = beacon(50.0);
        let takes = knob(&format!("takes beacon {spec}")).into();
        let sent = messages(
            &mut RealClock::default(),
            &mut graph,
            &topic,
            &[(0, takes)],
            at(100),
        );
        assert!(!sent.is_empty());
        // The first tick may have begun before the command.
        for message in sent.iter().skip(1) {
            assert_eq!(message.origin, Some(message.data));
            assert!(
                message.stamp - message.data >= ms(12),
                "{spec}: {message:?}"
            );
        }
        let beacon = &Observer::of(&graph).snapshot().nodes[0];
        assert_eq!(beacon.ticks + beacon.overruns, 6, "{spec}");
    }
}

#[test]
fn a_tick_continues_under_the_other_clock() {
    let (mut graph, topic) = beacon(1.0);
    let takes: Command = knob("takes beacon 60").into();
    let commands = [(0, takes), (20, Command::HandOver(ClockKind::Real))];
    let first = messages(&mut VirtualClock, &mut graph, &topic, &commands, at(100));
    assert_eq!(first, []);
    assert!(Observer::of(&graph).snapshot().nodes[0].busy);
    let back = [(200, Command::HandOver(ClockKind::Virtual))];
    let rest = messages(
        &mut RealClock::default(),
        &mut graph,
        &topic,
        &back,
        at(210),
    );
    assert_eq!(rest.len(), 1);
    assert!(rest[0].stamp >= at(60) && rest[0].data == at(0));
}

#[test]
fn nothing_is_released_after_the_end() {
    for clock in [
        &mut VirtualClock as &mut dyn Clock,
        &mut RealClock::default(),
    ] {
        let (mut graph, topic) = beacon(1.0);
        let takes = [(0, knob("takes beacon 1000").into())];
        assert_eq!(messages(clock, &mut graph, &topic, &takes, at(30)).len(), 0);
        assert_eq!(Observer::of(&graph).snapshot().nodes[0].ticks, 1);
    }
}

#[test]
fn a_single_step_is_a_tick_and_no_end_of_one() {
    let (mut graph, _) = beacon(100.0);
    let added = graph.node("other", 100.0, 1, |_| |_: Time| GO_ON);
    added.expect("a node");
    let (live, mut inbox) = Inbox::new(Vec::new());
    for command in [
        Command::Pause,
        knob("takes beacon 5").into(),
        Command::Step,
        Command::Step,
        Command::Step,
    ] {
        live.send(command).expect("open");
    }
    drop(live);
    let observer = Observer::of(&graph);
    VirtualClock
        .run(&mut graph, &mut inbox, at(1_000))
        .expect("no fault");
    let nodes = observer.snapshot().nodes;
    let ticks: Vec<_> = nodes.iter().map(|node| node.ticks).collect();
    // The end of the first tick, at 5 ms, lies between the second step and the third.
    assert_eq!(ticks, [2, 1]);
}

#[test]
fn the_actions_of_a_slow_policy_have_the_origin_of_their_reading() {
    let config = with(&["takes policy 13", "takes sensor 4"], Config::default());
    let RunBytes {
        summary, actions, ..
    } = run_bytes(&config);
    assert!(actions.len() > 400);
    for action in &actions {
        // The reading of the previous tick: sensed 20 ms before the policy began.
        let thought = action.origin.map(|sensed| sensed + ms(33));
        assert_eq!(Some(action.stamp), thought);
    }
    assert_eq!(summary.latency.max(), Some(ms(40)));
}

#[test]
fn what_a_robot_acts_on_is_as_old_under_both_clocks() {
    // With offsets nobody need decide who is first of those who are due together.
    let knobs = [
        "takes detector 60..110",
        "offset detector 4",
        "offset planner 7",
        "offset controller 2",
    ];
    let run = |clock| {
        let config = Config {
            clock,
            end: at(6_000),
            ..with(&knobs, Config::default())
        };
        let experiment = Experiment::new(Arc::new(Robot), &config).expect("a graph");
        experiment.run().expect("no fault")
    };
    let [modelled, real] = [ClockKind::Virtual, ClockKind::Real].map(run);
    let late = real
        .nodes
        .iter()
        .filter_map(|node| node.lateness.quantile(0.9))
        .max();
    if late > Some(ms(5)) {
        eprintln!("not compared: every tenth tick began {late:?} late on this machine, or later");
        return;
    }
    let median = |summary: &Summary| {
        summary
            .latency
            .quantile(0.5)
            .expect("a latency")
            .as_secs_f64()
    };
    let (modelled, real) = (median(&modelled), median(&real));
    println!("sense→act p50: {modelled} s in virtual time, {real} s on the real clock");
    assert!(
        (real / modelled - 1.0).abs() < 0.05,
        "{modelled} s, {real} s"
    );
}

/// The age of the push in force, on average over time (ms).
fn push_age(summary: &Summary) -> f64 {
    summary.push_age().expect("pushes").run_s * 1e3
}

#[test]
fn a_pole_stands_and_falls_by_the_age_of_its_push_under_both_clocks() {
    // Decisions of two periods and of four. The sensor is ahead of the policy, so that
    // nobody need decide who is first of those who are due together.
    for (think, falls) in [(35, false), (70, true)] {
        let asked = |clock| {
            let takes = format!("takes policy {think}");
            let own = Config {
                clock,
                end: at(4_000),
                ..own(0)
            };
            run(&with(&[&takes, "offset policy 2"], own))
        };
        let [modelled, real] = [ClockKind::Virtual, ClockKind::Real].map(asked);
        let [expected, age] = [&modelled, &real].map(push_age);
        println!(
            "{think} ms: {} at {expected} ms in virtual time, {} at {age} ms on the real clock",
            modelled.verdict, real.verdict
        );
        assert_eq!(modelled.verdict.is_lost(), falls, "{think} ms");
        if age < 85.0 {
            assert!(!real.verdict.is_lost(), "{think} ms: {age} ms");
        } else if falls {
            assert!(real.verdict.is_lost(), "{think} ms: {age} ms");
        } else {
            eprintln!("{think} ms not compared: this machine makes the push {age} ms old");
        }
    }
}
