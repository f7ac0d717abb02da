//! Robots with an inner loop: two controllers that were one, and what each of them bears.

use std::{fs, sync::Arc};

use ratelab_experiment::Summary;
use ratelab_plant::{BearableDelay, COMMAND, INNER_OBS, RobotPlant};
use ratelab_system::{Setup, System, graph_file::GraphFile};

use crate::{
    clone::root,
    plants::{check_refused, fixture, folder, ill_refused, opened, text},
    support::*,
};

/// The quadrotor with these keys beside its limits.
fn quad(keys: &str) -> Arc<dyn System> {
    let keys = format!("limits = {{ x = 1, z = 1 }}\n{keys}");
    opened(folder(&fixture("quad")).path(), &text(&keys)).expect(&keys)
}

#[test]
fn two_loops_at_one_rate_are_the_controller_that_they_were_split_from() {
    let [one, two] = ["", "inner = [\"pitch\"]"].map(|keys| {
        let run = run_of(quad(keys), &config("until 5; rate actuator 1000"));
        assert_eq!(run.verdict.name(), "stood", "{keys}");
        run.state
    });
    for (one, two) in one.iter().zip(&two) {
        assert!((one - two).abs() < 1e-9, "{one} {two}");
    }
}

#[test]
fn a_plan_of_an_outer_loop_knows_the_inner_one() {
    let system = quad("inner = [\"pitch\"]\ninner_rate = 500\nchunk = 50");
    let slow = "until 10; rate actuator 1000; takes policy 400; rate policy 2; set policy expect-delay 400";
    for (plan, verdict) in [("committed", "stood"), ("hold", "lost")] {
        let run = run_of(
            system.clone(),
            &config(&format!("{slow}; set policy plan {plan}")),
        );
        assert!(
            run.verdict.name().starts_with(verdict),
            "{plan}: {}",
            run.verdict
        );
    }
}

/// The figures of the page: at most one start of ten is lost at the delay that a loop bears, and more a
/// millisecond later; what theory says of it stands beside.
#[test]
fn an_outer_loop_bears_a_delay_that_loses_the_inner_one() {
    let folder = root().join("graphs/robots");
    let text = fs::read_to_string(folder.join("cascade.toml")).expect("the file");
    let page = fs::read_to_string(root().join("docs/plants.md")).expect("the page");
    let system = opened(&folder, &text).expect("a robot");
    let file = GraphFile::parse(&text).expect("a file");
    let robot = RobotPlant::load(&folder, file.plant().expect("a plant")).expect("a robot");
    let cases = [
        (INNER_OBS, 50, 46, "it bears 50 ms (46)", "lost_pitch"),
        (COMMAND, 318, 274, "the outer one 318 (274)", "lost_z"),
    ];
    for (topic, bears, theory, told, lost_by) in cases {
        assert!(page.contains(told), "{told}");
        let known = robot.bearable_delay_of(topic, &Setup::default());
        assert_eq!(known, Some(BearableDelay::Ms(theory)), "{topic}");
        let lost = |ms: u64| -> Vec<Summary> {
            let run = |seed: u64| {
                let setup =
                    format!("until 10; seed {seed}; rate actuator 1000; link {topic} delay:{ms}");
                run_of(system.clone(), &config(&setup))
            };
            let runs = (0..10).map(run);
            runs.filter(|summary| summary.verdict.is_lost()).collect()
        };
        assert!(lost(bears).len() <= 1, "{topic}");
        let beyond = lost(bears + 1);
        assert!(beyond.len() > 1, "{topic}");
        assert_eq!(beyond[0].verdict.name(), lost_by, "{topic}");
    }
    assert_eq!(robot.bearable_delay_of("/obs", &Setup::default()), None);
}

#[test]
fn a_wrong_inner_loop_is_refused_in_one_line() {
    let folder = folder(&fixture("quad"));
    let cases = [
        (
            "inner = [\"roll\"]",
            "no joint \"roll\": there are x, z, pitch",
        ),
        ("inner = \"pitch\"", "inner: expected a list of joints"),
        ("inner_rate = 500", "inner_rate: it has no joints"),
        ("inner = []\ninner_rate = 500", "it has no joints"),
        ("inner = [\"pitch\"]\ninner_rate = 1e-9", "inner_rate: "),
    ];
    check_refused(
        cases
            .into_iter()
            .map(|(keys, expected)| ill_refused(folder.path(), keys, keys, expected)),
    );
}
