//! A course over the sessions of a lab: what the screen asks of it, and shows of it.

use std::path::Path;

use crossterm::event::KeyEvent;
use ratelab::Event;
use ratelab_experiment::Config;
use ratelab_metrics::Rows;
use ratelab_system::Verdict;

use crate::panes::Page;

/// A course about a system, with its exercises and one learner's answers.
pub trait Course: Send + Sync {
    /// Opens the list of exercises, for the learner's number `learner`.
    fn exercises(&self, learner: u64) -> Box<dyn CoursePanel>;

    /// Opens the verdict on the rescue in the recording at `rescue`, or why that ended early.
    fn judge(&self, rescue: Result<&Path, &str>, learner: u64) -> Box<dyn CoursePanel>;

    /// Begins to follow a rescue by hand.
    fn rescue(&self) -> Box<dyn Rescue>;

    /// Returns whether the learner has predicted the cliff, which the map shows.
    fn has_found_cliff(&self) -> bool;
}

/// The exercises over the dashboard.
pub trait CoursePanel {
    /// Handles a key.
    fn key(&mut self, key: &KeyEvent) -> PanelAction;

    /// Takes pasted text.
    fn paste(&mut self, text: &str);

    /// Shows what has been measured meanwhile; returns whether there is something new.
    fn poll(&mut self) -> bool;

    /// Returns the page on the screen.
    fn page(&self) -> Page;

    /// Returns whether the learner has predicted the limits of the push age.
    fn has_found_limits(&self) -> bool;
}

/// The request of a key to the dashboard.
#[derive(Clone, Debug, PartialEq)]
pub enum PanelAction {
    /// Keep the panel open.
    Stay,
    /// Keep it open; the question that covers the cause is answered.
    Answered,
    /// Show the graph again.
    Leave,
    /// Begin a rescue by hand.
    ByHand,
    /// Show this run, for the prediction.
    Watch(Box<Config>),
}

/// A rescue by hand that is running.
pub trait Rescue {
    /// Returns the range of the plant's signal that is safe.
    fn safe(&self) -> [f64; 2];

    /// Adds messages of the state's topic.
    fn add(&mut self, rows: &Rows);

    /// Returns how far it has come, after `events`; `lost` is the verdict of a lost run.
    fn stage(&self, events: &[Event], lost: Option<Verdict>) -> RescueAdvice;
}

/// The next step of a rescue by hand.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RescueAdvice {
    /// The step, in a line.
    pub text: String,
    /// Whether there is a result to judge.
    pub is_over: bool,
}
