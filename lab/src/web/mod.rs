//! Recorded runs as one page for the browser: it needs no other file, loads nothing, and
//! plays the runs. Its text reads itself out; without JavaScript it shows a picture and
//! the summaries.

mod data;

use ratelab_screen::escaped;
use serde_json::Value;

use crate::program;
pub use data::{data, limits};

/// The page, with places for its parts.
const PAGE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

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
