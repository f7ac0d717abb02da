//! A world that does not wait for the robot, in any system: a plant that advances to a
//! given run time.

use crate::support::*;

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

#[test]
fn any_plant_that_advances_to_a_run_time_is_a_world() {
    let fall = system(|builder| {
        let heights = builder.internal_topic("/height");
        assert!(!builder.world().is_course(), "a stone does not wait");
        let stone = Stone {
            height: 10.0,
            brought_to: Time::ZERO,
        };
        let stone = builder.own_world(stone, 50.0, |_| {
            |stone: &Stone, _: &mut Tick| {
                if stone.height < 0.0 {
                    Flow::End
                } else {
                    Flow::Continue
                }
            }
        })?;
        builder.node("altimeter", 7.0, 0, move |wiring| {
            let (heights, stone) = (wiring.publisher(&heights), stone.clone());
            move |tick: &mut Tick| {
                let now = tick.now();
                tick.publish(&heights, stone.at(now).height);
            }
        })
    });
    let summary = run_of(fall, &own(0, ""));
    // √(2 · 10 / 9.81) s, seen at the next reading.
    check("fall", &summary, "end 1.44; published /height 11");
    assert_eq!(&*summary.nodes[0].name, WORLD);
    assert_eq!(summary.verdict.to_string(), "ENDED at 1.440 s (by a node)");
}

#[test]
fn a_system_without_a_world_of_its_own_refuses_it() {
    // It never asks for the kind of world.
    let plain = system(|builder| builder.node("node", 1.0, 0, |_| |_: &mut Tick| {}));
    let refused = refusal_of(plain, &own(0, ""));
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
    let [course, own] = [config(""), own(0, "")].map(|config| {
        let json = serde_json::to_value(&config).expect("json");
        let read: Config = serde_json::from_value(json.clone()).expect("a config");
        assert_eq!(read, config);
        json
    });
    assert_eq!(course.get("world"), None);
    assert_eq!(own["world"]["own"]["step_ms"], 1);
}

#[test]
fn the_pole_falls_without_any_action() {
    // In the course's world an actuator that never ticks stops the plant's time.
    let idle = "offset actuator 1000000";
    let course = run(&config(idle));
    check("course", &course, "verdict never_moved; steps 0");
    assert!(course.verdict.is_lost() && course.last_step.is_none());
    let own = run(&own(0, idle));
    check("own", &own, "verdict pole_fell");
    assert!(own.steps > 10 && own.latency.count() == 0);
}

#[test]
fn the_own_world_follows_the_wall_under_the_real_clock() {
    // The plant moves without any action.
    let summary = run(&own(0, "real; until 0.3; offset actuator 1000"));
    assert!(summary.steps >= 5, "{} steps", summary.steps);
    assert_ne!(summary.state[6], 0.0);
}
