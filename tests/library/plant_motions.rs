//! Robots of MJCF files that are pushed, and that follow a reference.

use std::sync::Arc;

use ratelab_experiment::Summary;
use ratelab_plant::{BearableDelay, RobotPlant};
use ratelab_system::{FigureValue, KnobText, System};

use crate::{
    plants::{check_refused, fixture, folder, ill_refused, opened, run_with_program, text},
    support::*,
};

fn robot(name: &str, keys: &str) -> Arc<dyn System> {
    let model = match name {
        "reacher" => fixture("reacher"),
        _ => fixture("double"),
    };
    opened(folder(&model).path(), &text(keys)).expect(keys)
}

/// A run of five seconds, with an actuator that applies what comes at once.
fn run(system: &Arc<dyn System>, knobs: &str) -> Summary {
    let setup = format!("until 5; rate actuator 1000{knobs}");
    run_of(system.clone(), &config(&setup))
}

fn error(summary: &Summary) -> f64 {
    let mut figures = summary.figures.iter();
    let tracking = figures.find(|figure| figure.name == "tracking_error");
    match tracking.map(|figure| figure.value) {
        Some(FigureValue::Number(Some(error))) => error,
        other => panic!("{other:?}"),
    }
}

#[test]
fn pushes_move_the_joint_that_they_name_and_are_others_with_another_seed() {
    let double = robot("double", "start = 0");
    let calm = run(&double, "");
    assert_eq!(
        run(&double, "; set actuator disturb low 0").state,
        calm.state
    );
    assert_eq!(run(&double, "; set actuator disturb 0").state, calm.state);
    let weak = run(&double, "; set actuator disturb low 0.01");
    assert_eq!(weak.verdict.name(), "stood");
    assert_ne!(weak.state, calm.state);
    assert_eq!(
        run(&double, "; set actuator disturb low 0.01").state,
        weak.state
    );
    let other = run(&double, "; seed 1; set actuator disturb low 0.01");
    assert_ne!(other.state, weak.state);
    let both = run(&double, "; set actuator disturb low 0.01 slider 0.1");
    assert_ne!(both.state, weak.state);
    let strong = run(&double, "; set actuator disturb high 5");
    assert!(strong.verdict.name().starts_with("lost"));
}

#[test]
fn pushes_come_and_go_during_a_run() {
    let double = robot("double", "start = 0");
    let mut until_two = config("until 2; rate actuator 1000");
    let knobs = KnobText(double.knobs().aliases());
    let timed = knobs.parse_list("1 disturb low 0.02\n1.5 disturb 0");
    until_two.knobs = timed.expect("knobs");
    let pushed = run_of(double.clone(), &until_two);
    until_two.knobs.truncate(1);
    let longer = run_of(double.clone(), &until_two);
    until_two.knobs.clear();
    let calm = run_of(double, &until_two);
    assert!(calm.state.iter().all(|number| number.abs() < 1e-9));
    assert!(pushed.state != calm.state && pushed.state != longer.state);
}

#[test]
fn no_other_push_is_taken() {
    let double = robot("double", "");
    let knobs = double.knobs();
    let parameter = |value: &str| knobs.parameter(["actuator", "disturb"], value);
    assert_eq!(
        parameter("low  0.5 high 2"),
        Ok("low 0.5 high 2".to_owned())
    );
    assert_eq!(parameter("low 0"), Ok("0".to_owned()));
    for (value, part) in [
        ("x 1", "no joint \"x\": there are slider, low, high"),
        ("low", "such as slider 0.1"),
        ("", "such as slider 0.1"),
        ("low -1", "0 to 1000000 N or N m"),
        ("low nan", "is not a disturbance"),
        ("low 1 high", "is not a disturbance"),
    ] {
        let refused = parameter(value).err().unwrap_or_default();
        assert!(refused.contains(part), "{value}: {refused}");
    }
}

#[test]
fn a_robot_follows_and_an_old_target_costs_its_speed_times_its_age() {
    let amount = 0.4;
    let reacher = robot(
        "reacher",
        "reference = [\"shoulder sine 0.4 0.25\"]\nstart = 0",
    );
    let signals = reacher.signals();
    let named = |name: &str| signals.iter().find(|signal| signal.name == name);
    let signal = named("shoulder error").expect("a signal");
    assert_eq!(signal.limits, Some([-0.5, 0.5]));
    let fresh = run(&reacher, "");
    assert!(error(&fresh) < 0.02, "{}", error(&fresh));
    let late = run(&reacher, "; link /target delay:200");
    // The root mean square of its speed, for 200 ms.
    let expected = amount * std::f64::consts::TAU * 0.25 / 2_f64.sqrt() * 0.2;
    let found = error(&late);
    assert!(
        (found / expected - 1.0).abs() < 0.1,
        "{found}, not {expected}"
    );
    assert_eq!(late.verdict.name(), "stood");
    // As old are the joints, and the robot is lost.
    let blind = run(&reacher, "; link /obs delay:200");
    assert!(blind.verdict.name().starts_with("lost"));
    let calm = run(&robot("reacher", "start = 0"), "");
    assert!(
        !calm
            .figures
            .iter()
            .any(|figure| figure.name == "tracking_error")
    );
}

#[test]
fn limits_count_from_the_reference_wherever_it_is() {
    for (motion, verdict) in [
        ("step 0.4 1", "stood"),
        ("step 0.7 1", "lost_shoulder"),
        ("way 0:0 5:3", "stood"),
        ("way 1:0", "stood"),
        ("sine 0 1", "stood"),
    ] {
        let keys = format!("reference = [\"shoulder {motion}\"]\nstart = 0");
        let summary = run(&robot("reacher", &keys), "");
        assert_eq!(summary.verdict.name(), verdict, "{motion}");
    }
    let keys =
        "reference = [\"shoulder step 0.3 0\", \"shoulder way 0:0 2:0.5\", \"elbow step -0.2 1\"]";
    let summary = run(&robot("reacher", keys), "");
    assert_eq!(summary.state.len(), 8);
    assert_eq!(summary.state[6..], [0.8, -0.2]);
    assert!((summary.state[2] - 0.8).abs() < 0.02, "{:?}", summary.state);
}

#[test]
fn no_other_motion_is_taken() {
    let folder = folder(&fixture("reacher"));
    let forms = "expected \"NAME step AMOUNT S\"";
    check_refused(
        [
            (
                "x sine 1 1",
                "no hinge, slide or site \"x\": there are shoulder, elbow, tip.x, tip.y, tip.z",
            ),
            ("tip.q sine 1 1", "no hinge, slide or site \"tip.q\""),
            ("ti\0p.x sine 1 1", "no hinge, slide or site"),
            ("tip.x sine", forms),
            ("", forms),
            ("shoulder", forms),
            ("shoulder sine 1", forms),
            ("shoulder jump 1 1", forms),
            ("shoulder step nan 1", forms),
            ("shoulder step 1 inf", forms),
            ("shoulder way", forms),
            ("shoulder way 1", forms),
            ("shoulder way 1:1 1:2", forms),
            ("shoulder way 0:1e300", forms),
        ]
        .map(|(motion, expected)| {
            let keys = format!("reference = [{:?}]", motion).replace("\\0", "\\u0000");
            ill_refused(folder.path(), &keys, motion, expected)
        })
        .into_iter(),
    );
    let keys = "reference = \"shoulder\"";
    check_refused(
        [ill_refused(
            folder.path(),
            keys,
            keys,
            "expected a list of motions",
        )]
        .into_iter(),
    );
}

#[test]
fn a_site_goes_where_it_is_to_be_and_stays_near_where_it_cannot_reach() {
    // The tip is at (0.5, 0.5), and the arm is 1 m long.
    let place = |summary: &Summary| {
        let [shoulder, both] = [summary.state[2], summary.state[2] + summary.state[3]];
        let along = |turn: fn(f64) -> f64| 0.5 * (turn(shoulder) + turn(both));
        [along(f64::cos), along(f64::sin)]
    };
    for (x, y, goal) in [
        (0.1, -0.2, [0.6, 0.3]),
        (0.0, 0.3, [0.5, 0.8]),
        (5.0, 0.0, [1.0, 0.0]),
    ] {
        let keys = format!(
            "reference = [\"tip.x way 0:0 3:{x}\", \"tip.y way 0:0 3:{y}\"]\nstart = 0\nlimits = {{ \"*\" = 9 }}"
        );
        let summary = run(&robot("reacher", &keys), "");
        let found = place(&summary);
        if x > 1.0 {
            assert!(found[0] > 0.9, "{found:?}");
        } else {
            let off = (found[0] - goal[0]).hypot(found[1] - goal[1]);
            assert!(off < 0.01, "{found:?}, not {goal:?}");
        }
    }
}

#[test]
fn the_error_of_a_site_is_its_speed_times_the_age_of_its_target() {
    let reacher = robot(
        "reacher",
        "reference = [\"tip.x sine 0.1 0.25\"]\nstart = 0",
    );
    assert_eq!(reacher.signals()[0].name, "tip.x error");
    assert!(error(&run(&reacher, "")) < 0.005);
    let expected = 0.1 * std::f64::consts::TAU * 0.25 / 2_f64.sqrt() * 0.2;
    let found = error(&run(&reacher, "; link /target delay:200"));
    assert!(
        (found / expected - 1.0).abs() < 0.15,
        "{found}, not {expected}"
    );
}

/// A policy that is shown a target follows it, with no more than the state and the target.
#[cfg(unix)]
#[test]
fn a_policy_in_a_file_may_be_shown_the_target() {
    let folder = folder(&fixture("reacher"));
    let keys = "start = 0\nreference = [\"shoulder step 0.25 0\", \"elbow step 0.5 0\"]
        observe = [\"target elbow\", \"target shoulder * 2\"]";
    let answer = |id: u8| format!("{{\"id\":{id},\"action\":[0,0]}}");
    let answers = [
        "{\"ready\":\"actions\"}".to_owned(),
        answer(1),
        answer(2),
        answer(3),
    ];
    let answers = answers.each_ref().map(String::as_str);
    let (_, asked) = run_with_program(&folder, keys, &answers);
    assert!(
        asked[1].ends_with("\"observation\":[0.5,0.5]}"),
        "{asked:?}"
    );
    let unknown = (
        "observe = [\"target wrist\"]",
        "no hinge or slide \"wrist\": there are shoulder, elbow",
    );
    check_refused([ill_refused(folder.path(), unknown.0, unknown.0, unknown.1)].into_iter());
}

/// Every row of the table of robots, with its numbers as `margins` finds them: nine of ten starts stand at
/// the delay that is borne, and fewer a millisecond later.
#[test]
fn the_table_of_robots_is_measured() {
    let root = crate::clone::root();
    let page = std::fs::read_to_string(root.join("docs/plants.md")).expect("the page");
    let cart_pole = root.join("crates/cart-pole/src/cartpole.xml");
    let mut rows = 0;
    for line in page.lines().filter(|line| line.starts_with("| ")) {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let Some((bears, theory)) = cells[2].split_once(" ms (") else {
            continue;
        };
        rows += 1;
        let name = cells[1].trim_matches('`');
        let robot = match cells[1] {
            "cart-pole, `lqr`" => {
                let keys = "mjcf = \"cartpole.xml\"\nlimits = { slider = 2.4, hinge = 0.2095 }\nstep_ms = 1";
                loaded(cart_pole.parent().expect("a folder"), &text(keys))
            }
            _ => {
                let folder = root.join("graphs/robots");
                let file = std::fs::read_to_string(folder.join(format!("{name}.toml")));
                loaded(&folder, &file.expect(name))
            }
        };
        let (bears, theory): (u64, u64) = (number(bears), number(theory.trim_end_matches(')')));
        let hz = ratelab::Hz::new(50.0).expect("a rate");
        assert_eq!(
            robot.1.bearable_delay(hz),
            Some(BearableDelay::Ms(theory)),
            "{name}"
        );
        let pole = robot.1.poles().first().copied();
        let pole = pole.map_or("none".to_owned(), |pole| format!("{pole:.2}/s"));
        assert_eq!(pole, cells[3], "{name}");
        let lost = |ms: u64| -> Vec<Summary> {
            let run = |seed: u64| {
                let setup =
                    format!("until 10; seed {seed}; rate actuator 1000; link /action delay:{ms}");
                run_of(robot.0.clone(), &config(&setup))
            };
            let runs = (0..10).map(run);
            runs.filter(|summary| summary.verdict.is_lost()).collect()
        };
        assert!(lost(bears).len() <= 1, "{name}");
        let beyond = lost(bears + 1);
        assert!(beyond.len() > 1, "{name}");
        assert_eq!(
            beyond[0].verdict.name(),
            format!("lost_{}", cells[4]),
            "{name}"
        );
    }
    assert_eq!(rows, 6);
}

/// The figures of the page and of the file: over 60 m at most one start of ten is lost at the delay that is
/// borne, and more a millisecond later.
#[test]
fn a_trailer_in_reverse_bears_a_distance() {
    let folder = crate::clone::root().join("graphs/robots");
    let text = std::fs::read_to_string(folder.join("trailer.toml")).expect("the file");
    let mut ways = Vec::new();
    for (speed, bears) in [(2, 462), (4, 209), (8, 84)] {
        assert!(text.contains(&bears.to_string()), "{bears} ms");
        let text = text.replace("\"2\"]", &format!("\"{speed}\"]"));
        let system = loaded(&folder, &text).0;
        let lost = |ms: u64| {
            let run = |seed: u64| {
                let until = 60.0 / f64::from(speed);
                let setup = format!(
                    "until {until}; seed {seed}; rate actuator 1000; link /action delay:{ms}"
                );
                run_of(system.clone(), &config(&setup))
            };
            let runs = (0..10).map(run);
            runs.filter(|summary| summary.verdict.is_lost()).count()
        };
        assert!(lost(bears) <= 1, "{speed} m/s");
        assert!(lost(bears + 1) > 1, "{speed} m/s");
        ways.push(f64::from(speed) * (bears + 45) as f64 / 1e3);
    }
    assert!(ways.iter().all(|way| (way - 1.0).abs() < 0.05), "{ways:?}");
}

fn number(text: &str) -> u64 {
    text.parse().expect(text)
}

/// The system of a graph file, and its plant.
fn loaded(folder: &std::path::Path, text: &str) -> (Arc<dyn System>, RobotPlant) {
    let file = ratelab_system::graph_file::GraphFile::parse(text).expect(text);
    let plant = RobotPlant::load(folder, file.plant().expect("a plant")).expect(text);
    (opened(folder, text).expect(text), plant)
}
