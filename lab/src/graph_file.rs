//! Graph files: opened for a command, and their schema for editors.

use std::{path::Path, sync::Arc};

use ratelab::{Depth, Hz, KnobKind};
use ratelab_recording::with_durations_in;
use ratelab_system::{
    file,
    graph_file::{
        GraphFile, GraphFileError, MOST_BYTES, changed,
        format::{FileSection, Form, FormatKey, LONGEST_MS, SECTIONS, SHORTEST_MS},
    },
};
use serde_json::{Map, Value, json};

use crate::{
    error::Error,
    output::note,
    program::{Program, known_plants},
};

/// Returns `program` with the system of the graph file at `path`, changed by `with`, which may have
/// its own system in the middle.
///
/// # Errors
/// [`Error::BadInput`] for an unreadable file or an error in it.
pub fn open(program: &Program, path: &Path, with: &[String]) -> Result<Program, Error> {
    let text = file::read_text(path, MOST_BYTES as u64);
    let name = path.display().to_string();
    let graph = text.map_err(|why| Error::BadInput(format!("{name}: {why}")))?;
    let program = Program {
        folder: path.parent().unwrap_or(Path::new("")).to_owned(),
        unchanged: (!with.is_empty()).then(|| Arc::from(&*graph)),
        ..program.clone()
    };
    let (program, left_out) = program.with_graph_text(&name, graph, with)?;
    if !left_out.is_empty() {
        let keys = left_out.join(", ");
        note(&format!(
            "--with {} leaves out {keys}, which such a node cannot have",
            with.join("; ")
        ));
    }
    Ok(program)
}

impl Program {
    /// This program with its graph file changed by `with`.
    ///
    /// # Errors
    /// [`Error::BadInput`] if it has none, or not such a one.
    pub fn with(&self, with: &[String]) -> Result<Self, Error> {
        let text = self.system.about().graph_file.filter(|_| !with.is_empty());
        match text {
            Some(text) => Ok(self.with_graph_text("--with", text.to_owned(), with)?.0),
            None => Ok(self.clone()),
        }
    }

    /// Returns the program with the graph of `text`, from the file called `name`, changed by
    /// `with`, and the keys that this left out.
    fn with_graph_text(
        &self,
        name: &str,
        mut text: String,
        with: &[String],
    ) -> Result<(Self, Vec<String>), Error> {
        let mut left_out = Vec::new();
        for change in with {
            let changed =
                changed(&text, change).map_err(|why| Error::BadInput(format!("--with {why}")))?;
            text = changed.text;
            left_out.extend(changed.left_out);
        }
        let wrong = |GraphFileError { line, column, what }| match with {
            [] => Error::BadInput(format!("{name}:{line}:{column}: {what}")),
            with => Error::BadInput(format!("{name} --with {:?}: {what}", with.join("; "))),
        };
        let graph = GraphFile::parse(&text)
            .map_err(wrong)?
            .map_settings(|knob| with_durations_in(&self.folder, knob))
            .map_err(wrong)?;
        let known = known_plants(&graph, &self.folder, &self.built_in).map_err(wrong)?;
        let system = graph.system(&known).map_err(wrong)?;
        system.check_settings().map_err(wrong)?;
        let program = Self {
            system: Arc::new(system),
            course: false,
            built_in: self.built_in.clone(),
            file: with.is_empty().then(|| name.to_owned()),
            unchanged: self.unchanged.clone(),
            folder: self.folder.clone(),
        };
        Ok((program, left_out))
    }
}

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
    let required: Vec<&str> = section
        .keys
        .iter()
        .filter(|key| key.required)
        .map(|key| key.name)
        .collect();
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
        Form::Flag => json!({ "type": "boolean" }),
        Form::Events => {
            let list = values(Form::List(""));
            json!({ "type": "object", "additionalProperties": { "anyOf": [{ "type": "string" }, list] } })
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
