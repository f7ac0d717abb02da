//! The result for programs: a row per prediction and per recording, and JSON.

use serde_json::{Value, json};

use super::{Graded, file_name, marks::GradedPrediction, session::GradedRun};

/// The columns of the CSV file.
pub const HEADER: &str = "learner,accepted,item,right,number,unit,text,problem";

/// The result as CSV.
pub fn csv(graded: &[Graded]) -> String {
    let rows = graded.iter().flat_map(|graded| {
        let marks = graded.marks.iter().map(mark_cells);
        let sessions = graded.sessions.iter().map(session_cells);
        let whole = graded.refused.iter().map(|why| {
            let empty = String::new;
            [
                "hand-in".to_owned(),
                "false".to_owned(),
                empty(),
                empty(),
                empty(),
                why.clone(),
            ]
        });
        marks.chain(sessions).chain(whole).map(|cells| {
            let learner = [graded.learner.clone(), graded.is_accepted().to_string()];
            let cells = learner.iter().chain(&cells).map(|cell| quoted(cell));
            cells.collect::<Vec<_>>().join(",") + "\n"
        })
    });
    format!("{HEADER}\n{}", rows.collect::<String>())
}

fn mark_cells(mark: &GradedPrediction) -> [String; 6] {
    [
        format!("exercise {}", mark.brief.label()),
        mark.right.to_string(),
        match mark.brief.choices {
            [] => mark.number.to_string(),
            _ => mark.brief.in_unit(mark.number),
        },
        mark.brief.unit.to_owned(),
        mark.reason.clone(),
        String::new(),
    ]
}

fn session_cells(session: &GradedRun) -> [String; 6] {
    [
        file_name(&session.file),
        session.refused.is_empty().to_string(),
        String::new(),
        String::new(),
        session.rescued.clone().unwrap_or_default(),
        session.refused.join("; "),
    ]
}

/// A cell of a CSV file. A learner's text that a spreadsheet would take for a formula gets
/// an apostrophe before it.
fn quoted(cell: &str) -> String {
    let number = cell.parse::<f64>().is_ok();
    let formula = cell.starts_with(['=', '+', '-', '@', '\t', '\r']) && !number;
    let cell = if formula {
        format!("'{cell}")
    } else {
        cell.to_owned()
    };
    match cell.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", cell.replace('"', "\"\"")),
        false => cell,
    }
}

/// The result as JSON.
pub fn json(graded: &[Graded]) -> Value {
    let learners = graded.iter().map(|graded| {
        json!({
            "learner": graded.learner,
            "accepted": graded.is_accepted(),
            "problem": graded.refused,
            "predictions": graded.marks.iter().map(|mark| json!({
                "exercise": mark.brief.label(),
                "seed": mark.seed,
                "name": mark.brief.name,
                "number": mark.number,
                "unit": mark.brief.unit,
                "right": mark.right,
                "error": mark.by,
                "reason": mark.reason,
            })).collect::<Vec<_>>(),
            "sessions": graded.sessions.iter().map(|session| json!({
                "file": file_name(&session.file),
                "accepted": session.refused.is_empty(),
                "rescue": session.rescued,
                "verified": session.verified,
                "problems": session.refused,
            })).collect::<Vec<_>>(),
        })
    });
    json!({ "hand_ins": learners.collect::<Vec<_>>() })
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
        ] {
            assert_eq!(quoted(cell), quoted_cell);
        }
    }
}
