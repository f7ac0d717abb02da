//! Predictions against measurements. A question is measured when the first prediction of
//! it is read: once, or once for each learner's number that decides what is measured.

use std::collections::{BTreeMap, btree_map::Entry};

use exercises::framework::{
    Answers, Brief, Exercise, Failure, Findings, Prediction, PredictionOrigin,
};
use ratelab::Interrupt;

use super::Flags;
use crate::{error::Error, signals};

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
    /// The later prediction, if there is one.
    pub redone: Option<Prediction>,
    /// How it came into the file.
    pub origin: PredictionOrigin,
    /// What to look at.
    pub flags: Flags,
}

/// The measured questions, by name and number of the learner.
#[derive(Clone, Default)]
pub struct Measured(BTreeMap<(String, Option<u64>), Findings>);

impl Measured {
    /// Grades as [`Measured::marks`] does; `None` if `asked` is set meanwhile: then the
    /// measurement is left to a thread that ends with the program.
    ///
    /// # Errors
    /// [`Error`] if a question cannot be measured.
    pub fn marks_unless(
        &mut self,
        asked: &Interrupt,
        answers: &Answers,
    ) -> Result<Option<Vec<GradedPrediction>>, Error> {
        let (mut known, answers) = (self.clone(), answers.clone());
        let done = signals::done_unless(asked, move || {
            let marks = known.marks(&answers);
            (known, marks)
        });
        let done = done.map_err(|why| Failure::Unmeasured(format!("a measurement: {why}")))?;
        done.map_or(Ok(None), |(known, marks)| {
            *self = known;
            marks.map(Some)
        })
    }

    /// Grades the first predictions in `answers`, in the order of the questions.
    ///
    /// # Errors
    /// [`Error`] if one cannot be measured.
    fn marks(&mut self, answers: &Answers) -> Result<Vec<GradedPrediction>, Error> {
        let mut marks = Vec::new();
        for question in exercises::questions() {
            let brief = question.brief();
            let Some((prediction, origin)) = answers.first(brief).zip(answers.origin(brief)) else {
                continue;
            };
            let seed = question.draws().then(|| prediction.seed());
            let findings = self.measured(question, seed)?;
            let (right, by) = findings.judge(brief, prediction);
            marks.push(GradedPrediction {
                brief,
                prediction: prediction.clone(),
                seed,
                right,
                by,
                redone: answers.redone(brief).cloned(),
                origin,
                flags: Flags::default(),
            });
        }
        Ok(marks)
    }

    fn measured(&mut self, question: &Exercise, seed: Option<u64>) -> Result<&Findings, Error> {
        Ok(match self.0.entry((question.brief().name.clone(), seed)) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(new) => new.insert(question.measure(seed.unwrap_or_default())?),
        })
    }

    /// The questions with a prediction; with the result, if that is the same for everyone.
    pub fn questions(&self) -> impl Iterator<Item = (&'static Brief, Option<&Findings>)> {
        let all = exercises::questions().map(|question| question.brief());
        all.filter_map(|brief| {
            let mut known = self.0.iter().filter(|((name, _), _)| *name == brief.name);
            let ((_, seed), findings) = known.next()?;
            Some((brief, seed.is_none().then_some(findings)))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nobody_waits_for_a_measurement_after_an_interrupt() {
        let mut answers = Answers::default();
        let brief = exercises::find(11).expect("an exercise").brief();
        let prediction = Prediction::read("4 because I counted", brief);
        answers.set(brief, prediction.expect("a prediction"));
        let mut measured = Measured::default();
        let marks = |measured: &mut Measured, asked: &Interrupt| {
            let marks = measured.marks_unless(asked, &answers);
            marks.expect("measured").map(|marks| marks.len())
        };
        let asked = Interrupt::default();
        asked.ask();
        assert_eq!(marks(&mut measured, &asked), None);
        assert_eq!(measured.questions().count(), 0);
        assert_eq!(marks(&mut measured, &Interrupt::default()), Some(1));
        assert_eq!(measured.questions().count(), 1);
    }
}
