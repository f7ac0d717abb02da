//! Duration, lateness and due times of ticks, set by knobs, under both clocks. The
//! virtual clock's bytes are tested in `golden.rs`.

use std::fs;

use ratelab_system::measured;

use crate::{own_costs::FourNodes, support::*, table::rows};

/// The knob `text`, with durations as if loaded from its file.
fn loaded(text: &str, durations: &[Duration]) -> Result<Knob, String> {
    measured::loaded(knob(text), |_, _| Ok(durations.to_vec()))
}

/// What comes of `knob` where its file has these durations now.
fn read_again(knob: &Knob, durations: &[Duration]) -> Result<Measurements, SettingError> {
    let Some(Draw::Measured(measured)) = knob.draw() else {
        panic!("{knob} names no file");
    };
    measured.with_durations(durations.to_vec())
}

#[test]
fn measured_costs_are_loaded_before_the_run_and_known_by_their_digest() {
    let missing = refusal(&config("takes policy recorded:real.rrd"));
    assert!(missing.contains("real.rrd were not loaded"), "{missing}");
    let [costs, sorted] = [[7, 3, 5], [3, 5, 7]].map(|costs| costs.map(ms));
    // The order counts in a file alone.
    for (source, has_order) in [("recorded:real.rrd", false), ("file:model.csv", true)] {
        let text = format!("takes policy {source}");
        let pinned = loaded(&text, &costs).expect("loaded");
        let printed = pinned.to_string();
        assert!(printed.starts_with(&format!("{text}@sha256:")), "{printed}");
        read_again(&pinned, &costs).expect("the same");
        assert_eq!(read_again(&pinned, &sorted).is_err(), has_order, "{source}");
        let changed = read_again(&pinned, &costs[..1]).expect_err("others");
        let (_, file) = source.split_once(':').expect("a file");
        assert!(
            changed
                .to_string()
                .contains(&format!("{file} has other durations")),
            "{changed}"
        );
        assert!(loaded(&text, &[]).is_err());
    }
}

#[test]
fn a_file_of_measured_costs_is_a_column_of_milliseconds() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("model.csv");
    let read = |content: &[u8]| {
        fs::write(&path, content).expect("written");
        measured::read_column(&path)
    };
    for content in [
        "900\n12.5\n0",
        "900\r\n12.5\r\n0\r\n",
        "latency_ms\n900\n12.5\n0\n",
        "\"latency (ms)\"\r\n\r\n 900 # cold\r\n+1.25e1\r\n0",
        "\u{feff}# of the real model\n\nms\n900\n#12\n12.5\n\n0\n\n",
    ] {
        let expected = [ms(900), Duration::from_micros(12_500), ms(0)];
        assert_eq!(read(content.as_bytes()), Ok(expected.to_vec()), "{content}");
    }
    for (content, part) in [
        (
            "12\nsoon\n",
            r#"model.csv: line 2: "soon" is not a duration"#,
        ),
        (
            "12,5\n",
            r#"line 1: "12,5" is not a duration: expected milliseconds"#,
        ),
        ("12 ms\n", r#"line 1: "12 ms""#),
        ("# tick,ms\r\n\r\n1\t12", r#"line 3: "1\t12""#),
        ("tick,ms\n0,12", r#"line 1: "tick,ms""#),
        ("ms\nms\n12", r#"line 2: "ms""#),
        ("ms\n-0.1", r#"line 2: "-0.1""#),
        ("NaN\n12", r#"line 1: "NaN""#),
        ("1\n\n1e300", r#"line 3: "1e300""#),
        ("ms\r\n# none yet\r\n", "no number is in it"),
    ] {
        let error = read(content.as_bytes()).expect_err(content);
        assert!(error.contains(part), "{content:?}: {error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
    assert!(read(b"12\n\xff").expect_err("bytes").contains("UTF-8"));
    let large = read(&vec![b'\n'; 9 << 20]).expect_err("too large");
    assert!(large.contains("found 9437184 bytes"), "{large}");
}

#[test]
fn the_costs_of_a_file_come_in_its_order_again_and_again_or_are_drawn() {
    let column = [ms(30), ms(10), ms(20)];
    let costs = |clock: &mut dyn Clock, at: &str, takes: &str| {
        let (mut graph, topic) = beacon(10.0);
        let tap = TapHandle::new(&graph).topic(&topic, 1_000);
        let at = Time::from_secs_f64(at.parse().expect("seconds")).expect("a time");
        let command = loaded(takes, &column).expect("loaded").into();
        let (_, mut inbox) = Inbox::new(vec![TimedCommand { at, command }]);
        clock
            .run(&mut graph, &mut inbox, at_ms(690))
            .expect("no fault");
        let sent = tapped(&tap);
        let costs = sent.iter().map(|message| message.stamp - message.data);
        costs.collect::<Vec<_>>()
    };
    let modelled = |at: &str, takes: &str| costs(&mut VirtualClock, at, takes);
    let in_order = modelled("0", "takes beacon file:model.csv");
    let again = [30, 10, 20, 30, 10, 20, 30].map(ms);
    assert_eq!(in_order, again);
    // A tick has its number whenever the knob was turned.
    let late = modelled("0.15", "takes beacon file:model.csv");
    assert_eq!((&late[..2], &late[2..]), (&[ms(0); 2][..], &again[2..]));
    let halved = modelled("0", "takes beacon 0.5 * file:model.csv");
    assert_eq!(halved, again.map(|cost| cost / 2));
    let drawn = modelled("0", "takes beacon drawn:model.csv");
    assert_ne!(drawn, again);
    assert!(drawn.iter().all(|cost| column.contains(cost)), "{drawn:?}");
    assert_eq!(drawn, modelled("0", "takes beacon recorded:real.rrd"));
    // The first tick may have begun before the command.
    let real = costs(
        &mut RealClock::default(),
        "0",
        "takes beacon busy file:model.csv",
    );
    let pairs = real.iter().zip(&again).skip(1);
    pairs.for_each(|(spent, cost)| assert!(spent >= cost, "{real:?}"));
}

#[test]
fn a_live_knob_is_logged_with_its_old_value() {
    let turns = "1 takes policy 30; 2 offset policy 3.5; 3 takes policy none; 4 control-hz 2.5";
    let events = run(&config(turns)).events;
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
    let (mut graph, began) = (Graph::new(), Topic::new("/began", Depth::ONE));
    talker(&mut graph, "beacon", hz, 0, &began, Some);
    (graph, began)
}

fn messages(
    clock: &mut dyn Clock,
    graph: &mut Graph,
    topic: &Topic<Time>,
    commands: &str,
    until: u64,
) -> Vec<Message<Time>> {
    let tap = TapHandle::new(graph).topic(topic, 1_000);
    run_timed(clock, graph, commands, at_ms(until));
    tapped(&tap)
}

/// What a clock with this error (ns, 10⁻¹², ns) since 7 ms shows at a run time (ns).
fn shown(now: i128, [offset, drift, step]: [i128; 3]) -> i128 {
    let exact = now + offset + ((now - 7_000_000) * drift).div_euclid(1_000_000_000_000);
    exact - exact.rem_euclid(step)
}

#[test]
fn a_tick_is_due_at_the_first_nanosecond_at_which_its_clock_shows_it() {
    for (error, nanos) in [
        ("0 0", [0, 0, 1]),
        ("3 250000", [3_000_000, 250_000_000_000, 1]),
        ("-2 -400000", [-2_000_000, -400_000_000_000, 1]),
        ("0.000001 0.5", [1, 500_000, 1]),
        ("-0.5 -33.3", [-500_000, -33_300_000, 1]),
        ("0 0 0.00001", [0, 0, 10]),
        ("-0.5 -33.3 1.5", [-500_000, -33_300_000, 1_500_000]),
    ] {
        let (mut graph, topic) = beacon(1_000.0);
        let turned = format!("0.007 clock beacon {error}");
        let ticks = messages(&mut VirtualClock, &mut graph, &topic, &turned, 60);
        // From 15 ms on: the first due times belong to the clock without an error.
        let ticks = ticks.iter().map(|tick| tick.data.as_nanos());
        let ticks: Vec<u64> = ticks.filter(|at| *at > 15_000_000).collect();
        let first = |due: u64| {
            let (mut before, mut at) = (0, 200_000_000);
            while at - before > 1 {
                let middle = u64::midpoint(before, at);
                if shown(middle.into(), nanos) >= due.into() {
                    at = middle;
                } else {
                    before = middle;
                }
            }
            at
        };
        let mut due: Vec<u64> = (1..100).map(|ms| first(ms * 1_000_000)).collect();
        due.dedup();
        due.retain(|at| (15_000_001..=60_000_000).contains(at));
        assert_eq!(ticks, due, "{error}");
        assert!(ticks.len() > 20, "{error}: {} ticks", ticks.len());
    }
}

#[test]
fn the_real_clock_spends_the_cost_and_publishes_at_its_end() {
    for spec in ["12", "busy 12"] {
        let (mut graph, topic) = beacon(50.0);
        let takes = format!("0 takes beacon {spec}");
        let real = &mut RealClock::default();
        let sent = messages(real, &mut graph, &topic, &takes, 100);
        assert!(!sent.is_empty());
        // The first tick may have begun before the command.
        for message in sent.iter().skip(1) {
            assert_eq!(message.origin, Some(message.data));
            let took = message.stamp - message.data;
            assert!(took >= ms(12), "{spec}: {message:?}");
        }
        let beacon = &snapshot(&graph).nodes[0];
        assert_eq!(beacon.ticks + beacon.overruns, 6, "{spec}");
    }
}

#[test]
fn a_tick_continues_under_the_other_clock() {
    let (mut graph, topic) = beacon(1.0);
    let commands = "0 takes beacon 60; 0.02 real";
    let first = messages(&mut VirtualClock, &mut graph, &topic, commands, 100);
    assert_eq!(first, []);
    assert!(snapshot(&graph).nodes[0].busy);
    let real = &mut RealClock::default();
    let rest = messages(real, &mut graph, &topic, "0.2 virtual", 210);
    assert_eq!(rest.len(), 1);
    assert!(rest[0].stamp >= at_ms(60) && rest[0].data == at_ms(0));
}

#[test]
fn nothing_is_released_after_the_end() {
    for mut clock in clocks() {
        let (mut graph, topic) = beacon(1.0);
        let takes = "0 takes beacon 1000";
        assert_eq!(messages(&mut *clock, &mut graph, &topic, takes, 30), []);
        assert_eq!(snapshot(&graph).nodes[0].ticks, 1);
    }
}

#[test]
fn a_single_step_is_a_tick_and_no_end_of_one() {
    let (mut graph, _) = beacon(100.0);
    worker(&mut graph, "other", 100.0, 1, |_: &mut Tick| {});
    let observer = Observer::new(&graph);
    let (live, mut inbox) = Inbox::new(Vec::new());
    for text in ["pause", "takes beacon 5", "step", "step", "step"] {
        live.send(command(text)).expect("open");
    }
    drop(live);
    let end = VirtualClock.run(&mut graph, &mut inbox, at_ms(1_000));
    end.expect("no fault");
    let nodes = observer.snapshot().nodes;
    let ticks: Vec<_> = nodes.iter().map(|node| node.ticks).collect();
    // The end of the first tick, at 5 ms, lies between the second step and the third.
    assert_eq!(ticks, [2, 1]);
}

#[test]
fn what_a_robot_acts_on_is_as_old_under_both_clocks() {
    // With offsets nobody need decide who is first of those who are due together.
    let setup = "takes detector 60..110; offset detector 4; offset planner 7; offset controller 2";
    let [modelled, real] = ["", "real; "].map(|clock| {
        run_of(
            Arc::new(FourNodes),
            &config(&format!("{clock}{setup}; until 6")),
        )
    });
    let late = real.nodes.iter();
    let late = late.filter_map(|node| node.lateness.quantile(0.9)).max();
    if late > Some(ms(5)) {
        eprintln!("not compared: every tenth tick began {late:?} late on this machine, or later");
        return;
    }
    let [modelled, real] = [modelled, real].map(|summary| {
        let median = summary.latency.quantile(0.5);
        median.expect("a latency").as_secs_f64()
    });
    println!("sense→act p50: {modelled} s in virtual time, {real} s on the real clock");
    assert!(
        (real / modelled - 1.0).abs() < 0.05,
        "{modelled} s, {real} s"
    );
}

#[test]
fn a_pole_stands_and_falls_by_the_age_of_its_push_under_both_clocks() {
    // Decisions of two periods and of four. The sensor is ahead of the policy, so that
    // nobody need decide who is first of those who are due together.
    for (think, falls) in [(35, false), (70, true)] {
        let setup = format!("takes policy {think}; offset policy 2; until 4");
        let [modelled, real] = ["", "real; "].map(|clock| run(&own(0, &format!("{clock}{setup}"))));
        let age = |run: &Summary| run.push_age().expect("pushes").run_s * 1e3;
        let [expected, age] = [&modelled, &real].map(age);
        println!(
            "{think} ms: {} at {expected} ms in virtual time, {} at {age} ms on the real clock",
            modelled.verdict, real.verdict
        );
        assert_eq!(modelled.verdict.is_lost(), falls, "{think} ms");
        // One late wake-up loses a pole whose mean age would not.
        let longest = real.nodes.iter().filter_map(|node| node.lateness.max());
        let is_steady = longest.max() < Some(Duration::from_millis(20));
        if is_steady && (age < 85.0 || falls) {
            assert_eq!(real.verdict.is_lost(), age >= 85.0, "{think} ms: {age} ms");
        } else {
            eprintln!("{think} ms not compared: this machine makes the push {age} ms old");
        }
    }
}

/// A node that takes 15 ms, and 60 ms in each hundredth tick or so.
const LATE_NODE: &str = r#"
name = "g"
[node.n]
rate = 50
takes = "lognormal:12,60"
"#;

#[test]
fn lateness_is_that_of_all_ticks_under_both_clocks_and_in_executors() {
    let lateness = |kind: &str, clock: &str, seconds: f64| {
        let executor = match kind {
            "skip" | "catch-up" => format!("offset = 20\nlate = \"{kind}\"\n"),
            kind => format!("[executor.e]\nkind = \"{kind}\"\n"),
        };
        let text = format!("{LATE_NODE}{executor}");
        let summary = run_graph(&text, seconds, clock);
        let node = summary.node("n").expect("a node");
        assert_eq!(node.lateness.count(), node.ticks, "{kind} {clock}");
        node.lateness.clone()
    };
    let kinds = ["single", "multi:2", "let", "skip"];
    for kind in kinds {
        lateness(kind, "", 10.0);
    }
    for kind in ["skip", "catch-up", "events", "single"] {
        lateness(kind, "real", 0.3);
    }
    // Those whose due times wait are late by the same, wherever they wait.
    let late = ["catch-up", "events", "fixed-priority:1"].map(|kind| {
        let late = lateness(kind, "", 10.0);
        (late.count(), late.sum(), late.max())
    });
    assert!(late[0].2 > Some(ms(20)), "{late:?}");
    assert_eq!(late[0], late[1]);
    // A preemptive executor has its timers from run time zero on.
    assert!(late[2].0 >= late[0].0, "{late:?}");
}

#[test]
fn due_times_that_pass_in_a_long_tick_are_skipped_or_wait_as_late_has_it() {
    for [late, figures] in rows(
        "skip     | ticks policy 497; overruns policy 4
         queue:1  | ticks policy 498; overruns policy 3
         queue:3  | ticks policy 500; overruns policy 1
         queue:4  | ticks policy 501; overruns policy 0
         catch-up | ticks policy 501; overruns policy 0",
    ) {
        let text = format!("takes policy 3; late policy {late}; 1 hang policy 95");
        check(&late, &run(&config(&text)), &figures);
    }
}
