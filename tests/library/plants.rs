//! Robots of MJCF files in graph files: they stand, keep to their theory, and are refused in one line.

use std::{fs, path::Path, sync::Arc};

use ratelab_plant::{BearableDelay, RobotPlant};
use ratelab_system::{KnobText, System, graph_file::GraphFile};
use tempfile::TempDir;

use crate::{clone::root, support::*};

/// A graph file with these keys of its plant.
pub fn text(keys: &str) -> String {
    let mjcf = if keys.contains("mjcf") {
        ""
    } else {
        "mjcf = \"robot.xml\"\n"
    };
    format!("name = \"robot\"\n[plant]\n{mjcf}{keys}\n")
}

pub fn fixture(name: &str) -> String {
    let path = root().join(format!("graphs/robots/{name}.xml"));
    fs::read_to_string(path).expect(name)
}

/// The system of a graph file whose models lie in `folder`.
pub fn opened(folder: &Path, text: &str) -> Result<Arc<dyn System>, String> {
    let told = |error: &dyn std::fmt::Display| error.to_string();
    let file = GraphFile::parse(text).map_err(|error| told(&error))?;
    let spec = file.plant().ok_or("no plant")?;
    let plant = RobotPlant::load(folder, spec);
    let plant =
        plant.map_err(|defect| told(&file.plant_error(defect.key, defect.item, defect.what)))?;
    let system = file
        .system(&[Arc::new(plant)])
        .map_err(|error| told(&error))?;
    system.check_settings().map_err(|error| told(&error))?;
    Ok(Arc::new(system))
}

/// A folder with this model as `robot.xml`.
pub fn folder(model: &str) -> TempDir {
    let folder = TempDir::new().expect("a folder");
    fs::write(folder.path().join("robot.xml"), model).expect("a model");
    folder
}

fn plant(model: &str, keys: &str) -> RobotPlant {
    let file = GraphFile::parse(&text(keys)).expect(keys);
    let folder = folder(model);
    RobotPlant::load(folder.path(), file.plant().expect("a plant")).expect(keys)
}

#[test]
fn a_robot_stands_with_a_short_delay_and_is_lost_with_a_long_one() {
    for (name, delay, verdict) in [
        ("pendulum", 0, "stood"),
        ("pendulum", 400, "lost_hinge"),
        ("double", 0, "stood"),
        ("double", 60, "lost_high"),
    ] {
        let folder = folder(&fixture(name));
        let system = opened(folder.path(), &text("")).expect(name);
        let link = format!("link /action delay:{delay}; rate actuator 1000");
        let summary = run_of(system, &config(&format!("until 10; {link}")));
        assert_eq!(summary.verdict.name(), verdict, "{name} {delay}");
    }
}

#[test]
fn the_controller_of_the_cart_poles_own_model_bears_what_its_theory_says() {
    let model = fs::read_to_string(root().join("crates/cart-pole/src/cartpole.xml"));
    let model = model.expect("the cart-pole");
    let keys = "limits = { slider = 2.4, hinge = 0.2095 }\nstep_ms = 1";
    let bears = plant(&model, keys).bearable_delay(Hz::new(50.0).expect("a rate"));
    assert_eq!(bears, Some(BearableDelay::Ms(70)));
}

#[test]
fn theory_of_a_loop_alone_is_that_of_each_delay_up_to_it() {
    let delay = |robot: &RobotPlant, rate: f64| {
        let bears = robot.bearable_delay(Hz::new(rate).expect("a rate"));
        bears.expect("gains")
    };
    for (name, at_50_hz) in [
        ("double", 19),
        ("pendulum", 178),
        ("quad", 37),
        ("reacher", 38),
    ] {
        let start = if name == "double" {
            "limits = { slider = 1, low = 0.2, high = 0.2 }"
        } else {
            ""
        };
        let robot = plant(&fixture(name), start);
        assert_eq!(delay(&robot, 50.0), BearableDelay::Ms(at_50_hz), "{name}");
    }
    // Nothing in it grows that has a limit: a thousand delays, in a moment.
    let limits = "limits = { x = inf, y = 1.75, yaw = inf, hitch = 0.8, steer = inf }";
    assert_eq!(
        delay(&plant(&fixture("trailer"), limits), 50.0),
        BearableDelay::Any
    );
    // Without feedback it grows at once.
    let falls = plant(&fixture("double"), "limits = { \"*\" = 1e9 }");
    assert!(matches!(
        delay(&falls, 1.0),
        BearableDelay::None | BearableDelay::Ms(_)
    ));
}

#[test]
fn a_recorded_robot_runs_as_the_one_of_the_file_without_it() {
    let folder = folder(&fixture("double"));
    let text = text("start = 0.05");
    let system = opened(folder.path(), &text).expect("a robot");
    let record = system.about().plant.expect("a plant").clone();
    drop(folder);
    let file = GraphFile::parse(&text).expect("a file");
    let again = RobotPlant::recorded(&record, file.plant().expect("a plant")).expect("a record");
    assert_eq!(again.about().plant, Some(&record));
    let again = file.system(&[Arc::new(again)]).expect("a system");
    let setup = "until 3; set sensor noise 0.001; link /action delay:0..15";
    let [first, second]: [Arc<dyn System>; 2] = [system, Arc::new(again)];
    let [first, second] = [first, second].map(|system| run_of(system, &config(setup)));
    assert!(first.state.len() > 6);
    assert_eq!(first.state, second.state);
}

#[test]
fn a_damaged_record_is_refused() {
    let folder = folder(&fixture("double"));
    let system = opened(folder.path(), &text("")).expect("a robot");
    let record = system.about().plant.expect("a plant").clone();
    let file = GraphFile::parse(&text("")).expect("a file");
    let spec = file.plant().expect("a plant");
    let refused = |change: &dyn Fn(&mut ratelab_system::PlantRecord)| {
        let mut record = record.clone();
        change(&mut record);
        let refused = RobotPlant::recorded(&record, spec).err();
        assert_eq!(
            refused.expect("refused").what,
            "the model in the recording is damaged"
        );
    };
    refused(&|record| record.model.clear());
    refused(&|record| record.model = "%".to_owned());
    refused(&|record| record.model.truncate(1000));
    refused(&|record| record.positions.clear());
    refused(&|record| record.controls.push(0.0));
}

/// The error of each of these keys, and what has to be in it.
const KEYS: &[(&str, &str)] = &[
    ("mjcf = 5", "mjcf: expected a path in quotes"),
    (
        "mjcf = \"none.xml\"",
        "line 3, column 8: no such file: none.xml",
    ),
    ("mjcf = \"\"", "no such file"),
    ("mjcf = \".\"", "no such file"),
    ("mjcf = \"robot.xml/x\"", "no such file"),
    ("mjcf = \"a\\u0000b\"", "no such file"),
    (
        "mjcf = \"/etc/passwd\"",
        "/etc/passwd is outside of the folder of the graph file",
    ),
    ("mjcf = \"../\"", "no such file"),
    (
        "keyframe = \"x\"",
        "line 4, column 12: no keyframe \"x\": there are up",
    ),
    ("keyframe = 5", "keyframe: expected a name"),
    ("pose = { x = 1 }", "no joint \"x\": there are hinge"),
    ("pose = { hinge = [1, 2] }", "hinge: one number expected"),
    ("pose = { hinge = [] }", "hinge: one number expected"),
    (
        "pose = { hinge = \"a\" }",
        "pose: expected names with numbers",
    ),
    ("pose = { hinge = nan }", "hinge: one number expected"),
    ("pose = { hinge = inf }", "hinge: one number expected"),
    ("pose = 3", "pose: expected names with numbers"),
    ("limits = { x = 1 }", "no joint \"x\": there are hinge"),
    (
        "limits = { hinge = 0 }",
        "\"hinge\": expected a number above 0, or inf",
    ),
    ("limits = { hinge = -1 }", "expected a number above 0"),
    ("limits = { hinge = nan }", "expected a number above 0"),
    ("limits = { hinge = [1, 2] }", "expected a number above 0"),
    (
        "limits = { hinge = \"inf\" }",
        "limits: expected names with numbers",
    ),
    ("start = -1", "start: expected 0 or more"),
    ("start = nan", "start: expected a number"),
    ("start = inf", "start: expected a number"),
    ("start = \"fast\"", "start: expected a number"),
    (
        "policy = \"lqg\"",
        "no policy \"lqg\": did you mean \"lqr\"?",
    ),
    (
        "policy = \"./policy.py\"",
        "line 4, column 10: no such file: ./policy.py",
    ),
    ("policy = 1", "policy: expected"),
    ("rate = 0", "rate: expected a number above 0"),
    ("rate = 1e-9", "rate: "),
    ("rate = \"fast\"", "rate: expected a number above 0"),
    ("step_ms = 0", "step_ms: expected a number above 0"),
    ("step_ms = 0.0001", "step_ms: expected whole microseconds"),
    (
        "step_ms = 0.0123456",
        "step_ms: expected whole microseconds",
    ),
    (
        "step_ms = 1000",
        "step_ms: expected a number above 0, up to 100",
    ),
    ("speed = 1", "unknown key \"speed\""),
    ("observe = \"qpos\"", "observe: expected a list of terms"),
    ("observe = [1]", "observe: expected a list of terms"),
    (
        "observe = [\"qpos\", \"sensor gyro\"]",
        "line 4, column 20: no sensor \"gyro\": there are none",
    ),
    ("observe = [\"gravity x\"]", "no site \"x\": there are none"),
    (
        "observe = [\"speed\"]",
        "\"speed\" is not a term: expected qpos",
    ),
    ("observe = [\"qpos * x\"]", "\"qpos * x\" is not a term"),
    ("observe = [\"qpos * inf\"]", "is not a term"),
    ("observe = [\"1 nan\"]", "is not a term"),
    ("observe = [\"\"]", "\"\" is not a term"),
    ("observe = [\" * 2\"]", "is not a term"),
    ("action = 0", "action: expected a factor other than 0"),
    ("action = inf", "action: expected a number"),
    ("lost = \"tilt pole > 45\"", "lost: expected a list"),
    (
        "lost = [\"height pole < 1\", \"tilt wheel > 45\"]",
        "line 4, column 28: no body \"wheel\": there are world, pole",
    ),
    (
        "lost = [\"tilt pole < 45\"]",
        "does not say what loses a run",
    ),
    (
        "lost = [\"tilt pole > 180\"]",
        "expected \"height BODY < METRES\"",
    ),
    ("lost = [\"height pole < nan\"]", "does not say what loses"),
    ("lost = [\"touches pole > 1\"]", "\"touches BODY > 0\""),
    ("lost = [\"tilt\"]", "does not say what loses a run"),
    (
        "[system]\nname = \"cart-pole\"",
        "a graph has a system or a plant",
    ),
    (
        "remap = { \"/obs\" = \"/x\" }",
        "\"/x\" is no way from \"/obs\"",
    ),
    (
        "[node.sensor]\nrate = 5",
        "the system has a node \"sensor\" already",
    ),
];

/// The error of each of these changes of the model, and what has to be in it.
const MODELS: &[(&str, &str)] = &[
    ("<mujoco model=\"pendulum\"> → hello", "MuJoCo"),
    ("</mujoco> → ", "MuJoCo"),
    ("</mujoco> → </mujoco", "MuJoCo"),
    ("mujoco → robot", "the model has no joint"),
    ("<worldbody> → <worldbody><wheel/>", "MuJoCo"),
    ("mass=\"1\" → mas=\"1\"", "MuJoCo"),
    ("mass=\"1\" → mass=\"-1\"", "MuJoCo"),
    ("mass=\"1\" → mass=\"0\"", "MuJoCo"),
    ("size=\"0.05\" → size=\"-1\"", "MuJoCo"),
    (
        "<joint name=\"hinge\" type=\"hinge\" axis=\"0 1 0\"/> → ",
        "MuJoCo",
    ),
    ("axis=\"0 1 0\" → axis=\"0 0 0\"", "MuJoCo"),
    ("type=\"hinge\" → type=\"wheel\"", "MuJoCo"),
    ("joint=\"hinge\" → joint=\"wheel\"", "MuJoCo"),
    ("ctrlrange=\"-1 1\" → ctrlrange=\"1 -1\"", "MuJoCo"),
    ("qpos=\"0\" → qpos=\"0 0\"", "MuJoCo"),
    ("gear=\"3\" → gear=\"nan\"", ""),
    ("<actuator>…</actuator> → ", "the model has no actuator"),
    (
        "timestep=\"0.001\" → timestep=\"0\"",
        "timestep is 0 s: expected whole microseconds",
    ),
    ("timestep=\"0.001\" → timestep=\"-1\"", "timestep is -1 s"),
    (
        "timestep=\"0.001\" → timestep=\"1e9\"",
        "timestep is 1000000000 s",
    ),
    (
        "timestep=\"0.001\" → timestep=\"0.0000105\"",
        "timestep is 0.0000105 s",
    ),
    ("timestep=\"0.001\" → timestep=\"nan\"", ""),
    (
        "timestep=\"0.001\" → timestep=\"0.001\" gravity=\"0 0 nan\"",
        "",
    ),
    ("<worldbody> → <size memory=\"100G\"/><worldbody>", ""),
    (
        "<worldbody> → <extension/><worldbody>",
        "the model has a plugin",
    ),
    (
        "<worldbody> → <include file=\"none.xml\"/><worldbody>",
        "MuJoCo",
    ),
    (
        "<worldbody> → <include file=\"robot.xml\"/><worldbody>",
        "MuJoCo",
    ),
    (
        "<worldbody> → <include file=\"/etc/passwd\"/><worldbody>",
        "is outside of the folder",
    ),
    (
        "<worldbody> → <asset><mesh name=\"m\" file=\"none.stl\"/></asset><worldbody>",
        "MuJoCo",
    ),
    (
        "<worldbody> → <asset><mesh name=\"m\" file=\"robot.xml\"/></asset><worldbody>",
        "MuJoCo",
    ),
    (
        "<worldbody> → <asset><mesh name=\"m\" file=\"/etc/passwd\"/></asset><worldbody>",
        "is outside of the folder",
    ),
    (
        "<worldbody> → <asset><mesh name=\"m\" file='&#47;etc&#x2f;passwd'/></asset><worldbody>",
        "is outside of the folder",
    ),
    (
        "<worldbody> → <asset><mesh name=\"m\" file=\"passwd\"/></asset><compiler meshdir=\"/etc\"/><worldbody>",
        "is outside of the folder",
    ),
];

/// What is wrong with how a graph file is refused: the error is one line and has `expected` in it.
pub fn ill_refused(folder: &Path, keys: &str, case: &str, expected: &str) -> Option<String> {
    match opened(folder, &text(keys)).err() {
        None => Some(format!("{case} is accepted")),
        Some(error) => {
            let is_line = error.starts_with("line ") && !error.contains('\n');
            (!is_line || !error.contains(expected)).then(|| format!("{case}: {error}"))
        }
    }
}

/// Checks that no graph file is refused in a wrong way.
pub fn check_refused(ill: impl Iterator<Item = Option<String>>) {
    let ill: Vec<String> = ill.flatten().collect();
    assert!(ill.is_empty(), "{}", ill.join("\n"));
}

#[test]
fn each_wrong_key_is_refused_in_one_line() {
    let model = fixture("pendulum").replace("<key qpos", "<key name=\"up\" qpos");
    let folder = folder(&model);
    let keys = KEYS.iter();
    check_refused(keys.map(|(keys, expected)| ill_refused(folder.path(), keys, keys, expected)));
}

#[test]
fn each_broken_model_is_refused_in_one_line() {
    check_refused(MODELS.iter().map(|(change, expected)| {
        let (before, after) = change.split_once(" → ").expect("a change");
        let model = fixture("pendulum");
        let before = match before.split_once('…') {
            None => before.to_owned(),
            Some((first, last)) => {
                let [from, to] = [first, last].map(|part| model.find(part).expect(change));
                model[from..to + last.len()].to_owned()
            }
        };
        assert!(model.contains(&before), "{change}");
        let folder = folder(&model.replace(&before, after));
        ill_refused(folder.path(), "", change, expected)
    }));
}

#[test]
fn a_robot_beyond_the_bounds_is_refused() {
    let joints = |count| {
        let joint = "<body><joint axis=\"1 0 0\" type=\"slide\"/><geom size=\"1\"/></body>";
        fixture("pendulum").replace("<body name", &format!("{}<body name", joint.repeat(count)))
    };
    let motors = |count| {
        let motors = "<motor joint=\"hinge\"/>".repeat(count);
        fixture("pendulum").replace("</actuator>", &format!("{motors}</actuator>"))
    };
    for (model, expected) in [
        (
            joints(100),
            "the model has 101 coordinates: expected up to 100",
        ),
        (motors(64), "the model has 65 controls: expected up to 64"),
    ] {
        let model = model
            .replace("<keyframe>", "<!--")
            .replace("</keyframe>", "-->");
        check_refused([ill_refused(folder(&model).path(), "", expected, expected)].into_iter());
    }
}

#[test]
fn a_pose_that_nothing_holds_is_refused() {
    let ball = "<body name=\"ball\"><freejoint/><geom size=\"0.1\" mass=\"3\"/></body><body name=\"pole\">";
    let model = fixture("pendulum").replace("<body name=\"pole\">", ball);
    let model = model.replace("qpos=\"0\"", "qpos=\"0 0 1 1 0 0 0 0\"");
    let expected = "nothing holds this pose: 75 % of the weight is missing, most at ball.pos";
    check_refused([ill_refused(folder(&model).path(), "", "a ball", expected)].into_iter());
}

#[cfg(unix)]
#[test]
fn a_link_out_of_the_folder_is_followed_and_refused() {
    let outside = folder(&fixture("pendulum"));
    let inside = TempDir::new().expect("a folder");
    let link = inside.path().join("robot.xml");
    std::os::unix::fs::symlink(outside.path().join("robot.xml"), link).expect("a link");
    let ill = ill_refused(inside.path(), "", "a link", "is outside of the folder");
    check_refused([ill].into_iter());
}

#[test]
fn a_robot_that_no_limit_holds_is_told_before_the_run() {
    let model = fixture("pendulum").replace(
        "<body name=\"pole\">",
        "<body name=\"top\"><joint name=\"spin\" axis=\"0 0 1\"/><geom size=\"0.1\" mass=\"1\"/></body>\
         <body name=\"pole\">",
    );
    let model = model.replace("qpos=\"0\"", "qpos=\"0 0\"");
    let warnings = |keys| plant(&model, keys).warnings(&Default::default());
    assert_eq!(
        warnings(""),
        ["nothing holds spin: limits = { \"spin\" = inf }"]
    );
    assert_eq!(warnings("limits = { spin = inf }"), [""; 0]);
}

#[test]
fn the_noise_of_the_sensor_is_a_knob_with_and_without_its_node() {
    let robot = plant(&fixture("double"), "");
    let knobs = |text| KnobText(robot.knobs().aliases()).parse(text).expect(text);
    assert_eq!(knobs("noise sensor 0.01"), knobs("noise 0.01"));
    assert_eq!(knobs("noise 0.01"), knobs("set sensor noise 0.01"));
}

#[test]
fn numbers_of_a_robot_have_names_and_units() {
    let system = plant(&fixture("double"), "");
    let signals = system.signals();
    let names: Vec<_> = signals
        .iter()
        .map(|signal| format!("{} {}", signal.name, signal.unit))
        .collect();
    assert_eq!(names, ["slider m", "low rad", "high rad", "control 1 "]);
    assert_eq!(signals[1].limits, Some([-0.5, 0.5]));
    let row = [0.25, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
    let values: Vec<f64> = signals
        .iter()
        .map(|signal| signal.value.compute(&row))
        .collect();
    assert_eq!(values, [1.0, 2.0, 3.0, 0.25]);
}

/// What a run of a graph file publishes on a topic, and its summary.
pub fn published(folder: &TempDir, keys: &str, topic: &str) -> (Vec<Vec<f64>>, Summary) {
    let system = opened(folder.path(), &text(keys)).expect(keys);
    let experiment = Experiment::new(system, &config("until 1")).expect(keys);
    let tap = experiment.taps().rows(topic, 1_000).expect(topic);
    let summary = experiment.run().expect(keys);
    let mut rows = tap.rows();
    tap.take(&mut rows);
    (rows.iter().map(|(_, row)| row.to_vec()).collect(), summary)
}

/// The double pendulum with a sensor that is tilted by 20 degrees on its upper pole.
fn sensing() -> TempDir {
    let model = fixture("double").replace(
        "<joint name=\"high\"",
        "<site name=\"imu\" euler=\"0 20 0\"/><joint name=\"high\"",
    );
    folder(&model.replace(
        "<actuator>",
        "<sensor><gyro name=\"gyro\" site=\"imu\"/></sensor><actuator>",
    ))
}

#[test]
fn an_observation_is_the_state_and_then_the_terms_at_the_time_of_the_reading() {
    let keys = "pose = { slider = 0.25 }
        observe = [\"joints\", \"sensor gyro * 2\", \"last-action\", \"gravity imu\", \"1 -2.5\", \"joint-speeds\"]";
    let (rows, _) = published(&sensing(), keys, "/obs");
    assert!(rows.len() > 40);
    for row in &rows {
        let (state, terms) = row.split_at(6);
        let [slider, low, high, speeds @ ..] = state else {
            panic!("{row:?}");
        };
        let tilt = low + high + 20_f64.to_radians();
        let seen = [
            slider - 0.25,
            *low,
            *high,
            0.0,
            2.0 * (speeds[1] + speeds[2]),
            0.0,
        ];
        let seen = seen
            .into_iter()
            .chain([tilt.sin(), 0.0, -tilt.cos(), 1.0, -2.5]);
        let expected: Vec<f64> = seen.chain(speeds.iter().copied()).collect();
        assert_eq!(terms.len(), expected.len());
        let apart = terms
            .iter()
            .zip(&expected)
            .map(|(one, other)| (one - other).abs());
        assert!(apart.fold(0.0, f64::max) < 1e-12, "{terms:?} {expected:?}");
    }
}

#[test]
fn a_rule_loses_a_run_that_all_limits_allow() {
    let model = fixture("double")
        .replace(" contype=\"0\" conaffinity=\"0\"", "")
        .replace(
            "<worldbody>",
            "<worldbody><geom type=\"plane\" size=\"9 9 1\" pos=\"0 0 -0.3\"/>",
        );
    let model = folder(&model);
    let upper = |row: &[f64]| (row[2].cos(), row[2] + row[3]);
    for (rule, is_broken) in [
        (
            "height high < 0.4",
            (|[height, _]| height < 0.4) as fn([f64; 2]) -> bool,
        ),
        ("tilt high > 30", |[_, tilt]| tilt.abs().to_degrees() > 30.0),
    ] {
        let keys = format!(
            "policy = \"zero\"\nstart = 1\nlimits = {{ \"*\" = inf }}\nlost = [\"{rule}\"]"
        );
        let (rows, summary) = published(&model, &keys, "/state");
        let told = summary.verdict.to_string();
        assert!(told.ends_with(&format!("({rule})")), "{told}");
        let broken = rows.iter().map(|row| {
            let (cos, tilt) = upper(row);
            is_broken([0.5 * cos, tilt])
        });
        let broken: Vec<bool> = broken.collect();
        assert_eq!(
            broken.iter().position(|broken| *broken),
            Some(rows.len() - 1),
            "{rule}"
        );
    }
    let touches =
        "policy = \"zero\"\nstart = 1\nlimits = { \"*\" = inf }\nlost = [\"touches high > 0\"]";
    let (rows, summary) = published(&model, touches, "/state");
    assert_eq!(summary.verdict.name(), "lost_touches_high_0");
    assert!(
        rows.last().is_some_and(|row| row[2].abs() > 1.0),
        "{rows:?}"
    );
}

/// A program beside a robot that gives these answers, and what it was asked.
pub fn run_with_program(folder: &TempDir, keys: &str, answers: &[&str]) -> (String, Vec<String>) {
    let script = root().join("tests/fixtures/policies/says.sh");
    std::os::unix::fs::symlink(script, folder.path().join("policy")).expect("a link");
    let says = answers.join("\n") + "\n";
    fs::write(folder.path().join("policy.says"), says).expect("written");
    let keys = format!("policy = \"./policy\"\n{keys}");
    let system = opened(folder.path(), &text(&keys)).expect("a robot");
    let run = Experiment::new(system, &config("until 0.05"));
    let told = run.map_or_else(
        |error| error.to_string(),
        |run| run.run().expect("a run").verdict.to_string(),
    );
    let asked = fs::read_to_string(folder.path().join("policy.asked")).expect("asked");
    (told, asked.lines().map(str::to_owned).collect())
}

#[test]
fn a_program_sees_the_terms_with_its_own_last_action_and_answers_with_controls() {
    let keys = "start = 0\naction = 3\nobserve = [\"joints\", \"last-action * 2\"]";
    let ready = "{\"ready\":\"actions\"}";
    let answers = [
        ready,
        "{\"id\":1,\"action\":[0.5]}",
        "{\"id\":2,\"action\":-0.25}",
        "{\"id\":3,\"action\":[0]}",
    ];
    let (told, asked) = run_with_program(&folder(&fixture("double")), keys, &answers);
    assert!(told.starts_with("STOOD"), "{told}");
    assert!(asked[0].contains("\"action_ms\":20.0"), "{asked:?}");
    let observation = |line: &String| {
        let asked: serde_json::Value = serde_json::from_str(line).expect(line);
        let numbers = asked["observation"].as_array().expect(line).clone();
        let numbers = numbers.iter().map(|number| number.as_f64().expect(line));
        numbers.collect::<Vec<f64>>()
    };
    assert_eq!(observation(&asked[1]), [0.0; 4]);
    let [slider, low, _, last] = observation(&asked[2])[..] else {
        panic!("{asked:?}");
    };
    assert_eq!(last, 1.0);
    // Half of 20 N for 20 ms, on 1.2 kg or a little less: the poles lag behind.
    assert!(
        (0.001_5..0.002_1).contains(&slider) && low < 0.0,
        "{slider} {low}"
    );
    assert_eq!(observation(&asked[3])[3], -0.5);
    for (answers, why) in [
        (
            &["{\"ready\":\"chunks\"}"][..],
            "it answers with chunks: give --chunk H",
        ),
        (&[ready, "{\"id\":1,\"action\":[0,1]}"], ""),
    ] {
        let (told, _) = run_with_program(&folder(&fixture("double")), keys, answers);
        assert!(told.contains(why), "{told}");
    }
}

/// Weights of a network that is linear within the course of small numbers: each output is this factor
/// times the sum of so many inputs.
fn weights(inputs: usize, factor: f32) -> Vec<u8> {
    use safetensors::{Dtype, serialize, tensor::TensorView};
    let small = 1e-3;
    let layers = [(0, inputs, small), (2, 1, 1.0), (4, 1, factor / small)];
    let tensors = layers.iter().flat_map(|(layer, inputs, weight)| {
        let name = format!("actor_mean.{layer}");
        let weights = f32::to_le_bytes(*weight).repeat(*inputs);
        [
            (format!("{name}.weight"), vec![1, *inputs], weights),
            (format!("{name}.bias"), vec![1], vec![0; 4]),
        ]
    });
    let tensors: Vec<_> = tensors.collect();
    let views = tensors.iter().map(|(name, shape, data)| {
        let view = TensorView::new(Dtype::F32, shape.clone(), data);
        (name, view.expect("a tensor"))
    });
    serialize(views, None).expect("a file")
}

#[test]
fn a_network_adds_its_outputs_times_a_factor_to_the_controls_as_given() {
    let model = fixture("pendulum").replace("<key qpos=\"0\"", "<key qpos=\"0\" ctrl=\"0.25\"");
    let folder = folder(&model);
    fs::write(folder.path().join("net.safetensors"), weights(2, 0.5)).expect("weights");
    let keys = "limits = { \"*\" = inf }\npolicy = \"net.safetensors\"\nobserve = [\"joints\", \"3\"]\naction = 0.25";
    for keys in [
        keys.to_owned(),
        keys.replace("safetensors", "safetensors#relu"),
    ] {
        let (readings, _) = published(&folder, &keys, "/obs");
        let (controls, _) = published(&folder, &keys, "/action");
        assert_eq!(controls.len(), 51);
        for (reading, control) in readings.iter().zip(&controls) {
            let expected = 0.25 + 0.25 * 0.5 * (reading[0] + 3.0);
            let apart = (control[0] - expected).abs();
            assert!(apart < 1e-4, "{control:?} {expected}");
        }
    }
    for (keys, expected) in [
        (
            "observe = [\"joints\"]",
            "it sees 2 numbers, and an observation has 1: observe = [...] says",
        ),
        ("observe = [\"joints\", \"1 2\"]", "an observation has 3"),
    ] {
        let keys = format!("policy = \"net.safetensors\"\n{keys}");
        let system = opened(folder.path(), &text(&keys)).expect("a robot");
        let refused = Experiment::new(system, &config("until 1")).err();
        let error = refused.expect(expected).to_string();
        assert!(error.contains(expected), "{error}");
    }
}
