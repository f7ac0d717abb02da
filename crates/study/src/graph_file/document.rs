//! A graph file as sections with known keys, each value in its form.

use ratelab::KnobKind;
use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use super::{
    error::{Checker, GraphFileError},
    format::{FileSection, Form, FormatKey, LONGEST_MS, SECTIONS, SHORTEST_MS},
    place::Placed,
};

/// A section of the file.
#[derive(Debug)]
pub(super) struct Block {
    pub(super) section: &'static FileSection,
    /// Its own name; that of the kind of section if it has none.
    pub(super) name: Placed,
    entries: Vec<(&'static FormatKey, usize, FileValue)>,
}

/// A value in the form of its key.
#[derive(Clone, Debug)]
enum FileValue {
    Text(String),
    Number(f64),
    List(Vec<Placed>),
    Map(Vec<(Placed, Placed)>),
}

impl Block {
    fn get(&self, key: &str) -> Option<(usize, FileValue)> {
        let mut entries = self.entries.iter();
        let (_, at, value) = entries.find(|(known, ..)| known.name == key)?;
        Some((*at, value.clone()))
    }

    /// The place of the value of `key`, if it is there.
    pub(super) fn at(&self, key: &str) -> Option<usize> {
        self.get(key).map(|(at, _)| at)
    }

    /// All texts and numbers for knobs, with their keys.
    pub(super) fn knobs(&self) -> impl Iterator<Item = (&'static str, KnobKind, Placed)> {
        self.entries.iter().filter_map(|(key, at, value)| {
            let Form::Knob(kind) = key.form else {
                return None;
            };
            let text = match value {
                FileValue::Text(text) => Placed::new(text, *at),
                FileValue::Number(number) => Placed::new(&written(*number), *at),
                _ => return None,
            };
            Some((key.name, kind, text))
        })
    }

    pub(super) fn text(&self, key: &str) -> Option<Placed> {
        match self.get(key)? {
            (at, FileValue::Text(text)) => Some(Placed { text, at }),
            _ => None,
        }
    }

    pub(super) fn number(&self, key: &str) -> Option<f64> {
        match self.get(key)? {
            (_, FileValue::Number(number)) => Some(number),
            _ => None,
        }
    }

    pub(super) fn list(&self, key: &str) -> Vec<Placed> {
        match self.get(key) {
            Some((_, FileValue::List(list))) => list,
            _ => Vec::new(),
        }
    }

    pub(super) fn map(&self, key: &str) -> Vec<(Placed, Placed)> {
        match self.get(key) {
            Some((_, FileValue::Map(map))) => map,
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
    let reader = Checker { text };
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
    blocks.insert(0, reader.block(top, Placed::new("", 0), first)?);
    Ok(blocks)
}

fn placed(key: KeyOf<'_>) -> Placed {
    Placed::new(key.get_ref(), key.span().start)
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

impl Checker<'_> {
    fn table<'a>(
        &self,
        key: KeyOf<'a>,
        value: ValueOf<'a>,
        expected: &str,
    ) -> Result<&'a DeTable<'a>, GraphFileError> {
        let name = key.get_ref();
        let what = format!("{name:?}: expected a section {expected}");
        let table = value.get_ref().as_table();
        table.map_or_else(|| self.refuse(key.span().start, what), Ok)
    }

    fn block(
        &self,
        section: &'static FileSection,
        name: Placed,
        entries: Vec<(KeyOf<'_>, ValueOf<'_>)>,
    ) -> Result<Block, GraphFileError> {
        let mut known = Vec::new();
        for (key, value) in entries {
            let found = self.key(section, &placed(key))?;
            known.push((found, value.span().start, self.value(found, value)?));
        }
        let has = |key: &FormatKey| known.iter().any(|(known, ..)| known.name == key.name);
        if let Some(missing) = section.keys.iter().find(|key| key.required && !has(key)) {
            let (name_of_key, expected) = (missing.name, missing.form.expected());
            let what = match section.name {
                "" => format!("the key {name_of_key} is missing: {expected}"),
                kind => format!("{kind} {:?} has no {name_of_key}: {expected}", name.text),
            };
            return self.refuse(name.at, what);
        }
        let block = Block {
            section,
            name,
            entries: known,
        };
        self.one_of(&block)?;
        Ok(block)
    }

    /// The key of `section` with this name.
    fn key(
        &self,
        section: &'static FileSection,
        name: &Placed,
    ) -> Result<&'static FormatKey, GraphFileError> {
        let named = |word: &str| section.keys.iter().find(|key| key.name == word);
        if let Some(key) = named(&name.text) {
            return Ok(key);
        }
        let meant = MEANT.iter().find(|(other, _)| *other == name.text);
        if let Some(key) = meant.and_then(|(_, meant)| named(meant)) {
            let what = format!("unknown key {:?}: did you mean {:?}?", name.text, key.name);
            return self.refuse(name.at, what);
        }
        let sections = SECTIONS[1..].iter().map(|section| section.name);
        let sections = sections.filter(|_| section.name.is_empty());
        let keys = section.keys.iter().map(|key| key.name);
        self.unknown("unknown key", name, keys.chain(sections))
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
                self.refuse(name.at, what)
            }
            [(first, _), (second, at), ..] => {
                let what = format!("{:?} has both {first} and {second}", name.text);
                self.refuse(at, format!("{kind} {what}: leave one of them out"))
            }
            _ => Ok(()),
        }
    }

    fn value(&self, key: &FormatKey, value: ValueOf<'_>) -> Result<FileValue, GraphFileError> {
        let (form, content) = (key.form, value.get_ref());
        let number = |fits: &dyn Fn(f64) -> bool| {
            let number = number(content).filter(|number| fits(*number));
            number.map(FileValue::Number)
        };
        let found = match (form, content) {
            (Form::Name | Form::Knob(_) | Form::Match | Form::Executor, DeValue::String(text)) => {
                Some(FileValue::Text(text.to_string()))
            }
            (Form::Knob(_), _) => number(&|_| true),
            (Form::Number(most), _) => number(&|number| number > 0.0 && number <= most),
            (Form::Milliseconds, _) => number(&|ms| (SHORTEST_MS..=LONGEST_MS).contains(&ms)),
            (Form::Whole(most), _) => {
                number(&|number| number.fract() == 0.0 && (0.0..=f64::from(most)).contains(&number))
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
        let what = format!("{}: expected {}", key.name, form.expected());
        found.map_or_else(|| self.refuse(value.span().start, what), Ok)
    }
}

fn text(value: ValueOf<'_>) -> Option<Placed> {
    let text = value.get_ref().as_str()?;
    Some(Placed::new(text, value.span().start))
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
