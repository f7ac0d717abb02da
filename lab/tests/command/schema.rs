//! The JSON Schemas of `run --json` and `look --json`.

use serde_json::{Value, json};

use crate::support::Folder;

/// The words of a schema that describe, and ask for nothing.
const WORDS: [&str; 4] = ["$schema", "$defs", "title", "description"];

/// What in `value` is not as `schema` has it, a part of `whole`.
fn faults(whole: &Value, schema: &Value, value: &Value, at: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (word, asked) in schema.as_object().expect("a schema") {
        match word.as_str() {
            word if WORDS.contains(&word) => {}
            "$ref" => {
                let pointer = asked.as_str().and_then(|to| to.strip_prefix('#'));
                let part = whole.pointer(pointer.expect("a pointer")).expect("a part");
                found.extend(faults(whole, part, value, at));
            }
            "type" => {
                let one = std::slice::from_ref(asked);
                let types = asked.as_array().map_or(one, Vec::as_slice);
                if !types.iter().any(|known| is(known, value)) {
                    found.push(format!("{at}: no {asked}: {value}"));
                }
            }
            "required" => {
                let names = asked.as_array().expect("names").iter();
                let missing =
                    names.filter(|name| value.get(name.as_str().expect("a name")).is_none());
                found.extend(missing.map(|name| format!("{at}: no {name}")));
            }
            "items" => {
                let items = value.as_array().into_iter().flatten();
                found.extend(items.flat_map(|item| faults(whole, asked, item, at)));
            }
            "properties" => {}
            "additionalProperties" => {
                for (name, value) in value.as_object().into_iter().flatten() {
                    let at = format!("{at}/{name}");
                    match (&schema["properties"][name.as_str()], asked) {
                        (Value::Null, Value::Bool(false)) => found.push(format!("{at}: unknown")),
                        (Value::Null, others) => found.extend(faults(whole, others, value, &at)),
                        (known, _) => found.extend(faults(whole, known, value, &at)),
                    }
                }
            }
            word => panic!("{word} is not checked"),
        }
    }
    found
}

fn is(kind: &Value, value: &Value) -> bool {
    match kind.as_str().expect("a type") {
        "integer" => value.is_u64() || value.is_i64(),
        "number" => value.is_number(),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "null" => value.is_null(),
        "array" => value.is_array(),
        kind => kind == "object" && value.is_object(),
    }
}

#[test]
fn the_metrics_of_any_run_are_as_their_schema_has_them() {
    let schema = include_str!("../../../docs/run.schema.json");
    let schema: Value = serde_json::from_str(schema).expect("JSON");
    let folder = Folder::new();
    folder.says("new robot.toml");
    for options in [
        "--clock virtual --break",
        "--clock real --duration-s 0.2",
        "--clock virtual --world own --chunk 10 --think-ms 40 --duration-s 1",
        "robot.toml --clock virtual --phases 2",
        "robot.toml --clock real --duration-s 0.2",
        "--clock virtual --duration-s 0.001",
    ] {
        let mut metrics = folder.json(&format!("run {options} --json"));
        let faults = |metrics: &Value| faults(&schema, &schema, metrics, "");
        assert_eq!(faults(&metrics), [""; 0], "{options}");
        metrics["steps"] = json!("many");
        metrics["nodes"]["more"] = json!({ "hz": 1, "overruns": 0 });
        assert_eq!(faults(&metrics).len(), 2, "{options}");
    }
}

#[test]
fn what_a_bag_says_is_as_its_schema_has_it() {
    let schema = include_str!("../../../docs/look.schema.json");
    let schema: Value = serde_json::from_str(schema).expect("JSON");
    let folder = Folder::new();
    let mut rows = "topic,log_ns,publish_ns,stamp_ns,seq\n".to_owned();
    for message in 1..=200_u64 {
        let stamp = message * 50_000_000;
        for (topic, age) in [("/image", 5_000_000), ("/objects", 30_000_000)] {
            let publish = stamp + age + message % 7 * 100_000;
            let log = publish + 400_000;
            rows += &format!("{topic},{log},{publish},{stamp},{message}\n");
        }
        rows += &format!("/bare,{stamp},0,0,{}\n", 2 * message);
    }
    folder.write("bag.csv", &rows);
    let mut said = folder.json("look bag.csv --json");
    let faults = |said: &Value| faults(&schema, &schema, said, "");
    assert_eq!(faults(&said), [""; 0]);
    said["bag"]["more"] = json!(1);
    said["topics"]["/image"]["n"] = json!("many");
    assert_eq!(faults(&said).len(), 2);
}
