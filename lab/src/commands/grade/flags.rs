//! What a teacher should look at, in a whole class. A flag is not a judgement: of two copies
//! nobody knows which is the original, and an early version wrote files without marks.

use exercises::{framework::PredictionOrigin, rescue::session::alike};

use super::{Flags, Graded, marks::GradedPrediction, roster::Roster};

/// Number of words from which on the same reason is worth a note: fewer are often the same
/// by chance.
const TELLING: usize = 4;

/// Flags everything in a class.
pub fn find(graded: &mut [Graded], roster: Option<&Roster>) {
    let found = graded.iter().map(|of| {
        let marks = of
            .marks
            .iter()
            .map(|mark| prediction_flags(of, mark, graded, roster));
        let sessions = 0..of.sessions.len();
        marks
            .chain(sessions.map(|at| session_flags(of, at, graded)))
            .collect()
    });
    let found: Vec<Vec<Flags>> = found.collect();
    for (graded, found) in graded.iter_mut().zip(found) {
        let marks = graded.marks.iter_mut().map(|mark| &mut mark.flags);
        let sessions = graded.sessions.iter_mut();
        let flags = marks.chain(sessions.map(|session| &mut session.flags));
        flags.zip(found).for_each(|(flags, found)| *flags = found);
    }
}

fn prediction_flags(
    of: &Graded,
    mark: &GradedPrediction,
    class: &[Graded],
    roster: Option<&Roster>,
) -> Flags {
    let edited = match mark.origin {
        PredictionOrigin::Written(_) => None,
        PredictionOrigin::Unmarked => {
            Some("without a mark: by hand or by an earlier ratelab".to_owned())
        }
        PredictionOrigin::Edited => Some("changed after ratelab wrote it".to_owned()),
    };
    let redone = mark
        .redone
        .as_ref()
        .map(|then| mark.brief.in_unit(then.number()))
        .map(|then| format!("later {then}: the first one counts"));
    let (reason, is_one) = (mark.prediction.reason(), mark.prediction.is_reasoned());
    let short = (!is_one).then(|| format!("{reason:?} is not a reason"));
    let copied = copied(of, mark, class);
    let foreign = foreign(of, mark, roster);
    [copied, edited, foreign, redone, None, None, short]
}

/// Returns the others in whose hand-in the entry, or the words, are the same.
fn copied(of: &Graded, mark: &GradedPrediction, class: &[Graded]) -> Option<String> {
    let others = class
        .iter()
        .filter(|other| other.learner != of.learner)
        .filter_map(|other| Some((&*other.learner, other.mark(mark.brief)?)));
    let (mut files, mut words) = (Vec::new(), Vec::new());
    for (learner, theirs) in others {
        if matches!(mark.origin, PredictionOrigin::Written(_)) && mark.origin == theirs.origin {
            files.push(learner);
        } else if is_worded_alike(mark.prediction.reason(), theirs.prediction.reason()) {
            words.push(learner);
        }
    }
    let said: Vec<String> = [("the entry of ", files), ("the words of ", words)]
        .iter()
        .filter(|(_, names)| !names.is_empty())
        .map(|(what, names)| format!("{what}{}", names.join(", ")))
        .collect();
    (!said.is_empty()).then(|| said.join("; "))
}

fn is_worded_alike(one: &str, other: &str) -> bool {
    let words = |reason: &str| {
        let words = reason
            .split(|c: char| !c.is_alphanumeric())
            .filter(|word| !word.is_empty())
            .map(str::to_lowercase);
        words.collect::<Vec<_>>()
    };
    let mine = words(one);
    mine.len() >= TELLING && mine == words(other)
}

/// Returns why the learner's number in a prediction is not that of the roster.
fn foreign(of: &Graded, mark: &GradedPrediction, roster: Option<&Roster>) -> Option<String> {
    let (number, roster) = (mark.seed?, roster?);
    let own = roster.number(&of.learner);
    if own == Some(number) {
        return None;
    }
    let others: Vec<&str> = roster.owners(number).collect();
    let whose = if others.is_empty() {
        String::new()
    } else {
        format!(" of {}", others.join(", "))
    };
    let own_text = own.map_or_else(|| "no number".to_owned(), |own| own.to_string());
    Some(format!(
        "about number {number}{whose}; the roster has {own_text}"
    ))
}

fn session_flags(of: &Graded, at: usize, class: &[Graded]) -> Flags {
    let session = &of.sessions[at];
    let others = class
        .iter()
        .filter(|other| other.learner != of.learner)
        .flat_map(|other| {
            let sessions = other.sessions.iter();
            let same = sessions.filter(|theirs| alike(&session.commands, &theirs.commands));
            same.map(|theirs| theirs.name(&other.learner))
        });
    let others: Vec<String> = others.collect();
    let copied = (!others.is_empty()).then(|| format!("the same session as {}", others.join(", ")));
    let scripted = session
        .scripted
        .then(|| "played from a list of knobs and not by hand".to_owned());
    [None, None, None, None, copied, scripted, None]
}

impl Graded {
    /// Returns what to look at: the items with the same evidence together, and the evidence.
    pub fn to_look_at(&self) -> Vec<(String, &str)> {
        let marks = self
            .marks
            .iter()
            .map(|mark| (mark.brief.label(), &mark.flags));
        let sessions = self
            .sessions
            .iter()
            .map(|session| (session.file_name(), &session.flags));
        let mut found: Vec<(String, &str)> = Vec::new();
        for (item, flags) in marks.chain(sessions) {
            for why in flags.iter().flatten() {
                match found.iter_mut().find(|(_, known)| known == why) {
                    Some((items, _)) => *items = format!("{items}, {item}"),
                    None => found.push((item.clone(), why)),
                }
            }
        }
        found
    }
}
