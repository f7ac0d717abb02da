//! Nodes take messages while they run, and a policy node can switch to another policy:
//! between ticks, with a log entry, and reproducibly.

use std::{num::NonZeroUsize, ops::ControlFlow, thread, time::Duration};

use ratelab::{
    ClockKind, Event, GO_ON, Graph, Inbox, Knob, Node, Tick, Time, TimedCommand, VirtualClock, run,
};
use ratelab_cart_pole::{CartPole, POLICY, policy::Scripted};
use ratelab_effects::Effects;
use ratelab_real_clock::RealClock;
use ratelab_study::experiment::{
    Config, Experiment,
    sweep::{Sweep, SweepAxis},
};

use crate::{
    checkpoint::fixture,
    clone::root,
    support::{
        applied, at, cart_pole, collect, config, experiment, hz, knobs, refusal, refused,
        run_bytes, run_timed, secs, send_to, with_policy,
    },
};

/// Keeps the last text, refuses "no" and panics at "boom".
struct Listener(String);

impl Node for Listener {
    fn tick(&mut self, _: Time) -> Tick {
        GO_ON
    }

    fn on_message(&mut self, text: &str) -> Result<String, String> {
        match text {
            "boom" => panic!("boom it is"),
            "no" => Err("not that".to_owned()),
            _ => Ok(std::mem::replace(&mut self.0, text.to_owned())),
        }
    }
}

fn listener() -> Graph {
    let mut graph = Graph::with(Effects);
    let silent = Listener("nothing".to_owned());
    graph.node("a", hz(100.0), 0, |_| silent).expect("graph");
    graph
        .node("deaf", hz(100.0), 1, |_| |_| GO_ON)
        .expect("graph");
    graph
}

#[test]
fn a_node_handles_messages_under_either_clock_and_they_are_logged() {
    let said = || vec![at(0.01, send_to("a", "one")), at(0.02, send_to("a", "two"))];
    for real in [false, true] {
        let mut graph = listener();
        if real {
            run_timed(&mut RealClock::default(), &mut graph, said(), secs(0.05));
        } else {
            run_timed(&mut VirtualClock, &mut graph, said(), secs(0.05));
        }
        let events = graph.state().events(0);
        let lines: Vec<String> = events.iter().map(ToString::to_string).collect();
        assert_eq!(lines.len(), 2, "{lines:?}");
        assert!(lines[0].ends_with("a: one (was nothing)"), "{lines:?}");
        assert!(lines[1].ends_with("a: two (was one)"), "{lines:?}");
        let again: Vec<TimedCommand> = events.iter().filter_map(Event::replayable).collect();
        assert_eq!(again.len(), 2);
        assert!(real || again == said(), "{again:?}");
    }
}

#[test]
fn a_refused_message_is_logged_with_the_reason() {
    let said = vec![
        at(0.01, send_to("a", "no")),
        at(0.01, send_to("deaf", "one")),
        at(0.01, send_to("nobody", "one")),
    ];
    let mut graph = listener();
    run_timed(&mut VirtualClock, &mut graph, said, secs(0.05));
    let refused = refused(&graph.state().events(0));
    let reasons: Vec<&str> = refused.iter().map(|(_, reason)| &**reason).collect();
    let expected = [
        "not that",
        "this node takes no orders",
        "there is no node \"nobody\": expected one of a, deaf",
    ];
    assert_eq!(reasons, expected);
}

#[test]
fn a_node_that_panics_over_a_message_is_a_fault_with_its_name() {
    for kind in [ClockKind::Virtual, ClockKind::Real] {
        let mut graph = listener();
        let (_commands, mut inbox) = Inbox::new(vec![at(0.01, send_to("a", "boom"))]);
        let mut real = RealClock::default();
        let end = run(&mut graph, &mut inbox, secs(0.2), kind, &mut real);
        let fault = end.expect_err("a fault");
        assert_eq!(fault.node, "a");
        assert!(fault.cause.to_string().contains("boom it is"), "{fault}");
    }
}

fn actor() -> String {
    fixture(&root(), "actor.pt").display().to_string()
}

/// Ten seconds of the cart-pole with these timed knobs.
fn timed(list: &str) -> Config {
    let knobs = knobs(list);
    Config {
        knobs,
        ..Config::default()
    }
}

#[test]
fn a_run_that_swaps_policies_is_reproducible() {
    let actor = actor();
    let config = Config {
        end: secs(4.0),
        knobs: knobs(&format!(
            "0.5 policy lqr\n1 policy random\n1.1 policy scripted\n3 policy {actor}\n3.1 policy lqr"
        )),
        ..config("control-hz 25")
    };
    let first = run_bytes(&config);
    assert_eq!(applied(&first.summary.events).len(), 5);
    assert_eq!(first.bytes(), run_bytes(&config).bytes());
    let bare = Config {
        knobs: Vec::new(),
        ..config.clone()
    };
    let mut again = experiment(&bare);
    let events = first.summary.events.iter();
    again.schedule(events.filter_map(Event::replayable).collect());
    assert_eq!(collect(again).bytes(), first.bytes());
    assert_ne!(run_bytes(&bare).bytes(), first.bytes());
    let turned = first.summary.knobs();
    assert_eq!(turned, first.summary.config.knobs);
    assert_eq!(turned[0], config.knobs[0]);
    let file = turned[3].knob.value();
    assert!(file.starts_with(&format!("{actor}@sha256:")), "{file}");
}

#[test]
fn a_swap_to_the_same_policy_changes_nothing() {
    let bytes = |list| {
        let knobs = knobs(list);
        let config = config("control-hz 10");
        run_bytes(&Config { knobs, ..config }).bytes()
    };
    assert_eq!(bytes("2.503 policy scripted"), bytes(""));
}

#[test]
fn an_unavailable_or_impossible_policy_of_a_timed_swap_is_refused_before_the_run() {
    let missing = timed("9 policy no/such.pt");
    let error = refusal(&missing);
    assert!(error.starts_with("no/such.pt: expected"), "{error}");
    assert!(missing.resolved(&*cart_pole()).is_err());
    let slow = Config {
        setup: config("control-hz 0.001").setup,
        ..timed("9 policy lqr")
    };
    let error = refusal(&slow);
    assert!(
        error.starts_with("lqr: ") && error.contains("0.001 Hz"),
        "{error}"
    );
}

#[test]
fn a_resolved_configuration_names_the_content_of_every_file() {
    let actor = actor();
    let config = Config {
        knobs: knobs(&format!("1 policy lqr\n2 policy {actor}")),
        ..config(&format!("policy {actor}"))
    };
    let resolved = config.resolved(&*cart_pole()).expect("resolved");
    let turned = resolved.setup.iter();
    let turned = turned.chain(resolved.knobs.iter().map(|timed| &timed.knob));
    let texts: Vec<String> = turned.map(Knob::value).collect();
    assert_eq!(texts[1], "lqr");
    assert!(
        texts[0].contains("@sha256:") && texts[0] == texts[2],
        "{texts:?}"
    );
    let json = serde_json::to_string(&resolved).expect("JSON");
    assert_eq!(
        serde_json::from_str::<Config>(&json).expect("a configuration"),
        resolved
    );
    assert_eq!(resolved.resolved(&*cart_pole()).ok(), Some(resolved));
}

#[test]
fn a_file_is_read_only_once() {
    let folder = tempfile::tempdir().expect("folder");
    let file = folder.path().join("actor.pt");
    std::fs::copy(actor(), &file).expect("copied");
    let system = cart_pole();
    let config = Config {
        knobs: knobs(&format!("0.1 policy lqr\n0.2 policy {}", file.display())),
        end: secs(0.3),
        ..config(&format!("policy {}", file.display()))
    };
    let config = config.resolved(&*system).expect("weights");
    std::fs::remove_file(&file).expect("removed");
    let known = Experiment::new(system, &config).expect("experiment");
    let summary = known.run().expect("run");
    assert_eq!(summary.knobs().len(), 2, "{:?}", summary.events);
    // A new system has not read it yet.
    assert!(refusal(&config).contains("actor.pt"));
}

#[test]
fn a_sweep_reads_the_file_of_a_policy_once_before_its_first_run() {
    let folder = tempfile::tempdir().expect("folder");
    let [base, listed] = ["base.pt", "listed.pt"].map(|name| {
        let file = folder.path().join(name);
        std::fs::copy(actor(), &file).expect("copied");
        file
    });
    let policies = format!("{},lqr", listed.display());
    let knobs = format!("0.1 policy {}", base.display());
    let config = Config {
        end: secs(0.2),
        ..timed(&knobs)
    };
    let sweep = Sweep {
        axes: vec![SweepAxis::parse(CartPole::KNOBS, "policy", &policies).expect("an axis")],
        seeds: (0..3).collect(),
        ..Sweep::of(cart_pole(), config)
    };
    let swept = sweep.run(NonZeroUsize::MIN, |_, _| {
        for file in [&base, &listed] {
            let _ = std::fs::remove_file(file);
        }
        ControlFlow::Continue(())
    });
    assert!(swept.expect("a sweep").is_complete());
}

#[test]
fn a_swap_that_fails_leaves_the_policy_as_it_is() {
    let config = Config {
        end: secs(2.0),
        ..Config::default()
    };
    let mut swapped = experiment(&config);
    swapped.schedule(vec![at(1.0, send_to(POLICY, "no/such.pt"))]);
    let swapped = collect(swapped);
    let [(_, reason)] = &refused(&swapped.summary.events)[..] else {
        panic!("{:?}", swapped.summary.events);
    };
    assert!(reason.contains("no/such.pt"), "{reason}");
    assert_eq!(swapped.bytes(), run_bytes(&config).bytes());
}

#[test]
fn a_policy_of_the_callers_own_is_not_swapped() {
    let own = Experiment::new(with_policy(Scripted), &Config::default());
    let mut own = own.expect("experiment");
    own.schedule(vec![at(1.0, send_to(POLICY, "lqr"))]);
    let summary = own.run().expect("run");
    let (_, reason) = &refused(&summary.events)[0];
    assert!(reason.contains("cannot be swapped"), "{reason}");
}

#[test]
fn policies_are_swapped_under_the_real_clock_while_the_pole_stays_up() {
    let experiment = experiment(&Config {
        clock: ClockKind::Real,
        end: secs(0.6),
        ..Config::default()
    });
    let commands = experiment.commands();
    let person = thread::spawn(move || {
        for policy in ["lqr", "scripted", "lqr"] {
            thread::sleep(Duration::from_millis(100));
            commands.send(send_to(POLICY, policy)).expect("a run");
        }
    });
    let summary = experiment.run().expect("run");
    person.join().expect("a person");
    assert!(!summary.verdict.is_lost());
    let swaps = summary.knobs();
    let swaps: Vec<String> = swaps.iter().map(|timed| timed.knob.value()).collect();
    assert_eq!(swaps, ["lqr", "scripted", "lqr"]);
}
