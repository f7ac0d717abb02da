//! Robots of MJCF files on the screen.

use ratelab_plant::RobotPlant;

use ratelab_system::graph_file::GraphFile;

use super::*;

/// The end of a run of this robot, after `run`.
fn robot(name: &str, run: &str) -> App {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../graphs/robots");
    let text = format!("name = {name:?}\n[plant]\nmjcf = \"{name}.xml\"\n");
    let file = GraphFile::parse(&text).expect("a graph");
    let plant = RobotPlant::load(&folder, file.plant().expect("a plant")).expect("a robot");
    let system = file.system(&[Arc::new(plant)]).expect("a graph");
    let config = config(run);
    let mut app = opened(SessionSetup::new(Arc::new(system), None), &config);
    end(&mut app);
    app
}

/// The lines below the first one, which has the wall time.
fn without_status(drawn: &str) -> String {
    drawn.lines().skip(1).collect::<Vec<_>>().join("\n")
}

#[test]
fn a_robot_is_drawn_to_scale_with_the_names_of_its_file() {
    let mut app = robot("double", "until 2");
    // The pane alone: how much of the curves is there depends on when frames were taken.
    press(&mut app, "2z");
    insta::assert_snapshot!("double_80x24", without_status(&small(&app)));
    insta::assert_snapshot!("double_120x35", without_status(&screen(&app, 120, 35)));
    let ascii = drawn(&app, &POOR, 120, 35).to_string();
    insta::assert_snapshot!("double_ascii", without_status(&ascii));
    shows(
        &small(&robot("reacher", "until 1")),
        &["x →, y ↑, 0.63 m wide", "3 shoulder"],
    );
}

#[test]
fn a_robot_that_leaves_is_followed_and_its_loss_is_said() {
    let mut app = robot("double", "until 9; link /action delay:60");
    shows(&large(&app), &["✖ LOST", "LOST at"]);
    press(&mut app, "2z");
    insta::assert_snapshot!("double_lost_80x24", small(&app));
}

#[test]
fn a_key_turns_a_robot_and_is_told_where_there_is_one() {
    let mut app = robot("double", "until 1");
    for caption in ["x →, z ↑", "x →, y ↑", "y →, z ↑", "x →, z ↑"] {
        shows(&screen(&app, 160, 50), &[caption, "s side"]);
        press(&mut app, "s");
    }
    press(&mut app, "?");
    shows(&screen(&app, 120, 50), &["look at it from the next side"]);
    press(&mut app, "?");
    press(&mut app, "2i");
    shows(&small(&app), &["of its limit a joint has used"]);
    press(&mut app, "iz");
    insta::assert_snapshot!("double_from_above_80x24", small(&app));
    let cart_pole = large(&fallen());
    assert!(!cart_pole.contains("s side"), "{cart_pole}");
}
