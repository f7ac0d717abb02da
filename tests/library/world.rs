//! A world that does not wait for the robot, in any system: a plant that advances to a
//! given run time.

use std::sync::Arc;

use ratelab::{ClockKind, END, GO_ON, Knob, Time};
use ratelab_cart_pole::CartPole;
use ratelab_study::{
    experiment::{Config, Experiment, Summary},
    system::{BuildError, Builder, System, WORLD, World, WorldKind},
};

/// Falls from ten metres by itself.
struct Stone {
    height: f64,
    brought_to: Time,
}

impl World for Stone {
    fn advance_to(&mut self, now: Time) {
        self.brought_to = self.brought_to.max(now);
        self.height = 10.0 - 9.81 / 2.0 * self.brought_to.as_secs_f64().powi(2);
    }
}

struct Fall;

impl System for Fall {
    fn name(&self) -> &'static str {
        "fall"
    }

    fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
        let heights = builder.internal_topic("/height");
        if builder.world().is_course() {
            return Err(BuildError::Setting("a stone does not wait".to_owned()));
        }
        let stone = Stone {
            height: 10.0,
            brought_to: Time::ZERO,
        };
        let stone = builder.own_world(stone, 50.0, |_| {
            |stone: &Stone, _| if stone.height < 0.0 { END } else { GO_ON }
        })?;
        builder.node("altimeter", 7.0, 0, move |wiring| {
            let (heights, stone) = (wiring.publisher(&heights), stone.clone());
            move |now| {
                heights.publish(stone.at(now).height, now, None);
                GO_ON
            }
        })
    }
}

fn own(config: Config) -> Config {
    Config {
        world: WorldKind::OWN,
        ..config
    }
}

fn run(system: impl System, config: &Config) -> Summary {
    let experiment = Experiment::new(Arc::new(system), config).expect("an experiment");
    experiment.run().expect("a run")
}

#[test]
fn any_plant_that_advances_to_a_run_time_is_a_world() {
    let summary = run(Fall, &own(Config::default()));
    // √(2 · 10 / 9.81) s, seen at the next reading.
    assert_eq!(summary.sim_time, Time::from_nanos(1_440_000_000));
    assert_eq!(&*summary.nodes[0].name, WORLD);
    assert_eq!(summary.topic("/height").expect("a topic").published, 11);
    assert_eq!(summary.verdict.to_string(), "ENDED at 1.440 s (by a node)");
}

/// A system that never asks for the kind of world.
struct Plain;

impl System for Plain {
    fn name(&self) -> &'static str {
        "plain"
    }

    fn build(&self, builder: &mut Builder<'_>) -> Result<(), BuildError> {
        builder.node("node", 1.0, 0, |_| |_| GO_ON)
    }
}

#[test]
fn a_system_without_a_world_of_its_own_refuses_it() {
    let refused = Experiment::new(Arc::new(Plain), &own(Config::default())).err();
    let refused = refused.expect("a refusal").to_string();
    assert!(refused.contains("no world of its own"), "{refused}");
}

#[test]
fn worlds_and_steps_are_read_from_text() {
    let step = |world: WorldKind| match world {
        WorldKind::Course => None,
        WorldKind::Own { step_ms } => Some(step_ms.get()),
    };
    assert_eq!(WorldKind::parse("course", None).map(step), Ok(None));
    assert_eq!(WorldKind::parse("own", None).map(step), Ok(Some(1)));
    assert_eq!(WorldKind::parse("own", Some(5)).map(step), Ok(Some(5)));
    for (name, step_ms, part) in [
        ("own", Some(3), "expected 1, 2, 5 or 10 ms"),
        ("own", Some(0), "expected 1, 2, 5 or 10 ms"),
        ("course", Some(1), "has its own step"),
        ("Own", None, "expected course or own"),
    ] {
        let error = WorldKind::parse(name, step_ms).expect_err(name).to_string();
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn the_setting_is_part_of_a_config_and_absent_in_the_course_s_world() {
    let course = serde_json::to_value(Config::default()).expect("json");
    assert_eq!(course.get("world"), None);
    let config = own(Config::default());
    let json = serde_json::to_value(&config).expect("json");
    assert_eq!(json["world"]["own"]["step_ms"], 1);
    assert_eq!(
        serde_json::from_value::<Config>(json).expect("a config"),
        config
    );
    let old: Config = serde_json::from_value(course).expect("a config");
    assert_eq!(old.world, WorldKind::Course);
}

#[test]
fn the_pole_falls_without_any_action() {
    // In the course's world an actuator that never ticks stops the plant's time.
    let knob: Knob = "offset actuator 1000000".parse().expect("a knob");
    let mut config = Config::default();
    config.setup.set(knob);
    let course = run(CartPole::default(), &config);
    assert_eq!((course.verdict.name(), course.steps), ("never_moved", 0));
    let own = run(CartPole::default(), &own(config));
    assert_eq!(own.verdict.name(), "pole_fell");
    assert!(own.steps > 10 && own.latency.count() == 0);
}

#[test]
fn the_own_world_follows_the_wall_under_the_real_clock() {
    let config = Config {
        clock: ClockKind::Real,
        end: Time::from_nanos(300_000_000),
        ..own(Config::default())
    };
    let mut late = config.clone();
    late.setup
        .set("offset actuator 1000".parse().expect("a knob"));
    // The plant moves without any action.
    let summary = run(CartPole::default(), &late);
    assert!(summary.steps >= 5, "{} steps", summary.steps);
    assert_ne!(summary.state[6], 0.0);
}
