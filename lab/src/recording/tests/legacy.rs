//! Recordings of format 1, which the repository has three of.

use std::path::Path;

use ratelab::{cartpole::CartPole, experiment::Config, runtime::Time, system::Setup};

use super::{read, replay, verify};
use crate::recording::{Recording, schema::RunStatus};

fn reference(name: &str) -> Recording {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../recordings");
    read(&folder.join(name))
}

/// What a run of the cart-pole at `control_hz` was set up with.
fn setup(control_hz: u32) -> Setup {
    let setup = "sensor-hz 50, control-hz HZ, queue-depth 1, policy scripted";
    let config = CartPole::config(&setup.replace("HZ", &control_hz.to_string()));
    config.expect("knobs").setup
}

#[test]
fn what_was_run_is_read_as_a_run_of_the_cart_pole() {
    let fall = reference("fall-5hz.rrd").origin;
    assert_eq!((fall.format, &*fall.system), (1, "cart-pole"));
    assert_eq!(
        fall.config,
        Config {
            setup: setup(5),
            ..Config::default()
        }
    );
    assert!(fall.made_by().contains("MuJoCo 3."), "{}", fall.made_by());
    let rescued = reference("rescued.rrd").origin.config;
    assert_eq!(
        (rescued.end, rescued.setup),
        (Time::from_nanos(8_000_000_000), setup(50))
    );
    assert_eq!(
        CartPole::KNOBS.lines(&rescued.knobs),
        include_str!("../../../../recordings/rescue.knobs")
            .lines()
            .filter(|line| !line.starts_with('#') && !line.is_empty())
            .collect::<Vec<_>>()
    );
}

#[test]
fn how_a_run_ended_is_read_by_the_names_of_today() {
    for (name, verdict, at) in [
        ("balanced-50hz.rrd", "balanced", 10_000_000_000),
        ("fall-5hz.rrd", "pole_fell", 840_000_000),
    ] {
        let recording = reference(name);
        let outcome = recording.outcome.as_ref().expect("an end");
        let RunStatus::Ended(end) = &outcome.end else {
            panic!("{outcome:?}");
        };
        assert_eq!(
            (&*end.verdict.name, end.verdict.at.as_nanos()),
            (verdict, at)
        );
        let mut replay = replay(recording.clone());
        replay.advance_to(Time::MAX);
        assert_eq!(replay.summary().verdict.name(), verdict);
    }
}

#[test]
fn an_old_end_is_compared_part_by_part() {
    let mut fall = reference("fall-5hz.rrd");
    verify(&fall).expect("identical");
    let outcome = fall.outcome.as_mut().expect("an end");
    if let RunStatus::Ended(end) = &mut outcome.end {
        end.finals.clear();
    }
    let error = verify(&fall).expect_err("a figure is missing").to_string();
    assert!(error.contains("figures of the last state"), "{error}");
}
