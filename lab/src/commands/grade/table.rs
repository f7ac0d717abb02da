//! The result as text.

use exercises::framework::{Answer, Brief, Findings, Table};

use super::{Graded, marks::GradedPrediction, marks::Measured};
use crate::{printable::one_line, report::line};

/// A learner per row, then the reasons by question, then what is not acceptable.
pub fn text(graded: &[Graded], measured: &Measured) -> String {
    let questions: Vec<(&Brief, Option<&Findings>)> = measured.questions().collect();
    let accepted = graded.iter().filter(|graded| graded.is_accepted()).count();
    let mut lines = vec![line(
        "hand-ins",
        &format!("{}, {accepted} acceptable", graded.len()),
    )];
    let names = questions.iter().map(|(brief, _)| heading(brief));
    let names: Vec<String> = names.collect();
    if !names.is_empty() {
        lines.push(line(
            "columns",
            "✓ right, ✖ wrong, with the predicted number",
        ));
    }
    lines.push(String::new());
    lines.extend(
        learners(graded, &questions, names)
            .lines()
            .map(str::to_owned),
    );
    for (brief, findings) in questions {
        lines.push(String::new());
        lines.push(title(brief, findings));
        lines.extend(reasons(graded, brief));
    }
    let refusals: Vec<_> = graded.iter().flat_map(Graded::refusals).collect();
    if !refusals.is_empty() {
        lines.push("\nNot acceptable".to_owned());
        let refusals = refusals.iter();
        lines.extend(refusals.map(|(what, why)| one_line(&format!("  ✖ {what}: {why}"))));
    }
    lines.join("\n")
}

/// Number and unit of a question.
fn heading(brief: &Brief) -> String {
    format!("{} {}", brief.label(), brief.unit)
        .trim_end()
        .to_owned()
}

/// The table of the learners.
fn learners(
    graded: &[Graded],
    questions: &[(&Brief, Option<&Findings>)],
    names: Vec<String>,
) -> String {
    let learners = graded.iter().map(|graded| one_line(&graded.learner));
    let learners: Vec<String> = learners.collect();
    let wide = learners.iter().map(|name| name.chars().count()).max();
    let wide = wide.unwrap_or(0).max("learner".len());
    let first = format!("{:<wide$}", "learner");
    let last = ["right".to_owned(), "sessions".to_owned()];
    let rows = graded.iter().zip(learners).map(|(graded, learner)| {
        let marks = questions
            .iter()
            .map(|(brief, _)| graded.mark(brief).map_or("-".to_owned(), cell));
        let right = graded.marks.iter().filter(|mark| mark.right).count();
        let right = format!("{right} of {}", graded.marks.len());
        let row = [format!("{learner:<wide$}")].into_iter().chain(marks);
        row.chain([right, sessions(graded)]).collect()
    });
    let table = Table {
        rows: rows.collect(),
        headers: [first].into_iter().chain(names).chain(last).collect(),
    };
    let lines: Vec<String> = table
        .to_string()
        .lines()
        .map(|l| l.trim_end().to_owned())
        .collect();
    lines.join("\n")
}

/// How many sessions are acceptable.
fn sessions(graded: &Graded) -> String {
    let accepted = graded.sessions.iter().filter(|s| s.refused.is_empty());
    match (accepted.count(), graded.sessions.len()) {
        (_, 0) => "-".to_owned(),
        (1, 1) => "✓ rescued".to_owned(),
        (accepted, of) if accepted == of => format!("✓ {of} rescued"),
        (accepted, of) => format!("✖ {accepted} of {of}"),
    }
}

/// A prediction in the table: with the number, if it is one.
fn cell(mark: &GradedPrediction) -> String {
    match mark.brief.choices {
        [] => format!("{} {}", sign(mark.right), mark.number),
        _ => sign(mark.right).to_owned(),
    }
}

/// Title and result of a question.
fn title(brief: &Brief, findings: Option<&Findings>) -> String {
    let rounded = |number: f64| brief.in_unit((number * 1e4).round() / 1e4);
    let measured = match findings.map(|findings| findings.answer) {
        None => "drawn from the learner's number".to_owned(),
        Some(Answer::Exactly(number)) => rounded(number),
        Some(Answer::About { number, within }) => format!("{} ± {within}", rounded(number)),
        Some(Answer::Between { held, failed }) => {
            format!("between {} and {}", rounded(held), rounded(failed))
        }
    };
    format!("{} {}: {measured}", brief.label(), brief.title)
}

/// The predictions for a question with their reasons, and others with the same words.
fn reasons<'g>(graded: &'g [Graded], brief: &'g Brief) -> impl Iterator<Item = String> + 'g {
    let marks = graded.iter().filter_map(|g| Some((g, g.mark(brief)?)));
    marks.map(|(of, mark)| {
        let twin = graded.iter().find(|other| {
            let theirs = other.mark(brief);
            other.learner != of.learner && theirs.is_some_and(|theirs| mark.is_worded_like(theirs))
        });
        let twin = twin.map(|other| format!(" (the words of {})", other.learner));
        let drawn = mark.seed.map(|seed| format!(" (number {seed})"));
        one_line(&format!(
            "  {} {}{}: {}, {}{}",
            sign(mark.right),
            of.learner,
            drawn.unwrap_or_default(),
            brief.in_unit(mark.number),
            mark.reason,
            twin.unwrap_or_default(),
        ))
    })
}

fn sign(right: bool) -> &'static str {
    if right { "✓" } else { "✖" }
}

impl Graded {
    /// The prediction for a question, if there is one.
    fn mark(&self, brief: &Brief) -> Option<&GradedPrediction> {
        self.marks.iter().find(|mark| mark.brief.name == brief.name)
    }
}
