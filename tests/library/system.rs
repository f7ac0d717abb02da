//! A graph as a value: it is built according to its setup, or refused with the available names.

use proptest::prelude::*;

use crate::{support::*, table::rows};

#[test]
fn a_graph_begins_with_its_setup_and_the_systems_defaults() {
    let experiment = experiment(&config("rate sensor 40; queue-depth 7; policy zero"));
    let snapshot = experiment.observer().snapshot();
    let rates = snapshot.nodes.iter().map(|node| node.hz);
    assert_eq!(rates.collect::<Vec<_>>(), [40.0, 50.0, 50.0].map(hz));
    let depths = [OBS, ACTION].map(|name| snapshot.topic(name).expect(name).depth);
    assert_eq!(depths, [depth(7); 2]);
    let summary = experiment.run().expect("run");
    check("zero", &summary, "verdict pole_fell");
    assert_eq!(summary.knobs(), [], "a setup is no event of the run");
}

#[test]
fn only_topics_with_fields_are_recorded() {
    let oven = system(|builder| {
        let (push, heat) = (builder.topic("/push"), builder.internal_topic("/heat"));
        builder.node("oven", 20.0, 0, move |wiring| {
            let (push, heat) = (wiring.publisher(&push), wiring.publisher(&heat));
            move |tick: &mut Tick| {
                tick.publish(&push, Action(0.0));
                tick.publish(&heat, 0.0);
            }
        })
    });
    let taps = Experiment::new(oven, &Config::default()).expect("a graph");
    let taps = taps.taps();
    let topics = taps.topics().iter().map(|topic| topic.name());
    assert_eq!(topics.collect::<Vec<_>>(), ["/push"]);
    assert!(taps.rows("/heat", 1).is_none());
    assert!(taps.messages::<Action>("/push", 1).is_some());
    assert!(taps.messages::<f64>("/push", 1).is_none());
}

#[test]
fn a_knob_that_the_graph_refuses_fails_the_build_with_the_reason() {
    for [knob, reason] in rows(
        r#"
        rate planner 5       | there is no node "planner": expected one of NODES
        crash nobody         | there is no node "nobody": expected one of NODES
        send planner stop    | there is no node "planner": expected one of NODES
        depth /map 2         | there is no topic "/map": expected one of TOPICS
        read /nothing oldest | there is no topic "/nothing": expected one of TOPICS
        link /state delay:3  | /state has no reader: expected one of /obs, /action
        send sensor open     | this node takes no orders
        crash world          | the world moves by itself: WHAT ELSE
        clock world 1 0      | the world moves by itself: WHAT ELSE
        rate world 10        | the world moves by itself: WHAT ELSE
        takes world 5        | the world moves by itself: WHAT ELSE
        offset world 5       | the world moves by itself: WHAT ELSE
        wakes world 5        | the world moves by itself: WHAT ELSE
        "#,
    ) {
        let reason = reason.replace("NODES", "world, sensor, policy, actuator");
        let reason = reason.replace("TOPICS", "/state, /obs, /action");
        let reason = reason.replace("WHAT ELSE", "choose a node of the robot");
        let expected = format!("{knob}: {reason}");
        assert_eq!(refusal(&own(0, &knob)), expected);
        if reason.starts_with("there is no") {
            assert_eq!(refusal(&own(0, &format!("3 {knob}"))), expected);
        }
    }
    let slow = "rate actuator 25";
    let actuator = refusal(&config(slow));
    assert!(actuator.contains("20 ms of the plant's time"), "{actuator}");
    check(slow, &run(&own(0, slow)), "ticks actuator 251");
}

#[test]
fn an_alias_has_its_set_value_or_its_default() {
    for [name, setup, value] in rows(
        "control-hz  |                             | 50
         control_hz  | rate policy 2.5             | 2.5
         queue-depth | depth /obs 3; depth /action 4 | 3
         policy      | policy zero; send policy lqr | lqr",
    ) {
        let alias = CartPole::KNOBS.alias(&name).expect(&name);
        assert_eq!(alias.value(&config(&setup).setup), value, "{name}: {setup}");
    }
    assert_eq!(CartPole::KNOBS.alias("planner-hz"), None);
}

fn any_knob() -> impl Strategy<Value = Knob> {
    let (name, value) = (prop::sample::select(vec!["a", "b", "c"]), 1..9u8);
    let kind = prop::sample::select(vec!["rate", "depth", "send"]);
    (kind, name, value).prop_map(|(kind, name, value)| knob(&format!("{kind} {name} {value}")))
}

proptest! {
    #[test]
    fn a_setup_has_the_last_setting_of_everything_in_the_order_of_the_first(
        knobs in proptest::collection::vec(any_knob(), 0..20),
    ) {
        let setup: Setup = knobs.iter().cloned().collect();
        let mut expected: Vec<Knob> = Vec::new();
        for knob in &knobs {
            if !expected.iter().any(|known| known.is_of(knob)) {
                let last = knobs.iter().rfind(|last| last.is_of(knob));
                expected.extend(last.cloned());
            }
        }
        prop_assert!(setup.iter().eq(&expected), "{:?}", setup);
        let one_by_one = knobs.into_iter().fold(Setup::default(), Setup::with);
        prop_assert_eq!(&one_by_one, &setup);
        for knob in &expected {
            let set = match knob {
                Knob::Rate { node, .. } => setup.rate(node).map(|hz| hz.get().to_string()),
                Knob::Depth { topic, .. } => setup.depth(topic).map(|depth| depth.to_string()),
                Knob::Send { node, .. } => setup.message(node).map(str::to_owned),
                _ => continue,
            };
            prop_assert_eq!(set, Some(knob.value()));
        }
        prop_assert_eq!(setup.rate("d"), None);
    }
}

#[test]
fn a_crash_after_a_restart_comes_after_it() {
    let knobs = ["crash a", "restart a", "rate a 5", "crash a", "rate a 7"];
    let setup: Setup = knobs.map(knob).into_iter().collect();
    let texts: Vec<String> = setup.iter().map(ToString::to_string).collect();
    assert_eq!(texts, ["restart a", "rate a 7", "crash a"]);
}

#[test]
fn a_resolved_setup_keeps_its_order() {
    // A crash clears a hang that was set before it, and none that is set after it.
    let texts = ["crash actuator", "hang actuator 300", "rate policy 20"];
    let resolved = config(&texts.join("; ")).resolved(&*cart_pole());
    let resolved = resolved.expect("a config");
    let kept = resolved.setup.iter().map(Knob::to_string);
    let kept: Vec<String> = kept.filter(|knob| texts.contains(&&**knob)).collect();
    assert_eq!(kept, texts);
}

#[test]
fn nodes_that_share_the_plant_are_in_one_process() {
    for [nodes, said] in rows(
        "policy          |
         actuator sensor |
         sensor policy   | sensor and actuator share the plant: run them in one process, as plant
         polic           | there is no node \"polic\": expected some of sensor, policy, actuator",
    ) {
        let here: Vec<String> = nodes.split(' ').map(str::to_owned).collect();
        let part = Experiment::part(cart_pole(), &config(""), &here);
        let refused = part.err().map(|error| error.to_string());
        assert_eq!(refused.unwrap_or_default(), said, "{nodes}");
    }
}

#[test]
fn a_message_used_to_build_a_node_is_not_sent_to_it() {
    // It takes none after it is built.
    let clock = || {
        system(|builder| {
            let alarm = builder.message("clock").unwrap_or("9").parse();
            let alarm = alarm.map_err(|_| BuildError::Setting("no time".to_owned()))?;
            builder.node("clock", 10.0, 0, move |_| {
                move |tick: &mut Tick| {
                    if tick.now() < secs(alarm) {
                        Flow::Continue
                    } else {
                        Flow::End
                    }
                }
            })
        })
    };
    let summary = run_of(clock(), &config("send clock 2"));
    assert_eq!(summary.verdict.to_string(), "ENDED at 2.000 s (by a node)");
    assert_eq!((summary.steps, &summary.state[..]), (0, &[][..]));
    let noon = refusal_of(clock(), &config("send clock noon"));
    assert_eq!(noon, "no time");
}

#[test]
fn a_graph_of_the_library_runs_with_its_settings_and_is_recorded() {
    let library = system(|builder| {
        let steps = Topic::new("/step", depth(1));
        builder.record(&steps);
        let graph = builder.graph();
        talker(graph, "oven", 10.0, 0, &steps, |_| Some(Action(0.0)));
        reader(graph, "thermostat", 1.0, 1, &steps);
        Ok(())
    });
    let config = config("rate thermostat 2; depth /step 3; takes oven 5");
    let experiment = Experiment::new(library.clone(), &config).expect("experiment");
    assert!(experiment.taps().rows("/step", 4).is_some());
    let summary = experiment.run().expect("run");
    // The message of the last tick would come after the end. Five messages between two ticks, three
    // of which are kept.
    let figures = "published /step 100; ticks thermostat 21; spent oven 500; dropped /step 40";
    check("library", &summary, figures);
    let part = Experiment::part(library, &config, &["oven".to_owned()]);
    let refused = part.err().expect("no experiment").to_string();
    assert!(refused.contains("one process"), "{refused}");
}
