//! Systems other than the cart-pole: the program of `examples/own_plant.rs`, which is the whole
//! command for it, and graph files.

mod support;

use std::{path::Path, process::Command};

use support::{Folder, RATELAB, User};

/// A folder in which the drone's program runs.
struct Drone(Folder);

impl User for Drone {
    fn program(&self) -> Command {
        let built = Path::new(RATELAB).with_file_name("examples");
        let mut program = Command::new(built.join("own_plant"));
        program.current_dir(self.0.path(""));
        program
    }
}

fn drone() -> Drone {
    Drone(Folder::new())
}

#[test]
fn its_runs_are_recorded_and_verified_where_the_system_is() {
    let drone = drone();
    drone
        .says("run --clock virtual --knob 'rate pilot 1' --record slow.rrd --csv slow.csv")
        .has("pilot 1 Hz")
        .has("DOWN at 3.200 s: 321 plant steps");
    let rows = drone.0.read("slow.csv");
    assert!(
        rows.starts_with("time_s,height_m,climb_m_s\n0,0.999"),
        "{rows}"
    );
    assert_eq!(rows.lines().count(), 322);
    drone.says("verify slow.rrd").has("identical");
    drone.says("info slow.rrd").has("DOWN at 3.200 s");
    drone.0.refuses("verify slow.rrd").has("\"drone\"");
    let like = drone.0.refuses("run --like slow.rrd");
    like.has("of the system drone");
}

#[test]
fn it_is_swept_over_one_of_its_rates_and_hunted() {
    drone()
        .says("sweep --axis 'rate pilot' 1,2 --seeds 0..9")
        .has("runs      20 of 10 s: 2 pilot rates × 10 seeds")
        .has("cliff     none completed up to 1 Hz, all from 2 Hz on");
    drone().refuses("sweep").has("which knob is swept?");
    drone()
        .says("hunt --knob 'rate pilot 3' --lose 20")
        .has("verdict   DOWN at")
        .has("proven    losing message");
}

#[test]
fn it_has_its_own_name_and_no_parts_of_the_course() {
    let drone = drone();
    drone.says("--help").has("Usage: own_plant");
    for page in ["--help", "run --help", "sweep --help", "keys", "man"] {
        let page = drone.says(page);
        for foreign in "exercise --theory --break --policy control-hz pole".split(' ') {
            page.lacks(foreign);
        }
    }
    drone.says("completions fish").has("complete -c own_plant");
    drone.refuses_each(
        "",
        "run --world own | no world of its own
         exercise        | own_plant
         run --break     | own_plant
         sweep --theory  | own_plant",
    );
}

#[test]
fn a_recording_of_a_graph_file_needs_the_file_no_more() {
    let drone = drone();
    let folder = &drone.0;
    folder.says("new robot.toml");
    folder
        .says("run robot.toml --clock virtual --record robot.rrd")
        .has("verdict   MISSED (see-to-act older than 400 ms");
    let first = folder.says("robot.toml run --clock virtual --json");
    first.has("\"missed_see_to_act\"");
    std::fs::remove_file(folder.path("robot.toml")).expect("the file");
    folder.says("verify robot.rrd").has("identical");
    let info = folder.says("info robot.rrd");
    info.has("\nchain     see-to-act data age mean");
    let branch = folder.says("branch robot.rrd --at 1 --knob 'rate planner 15'");
    branch.has("recorded  MISSED (see-to-act");
    folder.says("export-web robot.rrd -o robot.html");
    folder.says("trace robot.rrd -o robot.pftrace");
    let like = drone.refuses("run --like robot.rrd");
    like.has("of the graph file robot");
}

#[test]
fn a_graph_file_is_swept_and_hunted_like_a_system_in_code() {
    let folder = Folder::with(&["graphs/camera-pole.toml"]);
    folder
        .says("sweep camera-pole.toml --seeds 0..1 --control-hz 50 --axis 'takes detector' 15,95")
        .has("detector cost 95");
    folder
        .says("hunt camera-pole.toml --hang detector=500 --topic /pose")
        .has("hang detector");
}

#[test]
fn an_overload_at_one_value_of_a_sweep_is_noted_before_it() {
    let folder = Folder::with(&["graphs/robot.toml"]);
    let noted = |rates: &str| {
        let axis = format!("--axis 'rate planner' {rates} --seeds 0");
        let swept = folder.does(&format!("sweep robot.toml {axis}"));
        assert!(swept.status.success(), "{swept:?}");
        support::Said::of(&swept.stderr)
    };
    noted("5,20")
        .has("note: rate planner 20: planner is asked for more than it can do: 55 ms at 20 Hz");
    noted("5,10").lacks("note:");
}

#[test]
fn errors_in_a_graph_file_name_the_place_and_no_file_is_replaced() {
    let folder = Folder::new();
    folder.write("wrong.toml", "name = \"g\"\n[node.camera]\nrte = 30\n");
    let wrong = folder.refuses("run wrong.toml");
    let place = "wrong.toml:3:1: unknown key \"rte\": did you mean \"rate\"?";
    assert!(wrong.trim_end().ends_with(place), "{wrong:?}");
    folder.refuses_each(
        "",
        "new wrong.toml        | there is such a file
         new robot.txt         | ends in .toml
         none.toml             | none.toml: No such file
         run --json wrong.toml | right behind the command",
    );
}
