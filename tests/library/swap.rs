//! Nodes take messages while they run, and a policy node can switch to another policy:
//! between ticks, with a log entry, and reproducibly.

use std::{fs, num::NonZeroUsize, ops::ControlFlow};

use ratelab_experiment::sweep::{Sweep, SweepAxis};

use crate::{checkpoint::fixture, clone::root, support::*};

/// Keeps the last text, refuses "no" and panics at "boom".
struct Listener(String);

impl Node for Listener {
    fn tick(&mut self, _: &mut Tick) -> TickResult {
        Ok(Flow::Continue)
    }

    fn on_order(&mut self, text: &str) -> Result<String, NodeError> {
        match text {
            "boom" => panic!("boom it is"),
            "no" => Err("not that".into()),
            _ => Ok(std::mem::replace(&mut self.0, text.to_owned())),
        }
    }
}

/// A graph with such a node, and one that takes no messages.
pub fn listener() -> Graph {
    let mut graph = Graph::new();
    let silent = Listener("nothing".to_owned());
    graph.node("a", 100.0, 0, |_| silent).expect("graph");
    worker(&mut graph, "deaf", 100.0, 1, |_: &mut Tick| {});
    graph
}

#[test]
fn a_node_handles_messages_under_either_clock_and_they_are_logged() {
    let said = "0.01 send a one; 0.02 send a two";
    for (mut clock, exact) in clocks().into_iter().zip([true, false]) {
        let mut graph = listener();
        run_timed(&mut *clock, &mut graph, said, secs(0.05));
        let lines = events(&graph);
        assert_eq!(lines.len(), 2, "{lines:?}");
        assert!(lines[0].ends_with("a: one (was nothing)"), "{lines:?}");
        assert!(lines[1].ends_with("a: two (was one)"), "{lines:?}");
        let events = graph.state().events(0);
        let again: Vec<TimedCommand> = events.iter().filter_map(Event::replayable).collect();
        assert_eq!(again.len(), 2);
        assert!(!exact || again == timed(said), "{again:?}");
    }
}

#[test]
fn a_message_of_the_setup_is_handled_before_the_run_or_refused() {
    let listener = system(|builder| builder.node("a", 10.0, 0, |_| Listener("nothing".to_owned())));
    let summary = run_of(
        listener.clone(),
        &config("until 0.2; send a one; 0.1 send a two"),
    );
    let events = summary.events.iter().map(ToString::to_string);
    assert_eq!(events.collect::<Vec<_>>(), ["0.100 s: a: two (was one)"]);
    assert_eq!(
        refusal_of(listener, &config("send a no")),
        "send a no: not that"
    );
}

#[test]
fn a_node_that_panics_over_a_message_is_a_fault_with_its_name() {
    for mut clock in clocks() {
        let (_commands, mut inbox) = Inbox::new(timed("0.01 send a boom"));
        let end = clock.run(&mut listener(), &mut inbox, secs(0.2));
        let fault = end.expect_err("a fault");
        assert_eq!(fault.node, "a");
        assert!(fault.cause.to_string().contains("boom it is"), "{fault}");
    }
}

fn actor() -> String {
    fixture(&root(), "actor.pt").display().to_string()
}

/// A copy of it in `folder`.
fn copied(folder: &tempfile::TempDir, name: &str) -> String {
    let file = folder.path().join(name);
    fs::copy(actor(), &file).expect("copied");
    file.display().to_string()
}

#[test]
fn a_run_that_swaps_policies_is_reproducible() {
    let actor = actor();
    let list = "0.5 policy lqr; 1 policy random; 1.1 policy scripted";
    let list = format!("{list}; 3 policy {actor}; 3.1 policy lqr");
    let config = config(&format!("until 4; control-hz 25; {list}"));
    let first = run_bytes(&config);
    assert_eq!(applied(&first.summary.events).len(), 5);
    assert_eq!(first.bytes(), run_bytes(&config).bytes());
    let turned = first.summary.knobs();
    assert_eq!(turned, first.summary.config.knobs);
    assert_eq!(turned[0], config.knobs[0]);
    let file = turned[3].knob.value();
    assert!(file.starts_with(&format!("{actor}@sha256:")), "{file}");
}

#[test]
fn a_swap_to_the_same_policy_changes_nothing() {
    let [plain, swapped] = ["control-hz 10", "control-hz 10; 2.503 policy scripted"]
        .map(|run| run_bytes(&config(run)).bytes());
    assert_eq!(swapped, plain);
}

#[test]
fn an_unavailable_or_impossible_policy_of_a_timed_swap_is_refused_before_the_run() {
    let missing = config("9 policy no/such.pt");
    let error = refusal(&missing);
    assert!(error.starts_with("no/such.pt: expected"), "{error}");
    assert!(missing.resolved(&*cart_pole()).is_err());
    let error = refusal(&config("control-hz 0.001; 9 policy lqr"));
    assert!(
        error.starts_with("lqr: ") && error.contains("0.001 Hz"),
        "{error}"
    );
}

#[test]
fn a_resolved_configuration_names_the_content_of_every_file() {
    let actor = actor();
    let config = config(&format!("policy {actor}; 1 policy lqr; 2 policy {actor}"));
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
    let file = copied(&folder, "actor.pt");
    let system = cart_pole();
    let turns = format!("policy {file}; 0.1 policy lqr; 0.2 policy {file}");
    let config = config(&format!("until 0.3; {turns}")).resolved(&*system);
    let config = config.expect("weights");
    fs::remove_file(&file).expect("removed");
    let summary = run_of(system, &config);
    assert_eq!(summary.knobs().len(), 2, "{:?}", summary.events);
    // A new system has not read it yet.
    assert!(refusal(&config).contains("actor.pt"));
}

#[test]
fn a_sweep_reads_the_file_of_a_policy_once_before_its_first_run() {
    let folder = tempfile::tempdir().expect("folder");
    let [base, listed] = ["base.pt", "listed.pt"].map(|name| copied(&folder, name));
    let policies = SweepAxis::parse(CartPole::KNOBS, "policy", &format!("{listed},lqr"));
    let config = config(&format!("until 0.2; 0.1 policy {base}"));
    let sweep = Sweep {
        axes: vec![policies.expect("an axis")],
        seeds: (0..3).collect(),
        ..Sweep::new(cart_pole(), config)
    };
    let swept = sweep.run(NonZeroUsize::MIN, |_, _| {
        for file in [&base, &listed] {
            let _ = fs::remove_file(file);
        }
        ControlFlow::Continue(())
    });
    assert!(swept.expect("a sweep").is_complete());
}

#[test]
fn a_swap_that_fails_leaves_the_policy_as_it_is() {
    let config = config("until 2");
    let mut swapped = experiment(&config);
    swapped.schedule(timed("1 send policy no/such.pt"));
    let swapped = collect(swapped);
    let reasons = refused(&swapped.summary.events);
    assert!(
        reasons.len() == 1 && reasons[0].contains("no/such.pt"),
        "{reasons:?}"
    );
    assert_eq!(swapped.bytes(), run_bytes(&config).bytes());
}

#[test]
fn a_policy_of_the_callers_own_is_not_swapped() {
    let own = Experiment::new(with_policy(|_| 0.0), &Config::default());
    let mut own = own.expect("experiment");
    own.schedule(timed("0.1 send policy lqr"));
    let reasons = refused(&own.run().expect("run").events);
    assert!(reasons[0].contains("cannot be swapped"), "{reasons:?}");
}

#[test]
fn policies_are_swapped_under_the_real_clock_while_the_pole_stays_up() {
    let swaps = "0.1 policy lqr; 0.2 policy scripted; 0.3 policy lqr";
    let summary = run(&config(&format!("real; until 0.5; {swaps}")));
    check(swaps, &summary, "verdict balanced");
    let turned = summary.knobs();
    for (turned, asked) in turned.iter().zip(&summary.config.knobs) {
        assert!(
            turned.at >= asked.at,
            "{turned:?} was asked for at {}",
            asked.at
        );
    }
    let turned: Vec<String> = turned.iter().map(|timed| timed.knob.value()).collect();
    assert_eq!(turned, ["lqr", "scripted", "lqr"]);
}
