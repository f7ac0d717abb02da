//! A graph file as sections with known keys, each value in its form.

use ratelab::KnobKind;
use toml::{
    Spanned,
    de::{DeString, DeTable, DeValue},
};

use super::{
    error::{Checked, GraphRefusal, Placed, refuse, unknown},
    format::{FileSection, Form, FormatKey, SECTIONS},
};

/// A section of the file.
#[derive(Debug)]
pub(super) struct Block {
    pub(super) section: &'static FileSection,
    /// Its own name; that of the kind of section if it has none.
    pub(super) name: Placed,
    entries: Vec<BlockEntry>,
}

/// A key with its value in the form of the key.
#[derive(Debug)]
struct BlockEntry {
    key: &'static FormatKey,
    at: usize,
    /// The texts and numbers of the value, as texts; keys and values of a table in turn.
    texts: Vec<Placed>,
}

impl Block {
    fn get(&self, key: &str) -> Option<&BlockEntry> {
        self.entries.iter().find(|entry| entry.key.name == key)
    }

    /// Returns the place of the value of `key`, if it is there.
    pub(super) fn at(&self, key: &str) -> Option<usize> {
        Some(self.get(key)?.at)
    }

    /// Returns all texts and numbers for knobs, with their keys.
    pub(super) fn knobs(&self) -> impl Iterator<Item = (&'static str, KnobKind, &Placed)> {
        self.entries
            .iter()
            .filter_map(|entry| match entry.key.form {
                Form::Knob(kind) => Some((entry.key.name, kind, entry.texts.first()?)),
                _ => None,
            })
    }

    pub(super) fn text(&self, key: &str) -> Option<&Placed> {
        self.list(key).first()
    }

    pub(super) fn number(&self, key: &str) -> Option<f64> {
        self.text(key)?.text.parse().ok()
    }

    pub(super) fn list(&self, key: &str) -> &[Placed] {
        self.get(key).map_or(&[], |entry| &entry.texts)
    }
}

/// A section and a key of it, and words of ROS and of others for it.
type MeantKey = (&'static str, &'static str, &'static [&'static str]);

/// Keys by the words that others have for them.
const MEANT: [MeantKey; 19] = [
    (
        "node",
        "rate",
        &["hz", "frequency", "freq", "update_rate", "publish_rate"],
    ),
    ("node", "rate", PERIODS),
    (
        "node",
        "reads",
        &["subscribes", "subscribe", "subscription", "subscriptions"],
    ),
    (
        "node",
        "reads",
        &["subscriber", "subscribers", "input", "inputs"],
    ),
    ("node", "trigger", &["callback", "on_message"]),
    ("node", "match", &["sync", "synchronizer", "sync_policy"]),
    (
        "node",
        "publishes",
        &["output", "outputs", "publisher", "publishers", "publish"],
    ),
    (
        "node",
        "every",
        &["throttle", "decimation", "downsample", "skip"],
    ),
    ("", "at", &["events", "faults", "knobs"]),
    ("node", "group", &["callback_group", "callback_groups"]),
    ("node", "deadline_ms", &["deadline"]),
    (
        "node",
        "takes",
        &["cost", "duration", "wcet", "execution_time"],
    ),
    ("node", "wakes", &["jitter", "lateness"]),
    ("node", "offset", &["phase"]),
    (
        "node",
        "stamp",
        &[
            "header",
            "header_stamp",
            "timestamp",
            "time_stamp",
            "stamps",
        ],
    ),
    (
        "node",
        "stamp_clock",
        &[
            "clock_offset",
            "time_offset",
            "timestamp_offset",
            "sensor_clock",
        ],
    ),
    (
        "topic",
        "depth",
        &[
            "qos",
            "queue",
            "queue_size",
            "queue_depth",
            "history",
            "keep_last",
        ],
    ),
    (
        "topic",
        "link",
        &["delay", "latency", "loss", "reliability"],
    ),
    ("executor", "kind", &["threads", "type"]),
];

/// Words for the time between two ticks.
const PERIODS: &[&str] = &["period", "period_ms", "timer", "timer_period"];

/// Words that have no key, with what there is in their place.
const ELSEWHERE: [(&str, &str); 2] = [
    (
        "topic",
        "name the topic in reads, trigger or publishes of a node",
    ),
    (
        "topics",
        "name the topics in reads, trigger or publishes of a node",
    ),
];

/// Reads the sections of `text`, in the order of the file; the first has the keys before all
/// sections.
pub(super) fn read(text: &str) -> Checked<Vec<Block>> {
    let document = DeTable::parse(text).map_err(|error| {
        let span = error.span().unwrap_or_default();
        let key = text.get(span.clone()).filter(|key| !key.trim().is_empty());
        let what = match (error.message(), key) {
            ("duplicate key", Some(key)) => format!("{key:?} is here twice: remove one"),
            (message, _) => format!("not TOML: {message}"),
        };
        GraphRefusal::new(span.start, what)
    })?;
    let [top, sections @ ..] = &SECTIONS;
    let mut first = Vec::new();
    let mut blocks = Vec::new();
    for (key, value) in in_order(document.get_ref()) {
        let name: &str = key.get_ref();
        let Some(section) = sections.iter().find(|section| section.name == name) else {
            first.push((key, value));
            continue;
        };
        let content = section_table(section, key, value)?;
        if !section.named {
            blocks.push(block(section, placed(key), content)?);
            continue;
        }
        for (name, value) in content {
            let content = section_table(section, name, value)?;
            blocks.push(block(section, placed(name), content)?);
        }
    }
    blocks.sort_by_key(|block| block.name.at);
    blocks.insert(0, block(top, Placed::new("", 0), first)?);
    Ok(blocks)
}

fn placed(key: KeyOf<'_>) -> Placed {
    Placed::new(key.get_ref(), key.span().start)
}

type KeyOf<'a> = &'a Spanned<DeString<'a>>;
type ValueOf<'a> = &'a Spanned<DeValue<'a>>;
type TableEntries<'a> = Vec<(KeyOf<'a>, ValueOf<'a>)>;

/// Returns the entries of a table in the order of the file.
fn in_order<'a>(table: &'a DeTable<'a>) -> TableEntries<'a> {
    let mut entries: Vec<_> = table.iter().collect();
    entries.sort_by_key(|(key, _)| key.span().start);
    entries
}

fn section_table<'a>(
    section: &FileSection,
    key: KeyOf<'a>,
    value: ValueOf<'a>,
) -> Checked<TableEntries<'a>> {
    let own = if section.named { ".NAME" } else { "" };
    let (name, kind) = (key.get_ref(), section.name);
    let what = format!("{name:?}: expected a section [{kind}{own}]");
    let table = value.get_ref().as_table();
    table.map_or_else(
        || refuse(key.span().start, what),
        |table| Ok(in_order(table)),
    )
}

fn block(section: &'static FileSection, name: Placed, content: TableEntries<'_>) -> Checked<Block> {
    let mut entries = Vec::new();
    for (name, value) in content {
        let key = key_of(section, &placed(name))?;
        let (at, texts) = (value.span().start, texts(key, value)?);
        entries.push(BlockEntry { key, at, texts });
    }
    let block = Block {
        section,
        name,
        entries,
    };
    let mut required = section.keys.iter().filter(|key| key.required);
    if let Some(missing) = required.find(|key| block.get(key.name).is_none()) {
        let (key, expected) = (missing.name, missing.form.expected());
        let what = match section.name {
            "" => format!("the key {key} is missing: {expected}"),
            kind => format!("{kind} {:?} has no {key}: {expected}", block.name.text),
        };
        return refuse(block.name.at, what);
    }
    one_of(&block)?;
    Ok(block)
}

/// Returns the key of `section` with this name.
fn key_of(section: &'static FileSection, name: &Placed) -> Checked<&'static FormatKey> {
    let named = |word: &str| section.keys.iter().find(|key| key.name == word);
    if let Some(key) = named(&name.text) {
        return Ok(key);
    }
    if let Some(instead) = meant(section, &name.text) {
        return refuse(name.at, format!("unknown key {:?}: {instead}", name.text));
    }
    let sections = SECTIONS[1..]
        .iter()
        .map(|other| other.name)
        .filter(|_| section.name.is_empty());
    let keys = section.keys.iter().map(|key| key.name);
    unknown("unknown key", name, keys.chain(sections))
}

/// Returns what stands for a `word` of others in `section`, or else in another section.
fn meant(section: &FileSection, word: &str) -> Option<String> {
    if section.named || section.name == "clock" {
        let elsewhere = ELSEWHERE.iter().find(|(other, _)| *other == word);
        if let Some((_, what)) = elsewhere {
            return Some((*what).to_owned());
        }
    }
    let mut meant = MEANT.iter().filter(|(.., words)| words.contains(&word));
    let own = meant.clone().find(|(of, ..)| *of == section.name);
    let (of, key, _) = own.or_else(|| meant.next())?;
    let unit = if PERIODS.contains(&word) {
        " It is in ticks per second."
    } else {
        ""
    };
    if *of == section.name {
        return Some(format!("did you mean {key:?}?{unit}"));
    }
    let named = SECTIONS
        .iter()
        .any(|known| known.name == *of && known.named);
    let name = if named { ".NAME" } else { "" };
    Some(format!(
        "did you mean {key:?} in a section [{of}{name}]?{unit}"
    ))
}

/// Checks that exactly one of some keys is there.
fn one_of(block: &Block) -> Checked {
    let (keys, kind, name) = (block.section.one_of, block.section.name, &block.name);
    let there = keys.iter().filter_map(|key| Some((key, block.at(key)?)));
    match there.collect::<Vec<_>>()[..] {
        [] if !keys.is_empty() => {
            let keys = keys.join(" and no ");
            let what = format!("{kind} {:?} has no {keys}: add one of them", name.text);
            refuse(name.at, what)
        }
        [(first, _), (second, at), ..] => {
            let what = format!("{:?} has both {first} and {second}", name.text);
            refuse(at, format!("{kind} {what}: leave one of them out"))
        }
        _ => Ok(()),
    }
}

/// Returns the texts and numbers in the value of `key`.
fn texts(key: &FormatKey, value: ValueOf<'_>) -> Checked<Vec<Placed>> {
    let (at, form) = (value.span().start, key.form);
    let texts = match (form, value.get_ref()) {
        (Form::Text(_) | Form::Knob(_), DeValue::String(text)) => Some(vec![Placed::new(text, at)]),
        (Form::List(_), DeValue::Array(items)) => items.iter().map(text).collect(),
        (Form::Remap, DeValue::Table(table)) => pairs(table, text),
        (Form::Numbers, DeValue::Table(table)) => pairs(table, numbers),
        (Form::Flag, DeValue::Boolean(flag)) => Some(vec![Placed::new(&flag.to_string(), at)]),
        (Form::Events, DeValue::Table(table)) => events(table),
        (_, content) => {
            let number = number(content).filter(|number| form.has(*number));
            number.map(|number| vec![Placed::new(&written(number), at)])
        }
    };
    let what = || format!("{}: expected {}", key.name, form.expected());
    texts.map_or_else(|| refuse(at, what()), Ok)
}

/// Returns the keys and values in turn, each value as `of_value` reads it.
fn pairs(
    table: &DeTable<'_>,
    of_value: impl Fn(ValueOf<'_>) -> Option<Placed>,
) -> Option<Vec<Placed>> {
    let mut texts = Vec::new();
    for (key, value) in in_order(table) {
        texts.extend([placed(key), of_value(value)?]);
    }
    Some(texts)
}

/// Times and knobs in turn.
fn events(table: &DeTable<'_>) -> Option<Vec<Placed>> {
    let mut texts = Vec::new();
    for (key, value) in in_order(table) {
        let knobs: Vec<Placed> = match value.get_ref() {
            DeValue::Array(items) => items.iter().map(text).collect::<Option<_>>()?,
            _ => vec![text(value)?],
        };
        texts.extend(knobs.into_iter().flat_map(|knob| [placed(key), knob]));
    }
    Some(texts)
}

fn text(value: ValueOf<'_>) -> Option<Placed> {
    let text = value.get_ref().as_str()?;
    Some(Placed::new(text, value.span().start))
}

/// Returns a number, or the numbers of a list with blanks in between.
fn numbers(value: ValueOf<'_>) -> Option<Placed> {
    let items = match value.get_ref() {
        DeValue::Array(items) => items.iter().map(Spanned::get_ref).collect(),
        one => vec![one],
    };
    let items = items.into_iter().map(|item| number(item).map(written));
    let items: Vec<String> = items.collect::<Option<_>>()?;
    Some(Placed::new(&items.join(" "), value.span().start))
}

/// Returns a number as a person writes it: without a hundred zeros.
fn written(number: f64) -> String {
    match number.abs() {
        1e-9..1e15 | 0.0 => number.to_string(),
        _ => format!("{number:e}"),
    }
}

/// Returns the number in `value`.
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
