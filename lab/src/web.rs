//! A recording as a page, and the data in it.

use std::sync::Arc;

use ratelab::{Command, Event, Head, Knob, Time};
use ratelab_metrics::{PushAge, Rows};
use ratelab_recording::{Recording, Replay};
use ratelab_screen::escaped;
use ratelab_system::{Picture, Shape, Style, System};
use serde_json::{Value, json};

use crate::{
    program::{self, Program},
    summary::text::{self, ReportContext},
};

/// The page, with places for its parts.
const PAGE: &str = include_str!("web/page.html");
const STYLE: &str = include_str!("web/page.css");
const SCRIPT: &str = include_str!("web/page.js");

/// Returns a page with the [`data`] of `runs`, in the order of its slider, and a picture as SVG for
/// readers without JavaScript.
pub fn page(system: &str, quantity: &str, runs: &[Value], picture: &str) -> String {
    let data = serde_json::json!({ "quantity": quantity, "runs": runs }).to_string();
    let texts = runs.iter().map(|run| {
        let [title, summary] = ["title", "summary"].map(|key| run[key].as_str().map(escaped));
        let (title, summary) = (title.unwrap_or_default(), summary.unwrap_or_default());
        format!("<h3>{title}</h3>\n<pre>{summary}</pre>\n")
    });
    let parts = [
        ("{{style}}", STYLE.to_owned()),
        ("{{system}}", escaped(system)),
        ("{{program}}", escaped(&program::name())),
        ("{{texts}}", texts.collect()),
        ("{{picture}}", picture.to_owned()),
        ("{{script}}", SCRIPT.to_owned()),
        // Nothing in the data may end the element around it.
        ("{{data}}", data.replace('<', "\\u003c")),
    ];
    filled(PAGE, &parts)
}

/// Returns `page` with each place filled once: a part may contain what looks like a place.
fn filled(page: &str, parts: &[(&str, String)]) -> String {
    let place = |(name, text)| page.find(name).map(|at| (at, name, text));
    let first = parts.iter().map(|(name, text)| (*name, text));
    let Some((at, name, text)) = first.filter_map(place).min_by_key(|(at, ..)| *at) else {
        return page.to_owned();
    };
    let rest = filled(&page[at + name.len()..], parts);
    format!("{}{text}{rest}", &page[..at])
}

/// Maximum number of steps on the page: a minute at 50 Hz. Of a longer run it
/// shows every second, third … step.
const MAX_FRAMES: usize = 3_000;

/// Returns what the script of the page reads of the run in `recording`, which is called `setting`
/// on the slider: its title, its summary in a few lines, and its data over time.
pub fn data(recording: &Arc<Recording>, program: &Program, setting: &str) -> Value {
    let mut replay = Replay::new(recording.clone(), &program.system);
    replay.advance_to(Time::MAX);
    let system = replay.system();
    let summary = replay.summary();
    let name = recording
        .path
        .file_stem()
        .unwrap_or_default()
        .to_string_lossy();
    let title = if setting.is_empty() {
        name.into_owned()
    } else {
        format!("{setting} ({name})")
    };
    json!({
        "title": title,
        "setting": setting,
        "verdict": summary.verdict.to_string(),
        "lost": summary.verdict.is_lost(),
        "summary": text::render(&**system, &summary, &ReportContext::default()),
        "end": ms(recording.until),
        "nodes": nodes(recording),
        "topics": topics(recording),
        "plant": plant(recording, &**system),
        "signal": signal(recording, &**system),
        "events": events(recording),
    })
}

/// Returns the limits of the push age at the start of the run in `recording`, the least first: each
/// in ms and with what happens beyond it; null if none is known.
pub fn limits(recording: &Recording, system: &dyn System) -> Value {
    let limits = system.judge().age_limits(&recording.origin.config.setup);
    let limits = [
        (limits.swings(), "it swings"),
        (limits.may_fall, "it may be lost"),
        (limits.falls, "it is lost"),
    ];
    let mut limits: Vec<(f64, &str)> = limits
        .into_iter()
        .filter_map(|(limit, what)| Some((limit?.as_secs_f64() * 1e3, what)))
        .collect();
    limits.sort_by(|(one, _), (other, _)| one.total_cmp(other));
    match limits[..] {
        [] => Value::Null,
        _ => json!(limits),
    }
}

/// Returns the run time in milliseconds.
fn ms(at: Time) -> f64 {
    (at.as_secs_f64() * 1e4).round() / 10.0
}

/// Three decimals, a millimetre or a milliradian, are enough for a screen.
fn short(value: f64) -> Value {
    json!((value * 1e3).round() / 1e3)
}

/// Returns the nodes with their ticks and their rates over time.
fn nodes(recording: &Recording) -> Value {
    let nodes = recording
        .origin
        .topology
        .nodes
        .iter()
        .zip(&recording.ticks)
        .map(|(node, ticks)| {
            let rates = recording
                .events
                .iter()
                .filter_map(Event::knob)
                .filter_map(|timed| match timed.knob {
                    Knob::Rate { node: of, hz } if of == node.name => {
                        Some(json!([ms(timed.at), hz.get()]))
                    }
                    _ => None,
                });
            let first = [json!([0, node.hz.get()])];
            json!({
                "name": node.name,
                "rates": first.into_iter().chain(rates).collect::<Vec<_>>(),
                "ticks": thinned(ticks).map(|tick| ms(tick.at)).collect::<Vec<_>>(),
            })
        });
    nodes.collect()
}

/// Returns the topics that are read: messages and drops over time.
fn topics(recording: &Recording) -> Value {
    let topics = recording.origin.topology.topics.iter().zip(&recording.topics).filter(|(topic, _)| !topic.readers.is_empty()).map(|(topic, rows)| {
        let heads: Vec<&Head> = thinned(rows.heads()).collect();
        json!({
            "name": topic.name,
            "depth": topic.depth.get(),
            "from": topic.publishers,
            "to": topic.readers,
            "at": heads.iter().map(|head| ms(head.at)).collect::<Vec<_>>(),
            "published": heads.iter().map(|head| head.seq.saturating_add(1)).collect::<Vec<_>>(),
            "dropped": heads.iter().map(|head| head.dropped).collect::<Vec<_>>(),
        })
    });
    topics.collect()
}

/// Returns the picture and the push age of the last second at each step of the plant.
fn plant(recording: &Recording, system: &dyn System) -> Value {
    let empty = Rows::default();
    let rows = system
        .states_topic()
        .and_then(|state| recording.rows(state))
        .unwrap_or(&empty);
    let steps: Vec<usize> = thinned(&(0..rows.len()).collect::<Vec<_>>())
        .copied()
        .collect();
    let pictures: Vec<Picture> = steps
        .iter()
        .filter_map(|step| system.robot().picture(rows.row(*step)))
        .collect();
    let heads = steps.iter().map(|step| rows.heads()[*step]);
    let ages = push_ages(rows.heads());
    let ages = steps.iter().map(|step| ages[*step]);
    let view = pictures.first().map(|picture| picture.view);
    let still = still(&pictures);
    let moving = pictures.iter().map(|picture| {
        picture
            .shapes
            .iter()
            .filter(|shape| !still.contains(shape))
            .map(shape)
            .collect::<Vec<_>>()
    });
    json!({
        "at": heads.clone().map(|head| ms(head.at)).collect::<Vec<_>>(),
        "age": ages.collect::<Vec<_>>(),
        "view": view,
        "still": still.iter().copied().map(shape).collect::<Vec<_>>(),
        "moving": moving.collect::<Vec<_>>(),
    })
}

/// Returns the mean push age of the last second at each step of the plant (ms).
fn push_ages(steps: &[Head]) -> Vec<Option<f64>> {
    let mut age = PushAge::default();
    let ages = steps.iter().map(|step| {
        if let Some(sensed) = step.origin {
            age.push(step.at, sensed);
        }
        let late = age.lately(step.at);
        late.map(|late| (late.mean_s * 1e4).round() / 10.0)
    });
    ages.collect()
}

/// Returns the shapes that are the same in all pictures.
fn still(pictures: &[Picture]) -> Vec<&(Style, Shape)> {
    let Some((first, rest)) = pictures.split_first() else {
        return Vec::new();
    };
    let shapes = first.shapes.iter();
    shapes
        .filter(|shape| rest.iter().all(|picture| picture.shapes.contains(shape)))
        .collect()
}

/// Returns a shape as a list: style, kind, numbers.
fn shape((style, shape): &(Style, Shape)) -> Value {
    let numbers = |kind: &str, numbers: &[f64]| {
        [json!(style), json!(kind)]
            .into_iter()
            .chain(numbers.iter().map(|number| short(*number)))
            .collect()
    };
    match shape {
        Shape::Segment { from, to } => numbers("line", &[from[0], from[1], to[0], to[1]]),
        Shape::Box {
            centre,
            half,
            angle,
        } => numbers("box", &[centre[0], centre[1], half[0], half[1], *angle]),
        Shape::Circle { centre, radius } => numbers("circle", &[centre[0], centre[1], *radius]),
        Shape::Outline { corners } => numbers("outline", corners.as_flattened()),
        Shape::Label { at, text } => json!([style, "label", short(at[0]), short(at[1]), text]),
    }
}

/// Returns the first signal of the system over time.
fn signal(recording: &Recording, system: &dyn System) -> Value {
    let signal = system.signals().into_iter().next();
    let rows = signal.and_then(|signal| Some((recording.rows(&signal.topic)?, signal)));
    let Some((rows, signal)) = rows else {
        return Value::Null;
    };
    let steps: Vec<(&Head, &[f64])> = rows.iter().collect();
    let values = thinned(&steps).map(|(_, row)| short(signal.value.compute(row)));
    json!({
        "name": signal.name,
        "unit": signal.unit,
        "limits": signal.limits,
        "at": thinned(&steps).map(|(head, _)| ms(head.at)).collect::<Vec<_>>(),
        "value": values.collect::<Vec<_>>(),
    })
}

/// Returns what was done during the run, in words.
fn events(recording: &Recording) -> Value {
    let events = recording
        .events
        .iter()
        .filter(|event| !matches!(event.applied(), Some(Command::Resume)));
    events
        .map(|event| json!([ms(event.at), event.to_string()]))
        .collect()
}

/// Not more than [`MAX_FRAMES`] of `items`, evenly.
fn thinned<T>(items: &[T]) -> impl Iterator<Item = &T> {
    items
        .iter()
        .step_by(items.len().div_ceil(MAX_FRAMES).max(1))
}
