//! `ratelab export-web`: recordings as one page.

use std::fs;

use serde_json::{Value, json};

use crate::support::{Folder, Said};

/// The page of these recordings in `folder`, and the numbers for its script.
fn page(folder: &Folder, files: &str) -> (Said, Value) {
    folder.says(&format!("export-web -o page.html {files}"));
    let page = Said(folder.read("page.html"));
    let begin = "<script id=\"data\" type=\"application/json\">";
    let (_, rest) = page.split_once(begin).expect("data");
    let (data, _) = rest.split_once("</script>").expect("an end");
    let data = serde_json::from_str(data).expect("JSON");
    (page, data)
}

#[test]
fn the_page_has_the_numbers_of_the_run_and_its_summary() {
    let (page, data) = page(&Folder::with(&["recordings/fall-5hz.rrd"]), "fall-5hz.rrd");
    page.has("/obs 51.2 msg/s (37 dropped)");
    let run = &data["runs"][0];
    assert_eq!(run["verdict"], "FELL at 0.840 s (pole beyond ±12°)");
    assert_eq!(run["nodes"][1]["rates"], json!([[0, 5.0]]));
    let list = |value: &Value| value.as_array().expect("a list").clone();
    assert_eq!(list(&run["topics"][0]["dropped"]).last(), Some(&json!(37)));
    let plant = &run["plant"];
    for key in ["at", "age", "moving"] {
        assert_eq!(list(&plant[key]).len(), 43, "{key}");
    }
    // The push age of the summary, and of the lab: 96 ms where the latency is 85 ms.
    assert_eq!(list(&plant["age"]).last(), Some(&json!(96.2)));
}

#[test]
fn limits_of_the_age_that_exercises_ask_for_are_drawn_only_if_asked_for() {
    let folder = Folder::with(&["recordings/fall-5hz.rrd"]);
    let (_, data) = page(&folder, "fall-5hz.rrd");
    assert_eq!(data["runs"][0]["limits"], Value::Null);
    let (_, data) = page(&folder, "--limits fall-5hz.rrd");
    let limits = data["runs"][0]["limits"]
        .as_array()
        .expect("limits")
        .clone();
    let [.., last] = &limits[..] else {
        panic!("no limits");
    };
    assert_eq!(last[1], "it is lost");
    assert!(
        last[0].as_f64().is_some_and(|ms| ms > 80.0 && ms < 96.2),
        "{last}"
    );
}

#[test]
fn several_runs_are_in_the_order_of_the_setting_in_which_they_differ() {
    let folder = Folder::with(&["recordings/fall-5hz.rrd", "recordings/balanced-50hz.rrd"]);
    let (_, data) = page(&folder, "balanced-50hz.rrd fall-5hz.rrd");
    assert_eq!(data["quantity"], "control");
    let settings = [0, 1].map(|run| &data["runs"][run]["setting"]);
    assert_eq!(settings, ["5 Hz", "50 Hz"]);
    assert_eq!(data["runs"].as_array().map(Vec::len), Some(2));
}

#[test]
fn names_of_files_cannot_end_the_script() {
    let folder = Folder::with(&["recordings/fall-5hz.rrd"]);
    let name = "<script>alert(1)<";
    fs::rename(folder.path("fall-5hz.rrd"), folder.path(name)).expect("renamed");
    let (page, _) = page(&folder, &format!("'{name}'"));
    page.lacks("<script>alert").has("&lt;script&gt;alert");
}
