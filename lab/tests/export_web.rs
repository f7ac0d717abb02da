//! `ratelab export-web`: recordings as one page.

mod support;

use std::fs;

use serde_json::{Value, json};

use support::{complaint, folder, path, ratelab, reference};

/// The page of these recordings.
fn page(files: &[&str]) -> String {
    let folder = folder();
    let out = path(&folder, "page.html");
    let output = ratelab(&[&["export-web", "-o", &out], files].concat());
    assert!(output.status.success(), "{output:?}");
    fs::read_to_string(out).expect("written")
}

/// The numbers for its script.
fn data(page: &str) -> Value {
    let begin = "<script id=\"data\" type=\"application/json\">";
    let (_, rest) = page.split_once(begin).expect("data");
    let (data, _) = rest.split_once("</script>").expect("an end");
    serde_json::from_str(data).expect("JSON")
}

#[test]
fn the_page_has_the_numbers_of_the_run_and_its_summary() {
    let page = page(&[&reference("fall-5hz.rrd")]);
    let data = data(&page);
    let run = &data["runs"][0];
    assert_eq!(run["verdict"], "FELL at 0.840 s (pole beyond ±12°)");
    assert_eq!(run["nodes"][1]["rates"], json!([[0, 5.0]]));
    let obs = &run["topics"][0];
    assert_eq!(
        obs["dropped"].as_array().expect("a list").last(),
        Some(&37.into())
    );
    let plant = &run["plant"];
    let steps = plant["at"].as_array().expect("a list").len();
    assert_eq!(steps, 43);
    // The push age of the summary, and of the lab: 96 ms where the latency is 85 ms.
    assert_eq!(
        plant["age"].as_array().expect("ages").last(),
        Some(&json!(96.2))
    );
    for key in ["age", "moving"] {
        assert_eq!(plant[key].as_array().expect("a list").len(), steps, "{key}");
    }
    assert!(page.contains("/obs 51.2 msg/s (37 dropped)"), "no summary");
}

#[test]
fn the_page_needs_no_other_file() {
    let page = page(&[&reference("rescued.rrd")]);
    for part in ["src=", "href=", "@import", "url(http", "fetch("] {
        assert!(!page.contains(part), "{part}");
    }
    assert!(page.contains("aria-live=\"polite\""));
    assert!(
        page.contains("<figure id=\"picture\"><svg "),
        "no picture without JavaScript"
    );
}

#[test]
fn several_runs_are_in_the_order_of_the_setting_in_which_they_differ() {
    let [fall, rest] = ["fall-5hz.rrd", "balanced-50hz.rrd"].map(reference);
    let data = data(&page(&[&rest, &fall]));
    assert_eq!(data["quantity"], "control");
    let settings = data["runs"].as_array().expect("a list").iter();
    let settings: Vec<&Value> = settings.map(|run| &run["setting"]).collect();
    assert_eq!(settings, ["5 Hz", "50 Hz"]);
}

#[test]
fn names_of_files_cannot_end_the_script() {
    let folder = folder();
    let file = path(&folder, "<script>alert(1)<");
    fs::copy(reference("fall-5hz.rrd"), &file).expect("copied");
    let page = page(&[&file]);
    assert!(!page.contains("<script>alert"));
    assert!(page.contains("&lt;script&gt;alert"));
    data(&page);
}

#[test]
fn bad_input_is_refused_in_a_line() {
    let folder = folder();
    let text = path(&folder, "text.rrd");
    fs::write(&text, "no recording").expect("written");
    for args in [
        &["export-web"][..],
        &["export-web", &text],
        &["export-web", "none.rrd"],
    ] {
        complaint(&ratelab(args), 2);
    }
    let own = path(&folder, "own.rrd");
    fs::copy(reference("fall-5hz.rrd"), &own).expect("copied");
    complaint(&ratelab(&["export-web", &own, "-o", &own]), 2);
    let chain = path(&folder, "chain.rrd");
    let graph = "../graphs/robot.toml";
    let run = [
        "run",
        graph,
        "--clock",
        "virtual",
        "--duration-s",
        "1",
        "--record",
        &chain,
    ];
    assert!(ratelab(&run).status.code() != Some(2));
    for pair in [[&own, &chain], [&chain, &own]] {
        let said = complaint(&ratelab(&["export-web", pair[0], pair[1]]), 2);
        assert!(said.contains("a page holds runs of one graph"), "{said}");
    }
}
