//! Robots of MJCF files: recorded, refused, and what they bear.

use std::fs;

use serde_json::Value;

use crate::support::{Folder, ROOT};

#[test]
fn a_robot_bears_what_theory_says_and_is_lost_by_a_joint_beyond_it() {
    let line =
        format!("margins {ROOT}/graphs/robots/double.toml --seeds 0..3 --duration-s 4 --json");
    let report = Folder::new().json(&line);
    let margins = report["margins"].as_array().expect("margins");
    let [delay, jitter, loss, rate] = &margins[..] else {
        panic!("{report}");
    };
    let bears = |margin: &Value| margin["bears"].as_f64().expect("a margin");
    let theory = delay["theory"].as_f64().expect("theory");
    assert!((bears(delay) - theory).abs() <= 3.0, "{delay}");
    assert!(bears(jitter) > bears(delay), "{jitter}");
    assert!((10.0..90.0).contains(&bears(loss)), "{loss}");
    assert!((2.0..50.0).contains(&bears(rate)), "{rate}");
    for margin in margins {
        let cause = margin["lost_by"].as_str().expect("a cause");
        assert!(cause.contains(" beyond "), "{cause}");
    }
    assert_eq!(report["hold_stood"], 0);
    let pole = report["fastest_pole_per_s"].as_f64().expect("a pole");
    assert!((pole - 9.95).abs() < 0.01, "{pole}");
}

#[test]
fn a_cascade_has_a_margin_for_each_of_its_loops() {
    let line =
        format!("margins {ROOT}/graphs/robots/cascade.toml --seeds 0..0 --duration-s 0.2 --json");
    let report = Folder::new().json(&line);
    let margins = report["margins"].as_array().expect("margins");
    let known = margins.iter().take(3);
    let known: Vec<_> = known
        .map(|margin| (margin["name"].as_str(), margin["theory"].as_f64()))
        .collect();
    assert_eq!(
        known,
        [
            (Some("delay"), Some(49.0)),
            (Some("outer"), Some(274.0)),
            (Some("inner"), Some(46.0)),
        ]
    );
}

#[test]
fn the_margins_of_a_graph_without_a_robot_are_refused() {
    let line = format!("margins {ROOT}/graphs/robot.toml");
    for line in ["margins", &line] {
        let (error, _) = Folder::new().fails(line, 2);
        error.has("name a graph file with a section [plant]");
    }
}

/// A folder with the files of a robot.
fn double() -> Folder {
    let folder = Folder::new();
    for name in ["double.toml", "double.xml"] {
        let file = fs::read(format!("{ROOT}/graphs/robots/{name}")).expect(name);
        folder.write(name, file);
    }
    folder
}

#[test]
fn a_recording_of_a_robot_is_run_again_without_the_files_of_its_model() {
    let folder = double();
    folder.says("run double.toml --clock virtual --duration-s 2 --record robot.rrd");
    fs::remove_file(folder.path("double.xml")).expect("a model");
    fs::remove_file(folder.path("double.toml")).expect("a graph file");
    folder.says("verify robot.rrd").has("identical");
    folder.says("info robot.rrd").has("in steps of 1 ms");
}

#[test]
fn wrong_robots_are_bad_input_in_one_line() {
    let folder = double();
    let model = folder.read("double.xml");
    for (changed, expected) in [
        (model.replace("</mujoco>", ""), "double.toml:6:8: MuJoCo: "),
        (
            model
                .replace("<actuator>", "<!--")
                .replace("</actuator>", "-->"),
            "no actuator",
        ),
        (model.replace("0.001", "1"), "timestep is 1 s"),
    ] {
        folder.write("double.xml", changed);
        for command in ["run", "sweep", "margins", "check"] {
            let (error, _) = folder.fails(&format!("{command} double.toml"), 2);
            error.has(expected);
        }
    }
    folder.write("double.xml", model);
    let (error, _) = folder.fails("run double.toml --world own", 2);
    error.has("the plant moves by itself");
    let (error, _) = folder.fails("run double.toml --policy scripted", 2);
    error.has("\"scripted\" is not a policy of a plant: expected lqr, hold or zero");
    let (error, _) = folder.fails("run double.toml --noise=-1", 2);
    error.has("noise");
}
