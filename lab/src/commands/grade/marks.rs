//! Marks of predictions, and what to look at in them.

use std::{
    collections::{BTreeMap, BTreeSet},
    ops::ControlFlow,
    sync::mpsc::{RecvTimeoutError, channel},
    thread,
    time::{Duration, Instant},
};

use exercises::{
    framework::{Answers, Brief, Exercise, Failure, Findings, Prediction, PredictionOrigin},
    rescue::session::alike,
};
use ratelab::Interrupt;
use ratelab_experiment::parallel::{all_cores, in_parallel};

use super::{Flags, Graded, files::Roster};
use crate::{
    error::Error,
    output::{ProgressLine, note},
};

/// A graded prediction.
pub struct GradedPrediction {
    /// The question.
    pub brief: &'static Brief,
    /// The prediction: the first one, if there is a later one.
    pub prediction: Prediction,
    /// The learner's number, if it decides what is measured.
    pub seed: Option<u64>,
    /// Whether the prediction is right.
    pub right: bool,
    /// Its deviation, as text.
    pub by: String,
    /// The later prediction, if any.
    pub redone: Option<Prediction>,
    /// How it came into the file.
    pub origin: PredictionOrigin,
    /// What to look at.
    pub flags: Flags,
}

/// Time between two looks at whether the user has had enough.
const LOOK: Duration = Duration::from_millis(50);

/// Time between two lines about the progress, where no bar shows it.
const SILENCE: Duration = Duration::from_secs(30);

/// A question, and the learner's number if that decides what is measured.
type Wanted = (&'static Exercise, Option<u64>);

/// Returns what the first predictions in `answers` are about: each question once, or once for each
/// number of a learner that decides what is measured.
fn wanted<'a>(answers: impl IntoIterator<Item = &'a Answers>) -> Vec<Wanted> {
    let mut known = BTreeSet::new();
    let pairs = answers.into_iter().flat_map(|answers| {
        exercises::questions().filter_map(move |question| {
            let prediction = answers.first(question.brief())?;
            Some((question, question.draws().then(|| prediction.seed())))
        })
    });
    let mut is_new = |(question, seed): &Wanted| known.insert((&question.brief().name, *seed));
    pairs.filter(|pair| is_new(pair)).collect()
}

/// The measured questions, by name and number of the learner.
#[derive(Default)]
pub struct Measured(BTreeMap<(String, Option<u64>), Findings>);

impl Measured {
    /// Measures what the first predictions in all `answers` are about, on all cores. If `asked` is
    /// set meanwhile, the rest is left to threads that end with the program.
    ///
    /// # Errors
    /// [`Error`] if a question cannot be measured.
    pub fn new<'a>(
        asked: &Interrupt,
        answers: impl IntoIterator<Item = &'a Answers>,
    ) -> Result<Self, Error> {
        let wanted = wanted(answers);
        let (mut measured, all) = (Self::default(), wanted.len());
        let bar = ProgressLine::new(all as u64, "all measurements".to_owned());
        let (sender, results) = channel();
        thread::spawn(move || {
            let measure = |index: usize| {
                let (question, seed): Wanted = wanted[index];
                let key = (question.brief().name.clone(), seed);
                Some((key, question.measure(seed.unwrap_or_default())))
            };
            in_parallel(all_cores(), all, measure, |_, done| {
                match sender.send(done) {
                    Ok(()) => ControlFlow::Continue(()),
                    Err(_) => ControlFlow::Break(()), // Nobody waits for it any more.
                }
            });
        });
        let mut told = Instant::now();
        while measured.0.len() < all && !asked.is_asked() {
            match results.recv_timeout(LOOK) {
                Ok((key, findings)) => {
                    measured.0.insert(key, findings?);
                    bar.advance();
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    let why = "a measurement panicked".to_owned();
                    return Err(Failure::Unmeasured(why).into());
                }
            }
            if bar.is_hidden() && told.elapsed() >= SILENCE {
                told = Instant::now();
                let done = measured.0.len();
                note(&format!("{done} of {all} measurements are done"));
            }
        }
        Ok(measured)
    }

    /// Grades the first predictions in `answers`, in the order of the questions; `None` if one is
    /// not measured.
    pub fn marks(&self, answers: &Answers) -> Option<Vec<GradedPrediction>> {
        let marks = wanted([answers]).into_iter().map(|(question, seed)| {
            let brief = question.brief();
            let (prediction, origin) = answers.first(brief).zip(answers.origin(brief))?;
            let findings = self.0.get(&(brief.name.clone(), seed))?;
            let (right, by) = findings.judge(brief, prediction);
            Some(GradedPrediction {
                brief,
                prediction: prediction.clone(),
                seed,
                right,
                by,
                redone: answers.redone(brief).cloned(),
                origin,
                flags: Flags::default(),
            })
        });
        marks.collect()
    }

    /// Returns the questions with a prediction; with the result, if that is the same for everyone.
    pub fn questions(&self) -> impl Iterator<Item = (&'static Brief, Option<&Findings>)> {
        exercises::questions()
            .map(|question| question.brief())
            .filter_map(|brief| {
                let mut known = self.0.iter().filter(|((name, _), _)| *name == brief.name);
                let ((_, seed), findings) = known.next()?;
                Some((brief, seed.is_none().then_some(findings)))
            })
    }
}

/// Number of words from which on the same reason is worth a note: fewer are often the same
/// by chance.
const TELLING: usize = 4;

/// Flags everything in a class.
pub fn find(graded: &mut [Graded], roster: Option<&Roster>) {
    let found: Vec<Vec<Flags>> = graded
        .iter()
        .map(|of| {
            let marks = of
                .marks
                .iter()
                .map(|mark| prediction_flags(of, mark, graded, roster));
            let sessions = 0..of.sessions.len();
            marks
                .chain(sessions.map(|at| session_flags(of, at, graded)))
                .collect()
        })
        .collect();
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
        reason
            .split(|c: char| !c.is_alphanumeric())
            .filter(|word| !word.is_empty())
            .map(str::to_lowercase)
            .collect::<Vec<_>>()
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
    let others: Vec<String> = class
        .iter()
        .filter(|other| other.learner != of.learner)
        .flat_map(|other| {
            other
                .sessions
                .iter()
                .filter(|theirs| alike(&session.commands, &theirs.commands))
                .map(|theirs| theirs.name(&other.learner))
        })
        .collect();
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Predictions for these questions, each with a number of the learner.
    fn answers(predicted: &[(&str, u64)]) -> Answers {
        let mut answers = Answers::default();
        for (label, seed) in predicted {
            let brief = exercises::named(label)[0].brief();
            let number = match brief.choices.first() {
                Some(choice) => choice.clone(),
                None => "4".to_owned(),
            };
            let prediction = Prediction::read(&format!("{number}, because I counted"), brief);
            answers.set(brief, prediction.expect("a prediction").about(*seed));
        }
        answers
    }

    #[test]
    fn nobody_waits_for_a_measurement_after_an_interrupt() {
        let answers = answers(&[("11", 0)]);
        let asked = Interrupt::default();
        asked.ask();
        let measured = Measured::new(&asked, [&answers]).expect("none");
        assert!(measured.marks(&answers).is_none());
        assert_eq!(measured.questions().count(), 0);
        let measured = Measured::new(&Interrupt::default(), [&answers]).expect("measured");
        assert_eq!(measured.marks(&answers).map(|marks| marks.len()), Some(1));
        assert_eq!(measured.questions().count(), 1);
    }

    #[test]
    fn a_question_is_measured_once_or_once_for_each_number_that_decides_it() {
        let class = [
            answers(&[("1", 3), ("6c", 3), ("10", 3)]),
            answers(&[("1", 4), ("6c", 4)]),
            answers(&[("6c", 3)]),
        ];
        let pairs = wanted(&class).into_iter();
        let pairs: Vec<_> = pairs.map(|(of, seed)| (of.brief().label(), seed)).collect();
        let expected = [
            ("1", None),
            ("6c", Some(3)),
            ("10", Some(3)),
            ("6c", Some(4)),
        ];
        assert_eq!(
            pairs,
            expected.map(|(label, seed)| (label.to_owned(), seed))
        );
    }
}
