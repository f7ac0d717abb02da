//! The course in the lab: its exercises over the dashboard, and a rescue by hand.

mod panel;

use std::path::{Path, PathBuf};

use exercises::{framework::Answers, rescue::session::RescueTry};
use ratelab::Event;
use ratelab_metrics::Rows;
use ratelab_screen::{Course, CoursePanel, Rescue, RescueAdvice};
use ratelab_system::Verdict;

use panel::ExercisePanel;

/// The course of the cart-pole, with the predictions of a learner.
pub struct CartPoleCourse {
    /// The file of the predictions.
    answers: PathBuf,
}

impl CartPoleCourse {
    /// Creates the course for the predictions in the file at `answers`.
    pub fn new(answers: PathBuf) -> Self {
        Self { answers }
    }

    /// Returns whether the learner has predicted the limits of the push age.
    pub fn has_found_limits(&self) -> bool {
        Answers::load(&self.answers).is_ok_and(|answers| exercises::has_found_limits(&answers))
    }
}

impl Course for CartPoleCourse {
    fn exercises(&self, learner: u64) -> Box<dyn CoursePanel> {
        Box::new(ExercisePanel::new(self.answers.clone(), learner))
    }

    fn judge(&self, rescue: Result<&Path, &str>, learner: u64) -> Box<dyn CoursePanel> {
        let panel = ExercisePanel::judging(rescue, self.answers.clone(), learner);
        Box::new(panel)
    }

    fn rescue(&self) -> Box<dyn Rescue> {
        Box::new(RescueByHand::default())
    }

    fn has_found_cliff(&self) -> bool {
        let first = exercises::find(1);
        Answers::load(&self.answers)
            .is_ok_and(|answers| first.is_some_and(|of| answers.get(of.brief()).is_some()))
    }
}

/// A rescue of the cart-pole.
#[derive(Default)]
struct RescueByHand(RescueTry);

impl Rescue for RescueByHand {
    fn safe(&self) -> [f64; 2] {
        RescueTry::SAFE_DEG
    }

    fn add(&mut self, rows: &Rows) {
        self.0.add(rows);
    }

    fn stage(&self, events: &[Event], lost: Option<Verdict>) -> RescueAdvice {
        let stage = self.0.stage(events, lost);
        RescueAdvice {
            text: stage.advice(),
            is_over: stage.is_over(),
        }
    }
}
