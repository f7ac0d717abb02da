//! `ratelab grade`: the hand-ins of many learners in one table.
//!
//! ```text
//! folders ──► hand-ins ──► predictions against measurements ──► table, CSV, JSON
//!                    └───► sessions: rescued? verified?  ──────────┤
//!                              flags: copied? edited? redone?  ────┘
//! ```

mod files;
mod marks;
mod rows;
mod session;
mod table;

use std::path::Path;

use exercises::framework::Brief;
use files::{HandIn, Roster};
use marks::{GradedPrediction, Measured};
use ratelab::Interrupt;
use session::GradedRun;

use crate::{
    cli::GradeArgs,
    error::Error,
    output::{OutputKind, print_result},
    program::Program,
    signals,
};

/// The kinds of flags; each is a column of the CSV file.
pub const KINDS: [&str; 7] = [
    "copied_reason",
    "edited",
    "foreign_seed",
    "redone",
    "copied_rescue",
    "scripted",
    "no_reason",
];

/// The evidence for each kind of flag that a prediction or a session has.
pub type Flags = [Option<String>; KINDS.len()];

/// Grades every hand-in in a folder, and prints and writes the result. After Ctrl-C it
/// prints the hand-ins that are graded, and writes nothing.
pub fn grade(program: &Program, args: &GradeArgs) -> Result<(), Error> {
    let roster = args.roster.as_deref().map(Roster::read).transpose()?;
    let hand_ins = files::hand_ins(&args.dir)?;
    let asked = signals::interrupt();
    let measured = Measured::new(&asked, hand_ins.iter().map(|of| &of.answers))?;
    let mut graded = Vec::new();
    let all = hand_ins.len();
    for hand_in in hand_ins {
        match Graded::grade(hand_in, &measured, program, &asked)? {
            Some(hand_in) => graded.push(hand_in),
            None => break,
        }
    }
    marks::find(&mut graded, roster.as_ref());
    if let Some(file) = args.csv.as_ref().filter(|_| graded.len() == all) {
        let rows = rows::csv(&graded);
        OutputKind::Rows(rows::HEADER).write("--csv", file, &[], rows.as_bytes())?;
    }
    let table = table::text(&graded, &measured, roster.as_ref());
    print_result(
        args.json,
        &rows::GradeReport::new(&graded, &measured),
        &table,
    )?;
    let of = graded.len();
    Error::if_stopped(of, all, "hand-ins")?;
    match graded.iter().filter(|graded| !graded.is_accepted()).count() {
        0 => Ok(()),
        refused => Err(Error::Unfinished(format!(
            "{refused} of {of} hand-ins are not acceptable"
        ))),
    }
}

/// A graded hand-in.
struct Graded {
    /// Name of the learner's folder.
    learner: String,
    /// The predictions, by exercise.
    marks: Vec<GradedPrediction>,
    /// The recordings, by file name.
    sessions: Vec<GradedRun>,
    /// Why the hand-in as a whole is not acceptable, if it is not.
    refused: Option<String>,
}

impl Graded {
    /// Grades a hand-in; `None` if `asked` is set meanwhile.
    ///
    /// # Errors
    /// [`Error`] if a recording cannot be verified at all.
    fn grade(
        hand_in: HandIn,
        measured: &Measured,
        program: &Program,
        asked: &Interrupt,
    ) -> Result<Option<Self>, Error> {
        let Some(marks) = measured.marks(&hand_in.answers) else {
            return Ok(None);
        };
        let (files, program) = (hand_in.recordings, program.clone());
        let sessions: Option<Vec<_>> = signals::done_unless(asked, move || {
            files
                .iter()
                .map(|file| GradedRun::from_file(file, &program))
                .collect()
        })
        .map_err(|why| Error::Unfinished(format!("{}: verifying: {why}", hand_in.learner)))?;
        Ok(sessions.map(|sessions| Self {
            marks,
            sessions,
            refused: hand_in.refused,
            learner: hand_in.learner,
        }))
    }

    /// Returns whether everything in it is acceptable. A wrong prediction is.
    fn is_accepted(&self) -> bool {
        self.refusals().is_empty()
    }

    /// Returns the prediction for a question, if any.
    fn mark(&self, brief: &Brief) -> Option<&GradedPrediction> {
        self.marks.iter().find(|mark| mark.brief.name == brief.name)
    }

    /// Returns what is not acceptable: the file or folder, and the reason.
    fn refusals(&self) -> Vec<(String, String)> {
        let whole = self
            .refused
            .iter()
            .map(|why| (self.learner.clone(), why.clone()));
        let sessions = self.sessions.iter().flat_map(|session| {
            let name = session.name(&self.learner);
            session
                .refused
                .iter()
                .map(move |why| (name.clone(), why.clone()))
        });
        whole.chain(sessions).collect()
    }
}

/// Returns the predictions of a class for a question, each with whether it is right.
fn predictions(graded: &[Graded], brief: &Brief) -> impl Iterator<Item = (f64, bool)> {
    graded
        .iter()
        .filter_map(|graded| graded.mark(brief))
        .map(|mark| (mark.prediction.number(), mark.right))
}

/// Returns the last part of a path, as text.
fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}
