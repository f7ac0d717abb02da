//! `ratelab export-web`: recordings as one page.

mod support;

use std::fs;

use serde_json::{Value, json};
use support::{Folder, Said, User};

/// The page of these recordings in `folder`.
fn page(folder: &Folder, files: &str) -> Said {
    folder.says(&format!("export-web -o page.html {files}"));
    Said(folder.read("page.html"))
}

/// The numbers for its script.
fn data(page: &Said) -> Value {
    let begin = "<script id=\"data\" type=\"application/json\">";
    let (_, rest) = page.split_once(begin).expect("data");
    let (data, _) = rest.split_once("</script>").expect("an end");
    serde_json::from_str(data).expect("JSON")
}

#[test]
fn the_page_has_the_numbers_of_the_run_and_its_summary() {
    let folder = Folder::with(&["recordings/fall-5hz.rrd"]);
    let page = page(&folder, "fall-5hz.rrd");
    page.has("/obs 51.2 msg/s (37 dropped)");
    let data = data(&page);
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
fn the_page_needs_no_other_file() {
    let folder = Folder::with(&["recordings/rescued.rrd"]);
    let page = page(&folder, "rescued.rrd");
    for part in ["src=", "href=", "@import", "url(http", "fetch("] {
        page.lacks(part);
    }
    page.has("aria-live=\"polite\"");
    // A picture without JavaScript.
    page.has("<figure id=\"picture\"><svg ");
}

#[test]
fn several_runs_are_in_the_order_of_the_setting_in_which_they_differ() {
    let folder = Folder::with(&["recordings/fall-5hz.rrd", "recordings/balanced-50hz.rrd"]);
    let data = data(&page(&folder, "balanced-50hz.rrd fall-5hz.rrd"));
    assert_eq!(data["quantity"], "control");
    let settings = data["runs"].as_array().expect("a list").iter();
    let settings: Vec<&Value> = settings.map(|run| &run["setting"]).collect();
    assert_eq!(settings, ["5 Hz", "50 Hz"]);
}

#[test]
fn names_of_files_cannot_end_the_script() {
    let folder = Folder::with(&["recordings/fall-5hz.rrd"]);
    let name = "<script>alert(1)<";
    fs::rename(folder.path("fall-5hz.rrd"), folder.path(name)).expect("renamed");
    let page = page(&folder, name);
    page.lacks("<script>alert").has("&lt;script&gt;alert");
    data(&page);
}

#[test]
fn bad_input_is_refused_in_a_line() {
    let folder = Folder::with(&["recordings/fall-5hz.rrd", "graphs/robot.toml"]);
    folder.write("text.rrd", "no recording");
    let run = "run robot.toml --clock virtual --duration-s 1 --record chain.rrd";
    assert_ne!(folder.does(run).status.code(), Some(2));
    folder.refuses_each(
        "export-web",
        "
         text.rrd               | text.rrd
         none.rrd               | none.rrd
         fall-5hz.rrd -o fall-5hz.rrd | fall-5hz.rrd
         fall-5hz.rrd chain.rrd | a page holds runs of one graph
         chain.rrd fall-5hz.rrd | a page holds runs of one graph",
    );
    folder.refuses("export-web");
}
