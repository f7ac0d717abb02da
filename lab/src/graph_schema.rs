//! The JSON Schema of graph files, from their table of keys.

use ratelab::{Depth, Hz, KnobKind};
use ratelab_system::graph_file::format::{
    FileSection, Form, FormatKey, LONGEST_MS, SECTIONS, SHORTEST_MS,
};
use serde_json::{Map, Value, json};

/// Returns the schema.
pub fn schema() -> Value {
    let [top, sections @ ..] = &SECTIONS;
    let mut schema = object(top);
    for section in sections {
        schema["properties"][section.name] = if section.named {
            json!({ "type": "object", "additionalProperties": object(section) })
        } else {
            object(section)
        };
    }
    schema["$schema"] = json!("https://json-schema.org/draft/2020-12/schema");
    schema["title"] = json!("Graph file of ratelab");
    schema
}

/// Returns a section as an object.
fn object(section: &FileSection) -> Value {
    let keys = section.keys.iter();
    let properties: Map<String, Value> = keys
        .map(|key| (key.name.to_owned(), property(key)))
        .collect();
    let required = section.keys.iter().filter(|key| key.required);
    let required: Vec<&str> = required.map(|key| key.name).collect();
    let mut object = json!({
        "type": "object",
        "description": section.help,
        "properties": properties,
        "required": required,
        "additionalProperties": false,
    });
    if !section.one_of.is_empty() {
        let keys = section.one_of.iter();
        object["oneOf"] = keys.map(|key| json!({ "required": [key] })).collect();
    }
    object
}

fn property(key: &FormatKey) -> Value {
    let mut property = values(key.form);
    property["description"] = json!(key.help);
    property
}

/// Returns the values of a form.
fn values(form: Form) -> Value {
    match form {
        Form::Text(_) => json!({ "type": "string" }),
        Form::Knob(KnobKind::Rate) => {
            json!({ "type": "number", "minimum": Hz::MIN.get(), "maximum": Hz::MAX.get() })
        }
        Form::Knob(KnobKind::Depth) => {
            json!({ "type": "integer", "minimum": 1, "maximum": Depth::MAX.get() })
        }
        Form::Knob(KnobKind::Read) => json!({ "enum": ["newest", "oldest"] }),
        Form::Knob(KnobKind::Link) => json!({ "type": "string" }),
        Form::Knob(_) => json!({ "type": ["number", "string"] }),
        Form::List(_) => json!({ "type": "array", "items": { "type": "string" } }),
        Form::Whole(most) => json!({ "type": "integer", "minimum": 0, "maximum": most }),
        Form::Number(most) => json!({ "type": "number", "exclusiveMinimum": 0, "maximum": most }),
        Form::Numbers => {
            let number = json!({ "type": "number" });
            let list = json!({ "type": "array", "items": number });
            json!({ "type": "object", "additionalProperties": { "anyOf": [number, list] } })
        }
        Form::Figure => json!({ "type": "number" }),
        Form::Milliseconds => {
            json!({ "type": "number", "minimum": SHORTEST_MS, "maximum": LONGEST_MS })
        }
        Form::Remap => json!({ "type": "object", "additionalProperties": { "type": "string" } }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str = include_str!("../../docs/graphs.md");

    /// Returns the keys of all sections as lists in Markdown.
    fn lists() -> String {
        let mut lines = Vec::new();
        for section in &SECTIONS {
            match (section.name, section.named) {
                ("", _) => {}
                (name, true) => lines.extend([String::new(), format!("`[{name}.NAME]`")]),
                (name, false) => lines.extend([String::new(), format!("`[{name}]`")]),
            }
            if !lines.is_empty() {
                lines.push(String::new());
            }
            for key in section.keys {
                let others = section.one_of.iter().filter(|other| **other != key.name);
                let others: Vec<String> = others.map(|other| format!("`{other}`")).collect();
                let must = match (key.required, section.one_of.contains(&key.name)) {
                    (true, _) => ", required".to_owned(),
                    (false, true) => format!(", required without {}", others.join(" or ")),
                    (false, false) => String::new(),
                };
                lines.push(format!("- `{}`: {}{must}", key.name, key.help));
            }
        }
        lines.join("\n")
    }

    #[test]
    fn the_page_has_the_keys_of_all_sections() {
        let lists = lists();
        assert!(PAGE.contains(&lists), "docs/graphs.md lacks:\n{lists}");
    }

    #[test]
    fn the_schema_has_every_key_and_section() {
        let schema = schema();
        for section in &SECTIONS[1..] {
            let section_schema = &schema["properties"][section.name];
            let object = if section.named {
                &section_schema["additionalProperties"]
            } else {
                section_schema
            };
            for key in section.keys {
                assert_eq!(object["properties"][key.name]["description"], key.help);
            }
            assert_eq!(object["additionalProperties"], false);
        }
        assert_eq!(schema["required"][0], "name");
    }
}
