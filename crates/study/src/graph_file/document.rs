//! A graph file as sections with known keys, each value in its form.

use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use super::{
    error::{GraphFileError, instead},
    format::{FileSection, Form, FormatKey, LONGEST_MS, SECTIONS, SHORTEST_MS},
};

/// A text with its place in the file.
#[derive(Clone, Debug)]
pub(super) struct Placed {
    pub(super) text: String,
    pub(super) at: usize,
}

/// A section of the file.
#[derive(Debug)]
pub(super) struct Block {
    pub(super) section: &'static FileSection,
    /// Its own name; that of the kind of section if it has none.
    pub(super) name: Placed,
    entries: Vec<(&'static FormatKey, usize, FileValue)>,
}

/// A value in the form of its key.
#[derive(Debug)]
enum FileValue {
    Text(String),
    Number(f64),
    List(Vec<Placed>),
    Map(Vec<(Placed, Placed)>),
}

impl Block {
    fn get(&self, key: &str) -> Option<(usize, &FileValue)> {
        let mut entries = self.entries.iter();
        let (_, at, value) = entries.find(|(known, ..)| known.name == key)?;
        Some((*at, value))
    }

    /// The place of the value of `key`, if it is there.
    pub(super) fn at(&self, key: &str) -> Option<usize> {
        self.get(key).map(|(at, _)| at)
    }

    /// All texts and numbers for knobs, with their places.
    pub(super) fn knobs(&self) -> impl Iterator<Item = (&'static FormatKey, usize, String)> {
        let knobs = self.entries.iter();
        knobs.filter_map(|(key, at, value)| match (key.form, value) {
            (Form::Knob(_), FileValue::Text(text)) => Some((*key, *at, text.clone())),
            (Form::Knob(_), FileValue::Number(number)) => Some((*key, *at, written(*number))),
            _ => None,
        })
    }

    pub(super) fn text(&self, key: &str) -> Option<Placed> {
        match self.get(key)? {
            (at, FileValue::Text(text)) => Some(Placed {
                text: text.clone(),
                at,
            }),
            _ => None,
        }
    }

    pub(super) fn number(&self, key: &str) -> Option<f64> {
        match self.get(key)? {
            (_, FileValue::Number(number)) => Some(*number),
            _ => None,
        }
    }

    pub(super) fn list(&self, key: &str) -> Vec<Placed> {
        match self.get(key) {
            Some((_, FileValue::List(list))) => list.clone(),
            _ => Vec::new(),
        }
    }

    pub(super) fn map(&self, key: &str) -> Vec<(Placed, Placed)> {
        match self.get(key) {
            Some((_, FileValue::Map(map))) => map.clone(),
            _ => Vec::new(),
        }
    }
}

/// Keys by the names that others have for them.
const MEANT: [(&str, &str); 5] = [
    ("subscribes", "reads"),
    ("subscriptions", "reads"),
    ("inputs", "reads"),
    ("outputs", "publishes"),
    ("hz", "rate"),
];

/// Reads the sections of `text`, in the order of the file; the first has the keys before all
/// sections.
pub(super) fn read(text: &str) -> Result<Vec<Block>, GraphFileError> {
    let document = DeTable::parse(text).map_err(|error| {
        let span = error.span().unwrap_or_default();
        let key = text.get(span.clone()).filter(|key| !key.trim().is_empty());
        let what = match (error.message(), key) {
            ("duplicate key", Some(key)) => format!("{key:?} is here twice: remove one"),
            (message, _) => format!("not TOML: {message}"),
        };
        GraphFileError::at(text, span.start, what)
    })?;
    let reader = DocumentReader { text };
    let [top, sections @ ..] = &SECTIONS;
    let mut first = Vec::new();
    let mut blocks = Vec::new();
    for (key, value) in in_order(document.get_ref()) {
        let name: &str = key.get_ref();
        let Some(section) = sections.iter().find(|section| section.name == name) else {
            first.push((key, value));
            continue;
        };
        let table = reader.table(key, value, &format!("[{}]", heading(section)))?;
        if !section.named {
            blocks.push(reader.block(section, placed(key), in_order(table))?);
            continue;
        }
        for (name, value) in in_order(table) {
            let table = reader.table(name, value, &format!("[{}]", heading(section)))?;
            blocks.push(reader.block(section, placed(name), in_order(table))?);
        }
    }
    blocks.sort_by_key(|block| block.name.at);
    let start = Placed {
        text: String::new(),
        at: 0,
    };
    blocks.insert(0, reader.block(top, start, first)?);
    Ok(blocks)
}

/// The heading of a section.
fn heading(section: &FileSection) -> String {
    match section.named {
        true => format!("{}.NAME", section.name),
        false => section.name.to_owned(),
    }
}

type KeyOf<'a> = &'a Spanned<toml::de::DeString<'a>>;
type ValueOf<'a> = &'a Spanned<DeValue<'a>>;

/// The entries of a table in the order of the file.
fn in_order<'a>(table: &'a DeTable<'a>) -> Vec<(KeyOf<'a>, ValueOf<'a>)> {
    let mut entries: Vec<_> = table.iter().collect();
    entries.sort_by_key(|(key, _)| key.span().start);
    entries
}

fn placed(key: KeyOf<'_>) -> Placed {
    Placed {
        text: key.get_ref().to_string(),
        at: key.span().start,
    }
}

struct DocumentReader<'t> {
    text: &'t str,
}

impl DocumentReader<'_> {
    fn refuse(&self, at: usize, what: impl Into<String>) -> GraphFileError {
        GraphFileError::at(self.text, at, what)
    }

    fn table<'a>(
        &self,
        key: KeyOf<'a>,
        value: ValueOf<'a>,
        expected: &str,
    ) -> Result<&'a DeTable<'a>, GraphFileError> {
        value.get_ref().as_table().ok_or_else(|| {
            let name = key.get_ref();
            self.refuse(
                key.span().start,
                format!("{name:?}: expected a section {expected}"),
            )
        })
    }

    fn block(
        &self,
        section: &'static FileSection,
        name: Placed,
        entries: Vec<(KeyOf<'_>, ValueOf<'_>)>,
    ) -> Result<Block, GraphFileError> {
        let mut known = Vec::new();
        for (key, value) in entries {
            let (word, at): (&str, _) = (key.get_ref(), key.span().start);
            let found = section.keys.iter().find(|known| known.name == word);
            let found = found.ok_or_else(|| {
                let keys = section.keys.iter().map(|key| key.name);
                let sections = SECTIONS[1..].iter().map(|section| section.name);
                let sections = sections.filter(|_| section.name.is_empty());
                let instead = match MEANT.iter().find(|(other, _)| *other == word) {
                    Some((_, key)) if keys.clone().any(|known| known == *key) => {
                        format!("did you mean {key:?}?")
                    }
                    _ => instead(word, keys.chain(sections)),
                };
                self.refuse(at, format!("unknown key {word:?}: {instead}"))
            })?;
            known.push((found, value.span().start, self.value(found, value)?));
        }
        let has = |key: &FormatKey| known.iter().any(|(known, ..)| known.name == key.name);
        if let Some(missing) = section.keys.iter().find(|key| key.required && !has(key)) {
            let (name_of_key, expected) = (missing.name, missing.form.expected());
            let what = match section.name {
                "" => format!("the key {name_of_key} is missing: {expected}"),
                kind => format!("{kind} {:?} has no {name_of_key}: {expected}", name.text),
            };
            return Err(self.refuse(name.at, what));
        }
        let block = Block {
            section,
            name,
            entries: known,
        };
        self.one_of(&block)?;
        Ok(block)
    }

    /// Checks that exactly one of some keys is there.
    fn one_of(&self, block: &Block) -> Result<(), GraphFileError> {
        let keys = block.section.one_of.iter();
        let there: Vec<_> = keys.filter_map(|key| Some((key, block.at(key)?))).collect();
        let (kind, name) = (block.section.name, &block.name);
        match there[..] {
            [] if !block.section.one_of.is_empty() => {
                let keys = block.section.one_of.join(" and no ");
                let what = format!("{kind} {:?} has no {keys}: add one of them", name.text);
                Err(self.refuse(name.at, what))
            }
            [(first, _), (second, at), ..] => {
                let what = format!("{:?} has both {first} and {second}", name.text);
                Err(self.refuse(at, format!("{kind} {what}: leave one of them out")))
            }
            _ => Ok(()),
        }
    }

    fn value(&self, key: &FormatKey, value: ValueOf<'_>) -> Result<FileValue, GraphFileError> {
        let form = key.form;
        let found = match (form, value.get_ref()) {
            (Form::Name | Form::Knob(_) | Form::Match | Form::Executor, DeValue::String(text)) => {
                Some(FileValue::Text(text.to_string()))
            }
            (Form::Knob(_), value) => number(value).map(FileValue::Number),
            (Form::Number(most), value) => {
                let number = number(value).filter(|number| *number > 0.0 && *number <= most);
                number.map(FileValue::Number)
            }
            (Form::Milliseconds, value) => {
                let limits = SHORTEST_MS..=LONGEST_MS;
                let number = number(value).filter(|number| limits.contains(number));
                number.map(FileValue::Number)
            }
            (Form::Whole(most), value) => {
                let whole = number(value).filter(|number| number.fract() == 0.0);
                let number = whole.filter(|number| (0.0..=f64::from(most)).contains(number));
                number.map(FileValue::Number)
            }
            (Form::Topics | Form::Nodes | Form::Path, DeValue::Array(items)) => {
                let texts = items.iter().map(text);
                texts.collect::<Option<_>>().map(FileValue::List)
            }
            (Form::Remap, DeValue::Table(table)) => {
                let pairs = in_order(table).into_iter();
                let pairs = pairs.map(|(key, value)| Some((placed(key), text(value)?)));
                pairs.collect::<Option<_>>().map(FileValue::Map)
            }
            _ => None,
        };
        found.ok_or_else(|| {
            let (name, expected) = (key.name, form.expected());
            self.refuse(value.span().start, format!("{name}: expected {expected}"))
        })
    }
}

fn text(value: ValueOf<'_>) -> Option<Placed> {
    let text = value.get_ref().as_str()?.to_owned();
    let at = value.span().start;
    Some(Placed { text, at })
}

/// A number as a person writes it: without a hundred zeros.
fn written(number: f64) -> String {
    match number.abs() {
        1e-9..1e15 | 0.0 => number.to_string(),
        _ => format!("{number:e}"),
    }
}

/// The number in `value`.
fn number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Integer(number) => {
            let whole = i64::from_str_radix(number.as_str(), number.radix()).ok()?;
            Some(whole as f64)
        }
        DeValue::Float(number) => number.as_str().parse().ok(),
        _ => None,
    }
}
