//! Robots with an inner loop: two controllers that were one, and what each of them bears.

use std::sync::Arc;

use ratelab_plant::{BearableDelay, COMMAND, INNER_OBS, RobotPlant};
use ratelab_system::{Setup, System, graph_file::GraphFile};

use crate::{
    plants::{check_refused, fixture, folder, ill_refused, opened, text},
    support::*,
};

/// The quadrotor with these keys beside its limits.
fn quad(keys: &str) -> Arc<dyn System> {
    let keys = format!("limits = {{ x = 1, z = 1 }}\n{keys}");
    opened(folder(&fixture("quad")).path(), &text(&keys)).expect(&keys)
}

const INNER: &str = "inner = [\"pitch\"]\ninner_rate = 500";

#[test]
fn two_loops_at_one_rate_are_the_controller_that_they_were_split_from() {
    let [one, two] = ["", "inner = [\"pitch\"]"].map(|keys| {
        let run = run_of(quad(keys), &config("until 5; rate actuator 1000"));
        assert_eq!(run.verdict.name(), "stood", "{keys}");
        run.state.expect("a state")
    });
    for (one, two) in one.iter().zip(&two) {
        assert!((one - two).abs() < 1e-9, "{one} {two}");
    }
}

#[test]
fn an_outer_loop_bears_a_delay_that_loses_the_inner_one() {
    for (topic, delay, verdict) in [
        (COMMAND, 280, "stood"),
        (COMMAND, 400, "lost_x"),
        (INNER_OBS, 40, "stood"),
        (INNER_OBS, 80, "lost_pitch"),
    ] {
        let setup = format!("until 10; rate actuator 1000; link {topic} delay:{delay}");
        let run = run_of(quad(INNER), &config(&setup));
        assert_eq!(run.verdict.name(), verdict, "{topic} {delay}");
    }
}

#[test]
fn theory_knows_each_loop_of_a_cascade() {
    let keys = format!("limits = {{ x = 1, z = 1 }}\n{INNER}");
    let file = GraphFile::parse(&text(&keys)).expect("a file");
    let robot = RobotPlant::load(
        folder(&fixture("quad")).path(),
        file.plant().expect("a plant"),
    );
    let robot = robot.expect("a robot");
    let bears = |topic: &str| {
        let delay = robot.bearable_delay_of(topic, &Setup::default());
        delay.and_then(BearableDelay::ms).expect(topic)
    };
    let [outer, inner, both] = [COMMAND, INNER_OBS, "/action"].map(bears);
    assert!((280.0..330.0).contains(&outer), "{outer}");
    assert!((40.0..60.0).contains(&inner), "{inner}");
    assert!((both - inner).abs() < 10.0, "{both} {inner}");
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
