//! The result as text.

use exercises::framework::{Brief, Findings, Tolerance};
use ratelab_experiment::Table;
use serde::Serialize;

use super::{
    Graded,
    files::{self, Roster},
    marks::{GradedPrediction, Measured},
    predictions,
};
use crate::summary::text::line;
use ratelab_recording::printable::one_line;

/// Columns of a line.
const WIDTH: usize = 80;

/// Returns a learner per row, then the predictions by question, then what to look at and what is
/// not acceptable.
pub fn text(graded: &[Graded], measured: &Measured, roster: Option<&Roster>) -> String {
    let questions: Vec<(&Brief, Option<&Findings>)> = measured.questions().collect();
    let mut lines = head(graded, &questions, roster);
    lines.push(String::new());
    lines.extend(learners(graded, &questions));
    for (brief, findings) in questions {
        let predicted: Vec<(f64, bool)> = predictions(graded, brief).collect();
        let right = predicted.iter().filter(|(_, right)| *right).count();
        lines.push(format!("\n{}", title(brief, findings)));
        lines.push(format!("  {right} of {} right", predicted.len()));
        lines.extend(histogram(&rows(brief, &predicted)));
        lines.extend(reasons(graded, brief));
    }
    let flagged = graded.iter().flat_map(|graded| {
        graded
            .to_look_at()
            .into_iter()
            .map(|(items, why)| format!("{} {items}: {why}", graded.learner))
    });
    lines.extend(listed("To look at", "?", flagged));
    let refused = graded
        .iter()
        .flat_map(Graded::refusals)
        .map(|(what, why)| format!("{what}: {why}"));
    lines.extend(listed("Not acceptable", "✖", refused));
    lines.join("\n")
}

/// Returns what the table is about.
fn head(
    graded: &[Graded],
    questions: &[(&Brief, Option<&Findings>)],
    roster: Option<&Roster>,
) -> Vec<String> {
    let accepted = graded.iter().filter(|graded| graded.is_accepted()).count();
    let flagged = graded
        .iter()
        .filter(|graded| !graded.to_look_at().is_empty());
    let flagged = match flagged.count() {
        0 => String::new(),
        flagged => format!(", {flagged} to look at"),
    };
    let mut lines = vec![line(
        "hand-ins",
        &format!("{}, {accepted} acceptable{flagged}", graded.len()),
    )];
    if !questions.is_empty() {
        let columns = "✓ right, ✖ wrong, with the number that was predicted first";
        lines.push(line("columns", columns));
    }
    let drawn = questions.iter().any(|(_, findings)| findings.is_none());
    match roster {
        Some(roster) => {
            let is_missing = |name: &&str| graded.iter().all(|graded| graded.learner != *name);
            let mut missing: Vec<&str> = roster.learners().filter(is_missing).collect();
            missing.sort_by(|one, other| files::order(one, other));
            let missing = if missing.is_empty() {
                "all with a hand-in".to_owned()
            } else {
                format!("without a hand-in: {}", missing.join(", "))
            };
            let learners = roster.learners().len();
            lines.push(one_line(&line("roster", &format!("{learners}, {missing}"))));
        }
        None if drawn => {
            let unchecked = "as each hand-in has it, unchecked: --roster FILE checks it";
            lines.push(line("numbers", unchecked));
        }
        None => {}
    }
    lines
}

/// Returns a headed list, if there is something in it.
fn listed(head: &str, sign: &str, items: impl Iterator<Item = String>) -> Vec<String> {
    let mut lines: Vec<String> = items
        .map(|item| one_line(&format!("  {sign} {item}")))
        .collect();
    if !lines.is_empty() {
        lines.insert(0, format!("\n{head}"));
    }
    lines
}

/// Returns number, quantity and unit of a question.
fn heading(brief: &Brief) -> String {
    let unit = match &*brief.unit {
        "" => String::new(),
        unit => format!(" {unit}"),
    };
    format!("{} {}{unit}", brief.label(), brief.quantity)
}

/// Returns the table of the learners: as many below each other as it takes for the width.
fn learners(graded: &[Graded], questions: &[(&Brief, Option<&Findings>)]) -> Vec<String> {
    let names = graded.iter().map(|graded| one_line(&graded.learner));
    let columns = vec![column("learner".to_owned(), names)];
    let width = |column: &[String]| column.iter().map(|c| c.chars().count()).max().unwrap_or(0);
    let wide = width(&columns[0]);
    let marks = questions.iter().map(|(brief, _)| {
        let cells = graded
            .iter()
            .map(|graded| graded.mark(brief))
            .map(|mark| mark.map_or("-".to_owned(), cell));
        column(heading(brief), cells)
    });
    let right = column("right".to_owned(), graded.iter().map(right));
    let sessions = column("sessions".to_owned(), graded.iter().map(sessions));
    let mut blocks = vec![columns.clone()];
    let mut used = wide;
    for column in marks.chain([right, sessions]) {
        let needs = 2 + width(&column);
        if used + needs > WIDTH && blocks.last().is_some_and(|block| block.len() > 1) {
            blocks.push(columns.clone());
            used = wide;
        }
        used += needs;
        if let Some(block) = blocks.last_mut() {
            block.push(column);
        }
    }
    blocks
        .iter()
        .map(|block| table(block))
        .collect::<Vec<_>>()
        .join(&String::new())
}

/// Returns a head and the cells below it.
fn column(head: String, cells: impl Iterator<Item = String>) -> Vec<String> {
    [head].into_iter().chain(cells).collect()
}

/// Returns the lines of a table with these columns, and an empty one after another table.
fn table(columns: &[Vec<String>]) -> Vec<String> {
    let row = |at: usize| columns.iter().map(|column| column[at].clone()).collect();
    let table = Table {
        headers: row(0),
        rows: (1..columns[0].len()).map(row).collect(),
        named: true,
    };
    table.lines()
}

/// Returns how many predictions are right.
fn right(graded: &Graded) -> String {
    let right = graded.marks.iter().filter(|mark| mark.right).count();
    format!("{right} of {}", graded.marks.len())
}

/// Returns how many sessions are acceptable.
fn sessions(graded: &Graded) -> String {
    let accepted = graded.sessions.iter().filter(|s| s.refused.is_empty());
    match (accepted.count(), graded.sessions.len()) {
        (_, 0) => "-".to_owned(),
        (1, 1) => "✓ rescued".to_owned(),
        (accepted, of) if accepted == of => format!("✓ {of} rescued"),
        (accepted, of) => format!("✖ {accepted} of {of}"),
    }
}

/// Returns a prediction in the table: with the number, if it is one.
fn cell(mark: &GradedPrediction) -> String {
    match &mark.brief.choices[..] {
        [] => format!("{} {}", sign(mark.right), mark.prediction.number()),
        _ => sign(mark.right).to_owned(),
    }
}

/// Title and result of a question, with how near a right prediction comes.
fn title(brief: &Brief, findings: Option<&Findings>) -> String {
    let measured = findings.map_or_else(
        || "drawn from the learner's number".to_owned(),
        |findings| findings.answer.in_words(brief),
    );
    let within = match brief.tolerance {
        Tolerance::Within(within) => format!(" ± {within}"),
        Tolerance::Exact | Tolerance::Between => String::new(),
    };
    format!("{} {}: {measured}{within}", brief.label(), brief.title)
}

/// Returns the predictions for a question with their reasons, and others with the same words.
fn reasons<'g>(graded: &'g [Graded], brief: &'g Brief) -> impl Iterator<Item = String> + 'g {
    let marks = graded.iter().filter_map(|g| Some((g, g.mark(brief)?)));
    marks.map(|(of, mark)| {
        let [twin, ..] = &mark.flags;
        let twins = twin.as_ref().map(|others| format!(" ({others})"));
        let drawn = mark.seed.map(|seed| format!(" (number {seed})"));
        one_line(&format!(
            "  {} {}{}: {}, {}{}",
            sign(mark.right),
            of.learner,
            drawn.unwrap_or_default(),
            brief.in_unit(mark.prediction.number()),
            mark.prediction.reason(),
            twins.unwrap_or_default(),
        ))
    })
}

fn sign(right: bool) -> &'static str {
    if right { "✓" } else { "✖" }
}

/// Rows of numbers at most; more different ones are counted in ranges.
const ROWS: usize = 9;

/// Columns of the longest bar.
const BAR: usize = 40;

/// A row: what was predicted, by how many, and how many of them are right.
#[derive(Debug, PartialEq, Eq, Serialize)]
pub struct Tally {
    /// The number or choice, or a range of numbers.
    #[serde(rename = "predicted")]
    pub what: String,
    /// How many predicted it.
    pub count: usize,
    /// How many of these are right.
    pub right: usize,
}

/// Counts `predictions`, each a number and whether it is right, in ascending order.
pub fn rows(brief: &Brief, predictions: &[(f64, bool)]) -> Vec<Tally> {
    let mut sorted = predictions.to_vec();
    sorted.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let same = sorted.chunk_by(|(a, _), (b, _)| a == b);
    if !brief.choices.is_empty() || same.clone().count() <= ROWS {
        return same.map(|of| row(brief.in_unit(of[0].0), of)).collect();
    }
    let span = sorted[sorted.len() - 1].0 - sorted[0].0;
    let width = round_step(span / (ROWS - 1) as f64);
    let range = |number: f64| (number / width).floor();
    let ranges = sorted.chunk_by(|(a, _), (b, _)| range(*a) == range(*b));
    ranges
        .map(|of| {
            let from = range(of[0].0);
            let [from, to] = [from, from + 1.0].map(|n| (n * width * 1e6).round() / 1e6);
            row(format!("{from} to below {}", brief.in_unit(to)), of)
        })
        .collect()
}

fn row(what: String, of: &[(f64, bool)]) -> Tally {
    Tally {
        what,
        count: of.len(),
        right: of.iter().filter(|(_, right)| *right).count(),
    }
}

/// Returns the next of 1, 2, 5, 10 and so on that is not below `least`.
fn round_step(least: f64) -> f64 {
    let power = 10_f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0]
        .map(|step| step * power)
        .into_iter()
        .find(|step| *step >= least)
        .unwrap_or(10.0 * power)
}

/// Returns a line for each row, with a bar.
fn histogram(rows: &[Tally]) -> Vec<String> {
    let wide = rows
        .iter()
        .map(|row| row.what.chars().count())
        .max()
        .unwrap_or(0);
    let most = rows.iter().map(|row| row.count).max().unwrap_or(0).max(BAR);
    let line = |row: &Tally| {
        let bar = "█".repeat((row.count * BAR).div_ceil(most));
        let right = match row.right {
            0 => String::new(),
            right if right == row.count => " ✓".to_owned(),
            right => format!(" ✓ {right}"),
        };
        format!("  {:>wide$}  {bar} {}{right}", row.what, row.count)
    };
    rows.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn brief(label: &str) -> &'static Brief {
        exercises::named(label)[0].brief()
    }

    #[test]
    fn a_few_numbers_are_counted_each_and_many_in_ranges() {
        let few = [(8.0, true), (20.0, false), (8.0, true)];
        let few = rows(brief("1"), &few);
        assert_eq!(histogram(&few), ["   8 Hz  ██ 2 ✓", "  20 Hz  █ 1"]);
        let many: Vec<_> = (0..30).map(|n| (f64::from(n) / 2.0, n == 15)).collect();
        let many = rows(brief("1"), &many);
        assert!(many.len() <= ROWS, "{many:?}");
        assert_eq!(many.iter().map(|row| row.count).sum::<usize>(), 30);
        assert_eq!(histogram(&many)[3], "    6 to below 8 Hz  ████ 4 ✓ 1");
    }

    #[test]
    fn choices_are_counted_by_their_names_and_long_bars_are_scaled() {
        let chosen: Vec<_> = (0..400)
            .map(|n| (f64::from(1 + n % 2), n % 2 == 0))
            .collect();
        let rows = rows(brief("10"), &chosen);
        assert_eq!(rows.len(), 2);
        assert_eq!(rows[0].what, brief("10").choices[0]);
        let lines = histogram(&rows);
        let fit = lines.iter().all(|line| line.chars().count() <= 80);
        assert!(fit, "{lines:?}");
    }
}
