//! The result for programs: a row per prediction and per recording, and JSON.

use exercises::framework::Brief;
use serde_json::{Map, Value, json};

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

/// Returns the result as JSON.
pub fn json(graded: &[Graded], measured: &Measured) -> Value {
    let questions = measured
        .questions()
        .map(|(brief, _)| question(graded, brief));
    json!({
        "hand_ins": graded.iter().map(hand_in).collect::<Vec<_>>(),
        "questions": questions.collect::<Vec<_>>(),
    })
}

/// Returns the flags with evidence, by kind.
fn known(flags: &Flags) -> Map<String, Value> {
    let known = KINDS
        .iter()
        .zip(flags)
        .filter_map(|(kind, why)| Some(((*kind).to_owned(), json!(why.as_ref()?))));
    known.collect()
}

fn hand_in(graded: &Graded) -> Value {
    let predictions = graded.marks.iter().map(|mark| {
        json!({
            "exercise": mark.brief.label(),
            "seed": mark.seed,
            "name": mark.brief.name,
            "number": mark.prediction.number(),
            "unit": mark.brief.unit,
            "right": mark.right,
            "error": mark.by,
            "reason": mark.prediction.reason(),
            "flags": known(&mark.flags),
        })
    });
    let sessions = graded.sessions.iter().map(|session| {
        json!({
            "file": session.file_name(),
            "accepted": session.refused.is_empty(),
            "rescue": session.rescued,
            "verified": session.verified,
            "problems": session.refused,
            "flags": known(&session.flags),
        })
    });
    json!({
        "learner": graded.learner,
        "accepted": graded.is_accepted(),
        "problem": graded.refused,
        "predictions": predictions.collect::<Vec<_>>(),
        "sessions": sessions.collect::<Vec<_>>(),
    })
}

fn question(graded: &[Graded], brief: &Brief) -> Value {
    let predicted: Vec<(f64, bool)> = predictions(graded, brief).collect();
    json!({
        "exercise": brief.label(),
        "name": brief.name,
        "quantity": brief.quantity,
        "unit": brief.unit,
        "predictions": predicted.len(),
        "right": predicted.iter().filter(|(_, right)| *right).count(),
        "histogram": table::rows(brief, &predicted),
    })
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
