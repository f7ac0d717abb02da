//! The sweep as a picture in the terminal, and its figures.

mod heat;
mod list;

use ratelab::experiment::sweep::Sweep;

use super::{
    cliff,
    summary::{RateSummary, SweepSummary},
    survival_level::SurvivalLevel,
};
use crate::{dashboard::view::theme::Theme, report::line};

/// How a map is drawn.
pub struct MapStyle {
    /// Colours and glyphs.
    pub theme: Theme,
    /// Columns that there are.
    pub width: usize,
}

/// What is said of the theory, which is not about who survives.
const THEORY: &str = "of a small deviation (1/s), by linear theory: above 0 it grows, which is no\n\
                      \x20         fall yet: where the motor gives all it has, the pole may swing and stay";

/// The map: a list of rates where all else is the same, or a line of the map
/// for each combination of what else there is.
pub fn text(summary: &SweepSummary, theory: bool, style: &MapStyle) -> String {
    let mut lines = head(summary, &style.theme);
    lines.push(String::new());
    let mut groups = summary.groups();
    match (groups.len(), groups.next()) {
        (1, Some(rows)) => {
            lines.extend(list::lines(rows, theory, &style.theme));
            lines.push(String::new());
            if summary.runs == summary.cells {
                lines.extend(cliff::lines(rows));
            }
        }
        _ => {
            lines.extend(heat::lines(summary, style));
            if theory {
                lines.push(String::new());
                lines.extend(heat::growth(summary, style));
            }
            lines.push(String::new());
            lines.push(line("cells", &heat::key(&style.theme)));
        }
    }
    if theory {
        lines.push(line("growth", THEORY));
    }
    while lines.last().is_some_and(String::is_empty) {
        lines.pop();
    }
    lines.join("\n")
}

/// What was swept, and how much of it was done.
fn head(summary: &SweepSummary, theme: &Theme) -> Vec<String> {
    let sweep = &summary.sweep;
    let runs = format!(
        "{} of {} s: {}",
        summary.cells,
        sweep.base.end.as_secs_f64(),
        factors(sweep).join(theme.glyph(" × ", " x "))
    );
    let mut lines = vec![line("runs", &runs)];
    let fixed = fixed(sweep);
    if !fixed.is_empty() {
        lines.insert(0, line("graph", &fixed));
    }
    if summary.runs < summary.cells {
        let done = format!("only {} of these runs were made", summary.runs);
        lines.push(line("stopped", &done));
    }
    lines
}

/// What has one value.
fn fixed(sweep: &Sweep) -> String {
    let parts = [
        one(&sweep.policies, |policy| {
            format!("policy {}", policy.name())
        }),
        one(&sweep.sensor_hz, |hz| format!("sensor {hz}")),
        one(&sweep.queue_depths, |depth| format!("queue depth {depth}")),
    ];
    let parts: Vec<String> = parts.into_iter().flatten().collect();
    parts.join(" | ")
}

/// The value of a list that has one, in words.
fn one<T>(values: &[T], text: impl Fn(&T) -> String) -> Option<String> {
    match values {
        [value] => Some(text(value)),
        _ => None,
    }
}

/// What has several values, and seeds and rates in any case.
fn factors(sweep: &Sweep) -> Vec<String> {
    let count = |count: usize, what: &str| {
        let plural = match what.strip_suffix('y') {
            _ if count == 1 => what.to_owned(),
            Some(stem) => format!("{stem}ies"),
            None => format!("{what}s"),
        };
        format!("{count} {plural}")
    };
    let several = [
        (sweep.policies.len(), "policy"),
        (sweep.sensor_hz.len(), "sensor rate"),
        (sweep.queue_depths.len(), "depth"),
    ];
    let several = several.into_iter().filter(|(values, _)| *values > 1);
    let always = [
        (sweep.control_hz.len(), "control rate"),
        (sweep.seeds.len(), "seed"),
    ];
    let all = several.chain(always);
    all.map(|(values, what)| count(values, what)).collect()
}

/// `text` in the colour of `level`, if there are colours.
fn paint(text: &str, level: SurvivalLevel, theme: &Theme) -> String {
    // Blue and orange of the sixteen, as in the dashboard.
    match level.is_good().filter(|_| theme.colour) {
        None => text.to_owned(),
        Some(true) => format!("\x1b[34m{text}\x1b[0m"),
        Some(false) => format!("\x1b[33m{text}\x1b[0m"),
    }
}

/// The survival level of a row.
fn level(row: &RateSummary) -> SurvivalLevel {
    SurvivalLevel::of(row.balanced, row.runs)
}

/// A growth rate (1/s).
fn growth_text(growth: Option<f64>) -> String {
    growth.map_or("-".to_owned(), |growth| format!("{growth:+.2}"))
}
