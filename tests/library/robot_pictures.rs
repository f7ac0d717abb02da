//! Pictures of robots of MJCF files: which side is seen, what is drawn of it, and what a recording keeps.

use std::f64::consts::PI;

use ratelab_plant::RobotPlant;
use ratelab_system::{
    GeomRecord, Picture, PlantRecord, Shape, Style, System, graph_file::GraphFile,
};
use tempfile::TempDir;

use crate::clone::root;

/// A graph file with a plant.
fn file() -> GraphFile {
    GraphFile::parse("name = \"robot\"\n[plant]\nmjcf = \"robot.xml\"\n").expect("a file")
}

/// The robot of this model, whose files are gone afterwards.
fn robot(model: &str) -> RobotPlant {
    let folder = TempDir::new().expect("a folder");
    std::fs::write(folder.path().join("robot.xml"), model).expect("a model");
    RobotPlant::load(folder.path(), file().plant().expect("a plant")).expect("a robot")
}

fn model(name: &str) -> String {
    let path = root().join(format!("graphs/robots/{name}.xml"));
    std::fs::read_to_string(path).expect(name)
}

/// The picture of a robot from a side, with these positions of its joints.
fn seen(robot: &RobotPlant, side: usize, positions: &[f64]) -> Picture {
    let controls = robot.about().plant.expect("a plant").controls.clone();
    let speeds = vec![0.0; positions.len()];
    let row = [&controls, positions, &speeds].concat();
    let picture = robot.robot().picture_from(side, &row);
    picture.expect("a picture")
}

/// Left, bottom, right and top of a shape.
fn extent(shape: &Shape) -> [f64; 4] {
    let points = match shape {
        Shape::Outline { corners } => corners.clone(),
        Shape::Segment { from, to } => vec![*from, *to],
        Shape::Circle {
            centre: [x, y],
            radius,
        } => {
            vec![[x - radius, y - radius], [x + radius, y + radius]]
        }
        other => panic!("{other:?}"),
    };
    let all = points.iter().map(|[x, y]| [*x, *y, *x, *y]);
    let all = all.reduce(|[a, b, c, d], [x, y, ..]| [a.min(x), b.min(y), c.max(x), d.max(y)]);
    all.expect("points")
}

fn assert_near(found: [f64; 4], expected: [f64; 4]) {
    let mut pairs = found.iter().zip(expected);
    assert!(
        pairs.all(|(found, expected)| (found - expected).abs() < 1e-3),
        "{found:?}, expected {expected:?}"
    );
}

#[test]
fn a_robot_is_seen_from_the_side_that_shows_its_joints_and_from_the_two_others() {
    for (name, joints, captions) in [
        (
            "double",
            3,
            ["x →, z ↑, 0.22 m wide", "x →, y ↑, ", "y →, z ↑, "],
        ),
        (
            "reacher",
            2,
            ["x →, y ↑, 0.63 m wide", "y →, z ↑, ", "x →, z ↑, "],
        ),
    ] {
        let robot = robot(&model(name));
        assert_eq!(robot.robot().sides(), 3);
        for (side, expected) in captions.into_iter().enumerate() {
            let caption = &seen(&robot, side, &vec![0.0; joints]).captions[0];
            assert!(caption.starts_with(expected), "{name}: {caption}");
        }
        let first = seen(&robot, 0, &vec![0.0; joints]);
        assert_eq!(seen(&robot, 3, &vec![0.0; joints]), first);
    }
}

#[test]
fn hulls_move_with_their_bodies() {
    let robot = robot(&model("double"));
    let shapes = seen(&robot, 0, &[0.5, PI / 2.0, 0.0]).shapes;
    let styles: Vec<Style> = shapes.iter().map(|(style, _)| *style).collect();
    // The cart has a motor, and the poles have none.
    assert_eq!(styles, [Style::Body, Style::Subject, Style::Subject]);
    assert_near(extent(&shapes[0].1), [0.4, -0.05, 0.6, 0.05]);
    assert_near(extent(&shapes[1].1), [0.48, -0.02, 1.02, 0.02]);
    assert_near(extent(&shapes[2].1), [0.98, -0.02, 1.52, 0.02]);
}

#[test]
fn the_mass_of_a_pendulum_hangs_on_a_line() {
    let robot = robot(&model("pendulum"));
    let picture = seen(&robot, 0, &[0.0]);
    let [
        (_, Shape::Circle { centre, radius }),
        (_, Shape::Segment { from, to }),
    ] = &picture.shapes[..]
    else {
        panic!("{:?}", picture.shapes);
    };
    assert_eq!((*centre, *radius), ([0.0, 1.0], 0.05));
    assert_eq!((*from, *to), ([0.0, 0.0], *centre));
    assert!(picture.view[1] <= 0.0);
}

/// A wheel above a floor, with a part for the eye, one that is transparent, and one of another group.
const WHEEL: &str = r#"<mujoco>
  <asset><material name="glass" rgba="1 1 1 0"/></asset>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <geom type="box" pos="3 0 0.5" size="0.1 0.1 0.5"/>
    <body name="wheel" pos="0 0 0.3">
      <joint name="axle" axis="0 1 0"/>
      <geom type="cylinder" zaxis="0 1 0" size="0.1 0.02" mass="1"/>
      <geom type="ellipsoid" pos="0.2 0 0" size="0.05 0.05 0.1" contype="0" conaffinity="0" group="2" mass="0"/>
      <geom type="box" size="9 9 9" contype="0" conaffinity="0" group="3" mass="0"/>
      <geom type="box" size="8 8 8" contype="0" conaffinity="0" material="glass" mass="0"/>
    </body>
  </worldbody>
  <actuator><motor joint="axle"/></actuator>
</mujoco>"#;

#[test]
fn what_is_for_the_eye_is_drawn_and_no_other_geom() {
    let robot = robot(WHEEL);
    let [front, above] = [0, 1].map(|side| seen(&robot, side, &[0.0]));
    let styles: Vec<Style> = front.shapes.iter().map(|(style, _)| *style).collect();
    use Style::{Scenery, Subject};
    assert_eq!(styles, [Scenery, Scenery, Subject, Subject]);
    let [left, bottom, right, top] = extent(&front.shapes[0].1);
    assert!(bottom == 0.0 && top == 0.0 && left < -0.5 && right > 0.5);
    assert_near(extent(&front.shapes[1].1), [2.9, 0.0, 3.1, 1.0]);
    assert_near(extent(&front.shapes[2].1), [-0.1, 0.2, 0.1, 0.4]);
    let [_, bottom, right, top] = extent(&front.shapes[3].1);
    assert!((right - 0.25).abs() < 2e-3 && (top - bottom - 0.2).abs() < 4e-3);
    // The floor is seen from its edge only, and is in the frame where it is near.
    assert_eq!(above.shapes.len(), 3);
    assert!(front.view[1] > 0.1, "{:?}", front.view);
    let near = self::robot(&WHEEL.replace("0 0 0.3", "0 0 0.15"));
    assert_eq!(seen(&near, 0, &[0.0]).view[1], 0.0);
}

#[test]
fn a_recording_keeps_the_hulls_and_draws_the_same() {
    let robot = robot(WHEEL);
    let record = robot.about().plant.expect("a plant").clone();
    assert_eq!(record.geoms.len(), 4);
    let file = file();
    let again = |record: &PlantRecord| RobotPlant::recorded(record, file.plant().expect("a plant"));
    let same = again(&record).expect("a record");
    assert_eq!(seen(&same, 0, &[0.4]), seen(&robot, 0, &[0.4]));
    // An early version kept none, and none is taken that would not do: the physics is drawn.
    let far = GeomRecord {
        body: 99,
        ..record.geoms[0].clone()
    };
    let wild = GeomRecord {
        points: vec![[f64::NAN; 3]],
        ..record.geoms[0].clone()
    };
    for geoms in [vec![], vec![far], vec![wild], vec![GeomRecord::default()]] {
        let mut other = record.clone();
        other.geoms = geoms;
        let picture = seen(&again(&other).expect("a record"), 0, &[0.0]);
        assert_eq!(picture.shapes.len(), 3);
    }
}

#[test]
fn no_state_panics() {
    let robot = robot(WHEEL);
    for row in [vec![], vec![0.0], vec![f64::NAN; 3], vec![f64::MAX; 3]] {
        for side in [0, 1, 2, 99] {
            let picture = robot.robot().picture_from(side, &row);
            assert_eq!(picture.is_some(), row.len() == 3);
        }
    }
}
