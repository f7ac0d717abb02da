//! The result for programs: a row per prediction and per recording, and JSON.

use std::collections::BTreeMap;

use exercises::framework::Brief;
use serde::Serialize;

use super::{
    Flags, Graded, KINDS,
    marks::{GradedPrediction, Measured},
    predictions,
    session::GradedRun,
    table,
};
use ratelab_recording::printable::row_of;

/// The first columns of the CSV file; one for each kind of flag follows.
pub const HEADER: &str = "learner,accepted,item,right,number,unit,text,problem";

/// Returns the result as CSV.
pub fn csv(graded: &[Graded]) -> String {
    let rows = graded.iter().flat_map(|graded| {
        let marks = graded
            .marks
            .iter()
            .map(|mark| (mark_cells(mark), &mark.flags));
        let sessions = graded
            .sessions
            .iter()
            .map(|session| (session_cells(session), &session.flags));
        let whole = graded.refused.iter().map(|why| (whole_cells(why), &NONE));
        marks.chain(sessions).chain(whole).map(|(cells, flags)| {
            let learner = [graded.learner.clone(), graded.is_accepted().to_string()];
            let cells = learner
                .into_iter()
                .chain(cells)
                .chain(flags.iter().map(|why| why.clone().unwrap_or_default()));
            row_of(cells.map(no_formula)) + "\n"
        })
    });
    let kinds = KINDS.join(",");
    format!("{HEADER},{kinds}\n{}", rows.collect::<String>())
}

/// A hand-in as a whole has no flags.
const NONE: Flags = [const { None }; KINDS.len()];

fn whole_cells(why: &str) -> [String; 6] {
    let cells = ["hand-in", "false", "", "", "", why];
    cells.map(str::to_owned)
}

fn mark_cells(mark: &GradedPrediction) -> [String; 6] {
    [
        format!("exercise {}", mark.brief.label()),
        mark.right.to_string(),
        match &mark.brief.choices[..] {
            [] => mark.prediction.number().to_string(),
            _ => mark.brief.in_unit(mark.prediction.number()),
        },
        mark.brief.unit.clone(),
        mark.prediction.reason().to_owned(),
        String::new(),
    ]
}

fn session_cells(session: &GradedRun) -> [String; 6] {
    [
        session.file_name(),
        session.refused.is_empty().to_string(),
        String::new(),
        String::new(),
        session.rescued.clone().unwrap_or_default(),
        session.refused.join("; "),
    ]
}

/// Returns a cell of a CSV file. A learner's text that a spreadsheet would take for a formula gets
/// an apostrophe before it.
fn no_formula(cell: String) -> String {
    let number = cell.parse::<f64>().is_ok();
    if cell.starts_with(['=', '+', '-', '@', '\t', '\r']) && !number {
        format!("'{cell}")
    } else {
        cell
    }
}

/// The result for programs.
#[derive(Serialize)]
pub struct GradeReport<'a> {
    hand_ins: Vec<HandIn<'a>>,
    questions: Vec<Question<'a>>,
}

impl<'a> GradeReport<'a> {
    /// Creates the report on what was `graded` by what was `measured`.
    pub fn new(graded: &'a [Graded], measured: &'a Measured) -> Self {
        let questions = measured.questions();
        Self {
            hand_ins: graded.iter().map(HandIn::from).collect(),
            questions: questions
                .map(|(brief, _)| Question::new(graded, brief))
                .collect(),
        }
    }
}

/// The flags with evidence, by kind.
type KnownFlags<'a> = BTreeMap<&'static str, &'a str>;

fn known(flags: &Flags) -> KnownFlags<'_> {
    let flags = KINDS.iter().zip(flags);
    flags
        .filter_map(|(kind, why)| Some((*kind, why.as_deref()?)))
        .collect()
}

/// What a learner handed in.
#[derive(Serialize)]
struct HandIn<'a> {
    learner: &'a str,
    accepted: bool,
    problem: Option<&'a str>,
    predictions: Vec<PredictionRow<'a>>,
    sessions: Vec<SessionRow<'a>>,
}

impl<'a> From<&'a Graded> for HandIn<'a> {
    fn from(graded: &'a Graded) -> Self {
        Self {
            learner: &graded.learner,
            accepted: graded.is_accepted(),
            problem: graded.refused.as_deref(),
            predictions: graded.marks.iter().map(PredictionRow::from).collect(),
            sessions: graded.sessions.iter().map(SessionRow::from).collect(),
        }
    }
}

#[derive(Serialize)]
struct PredictionRow<'a> {
    exercise: String,
    seed: Option<u64>,
    name: &'a str,
    number: f64,
    unit: &'a str,
    right: bool,
    error: &'a str,
    reason: &'a str,
    flags: KnownFlags<'a>,
}

impl<'a> From<&'a GradedPrediction> for PredictionRow<'a> {
    fn from(mark: &'a GradedPrediction) -> Self {
        Self {
            exercise: mark.brief.label(),
            seed: mark.seed,
            name: &mark.brief.name,
            number: mark.prediction.number(),
            unit: &mark.brief.unit,
            right: mark.right,
            error: &mark.by,
            reason: mark.prediction.reason(),
            flags: known(&mark.flags),
        }
    }
}

#[derive(Serialize)]
struct SessionRow<'a> {
    file: String,
    accepted: bool,
    rescue: Option<&'a str>,
    verified: Option<&'a str>,
    problems: &'a [String],
    flags: KnownFlags<'a>,
}

impl<'a> From<&'a GradedRun> for SessionRow<'a> {
    fn from(session: &'a GradedRun) -> Self {
        Self {
            file: session.file_name(),
            accepted: session.refused.is_empty(),
            rescue: session.rescued.as_deref(),
            verified: session.verified.as_deref(),
            problems: &session.refused,
            flags: known(&session.flags),
        }
    }
}

/// A question, with the predictions of all learners.
#[derive(Serialize)]
struct Question<'a> {
    exercise: String,
    name: &'a str,
    quantity: &'a str,
    unit: &'a str,
    predictions: usize,
    right: usize,
    histogram: Vec<table::Tally>,
}

impl<'a> Question<'a> {
    fn new(graded: &'a [Graded], brief: &'a Brief) -> Self {
        let predicted: Vec<(f64, bool)> = predictions(graded, brief).collect();
        Self {
            exercise: brief.label(),
            name: &brief.name,
            quantity: &brief.quantity,
            unit: &brief.unit,
            predictions: predicted.len(),
            right: predicted.iter().filter(|(_, right)| *right).count(),
            histogram: table::rows(brief, &predicted),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_quoted_and_no_text_becomes_a_formula() {
        for (cell, quoted_cell) in [
            ("plain", "plain"),
            ("a, b", "\"a, b\""),
            ("say \"no\"", "\"say \"\"no\"\"\""),
            ("=HYPERLINK(1)", "'=HYPERLINK(1)"),
            ("-1", "-1"),
            ("@SUM(1,2)", "\"'@SUM(1,2)\""),
            ("\u{1b}]0;x\u{7}\n\u{9b}2J", r"\u{1b}]0;x\u{7}\n\u{9b}2J"),
        ] {
            assert_eq!(row_of([no_formula(cell.to_owned())]), quoted_cell);
        }
    }
}
