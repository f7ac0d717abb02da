//! The course over a running session: its exercises, a rescue by hand, and the guided tour.

use std::path::PathBuf;

use crossterm::event::KeyEvent;
use ratelab::{Event, Speed, TimedKnob};
use ratelab_experiment::Config;

use super::App;
use crate::{
    age::{PushData, PushSentence},
    course::{CoursePanel, PanelAction, Rescue, RescueAdvice},
    frame::{FrameData, Health, Standing},
    panes::Page,
    run::WatchedRows,
    timeline::Timeline,
    tour::{Guide, OFFER, Seen, Tour},
};

/// The place of a cause that an exercise asks for.
const COVERED: &str = "the cause is covered until you have answered: e";

/// What stands in place of the parts of an age.
const COVERED_PARTS: &str = "the parts of the age are covered until you have answered: e";

/// Speed of a rescue by hand: slow enough to think.
const BY_HAND: f64 = 0.2;

/// What the course adds to a session.
#[derive(Default)]
pub struct CourseState {
    /// The learner's number: the seed of the first session.
    pub learner: u64,
    /// The exercises, while they are open.
    pub panel: Option<Box<dyn CoursePanel>>,
    /// Whether the cause of a loss is covered, because an exercise asks for it.
    pub covered: bool,
    /// The rescue by hand, while the session is one.
    pub by_hand: Option<ByHand>,
    /// What the last key would have done, which the same key does once more.
    pub warned: Option<Warned>,
    /// The position in the guided tour, during one.
    tour: Option<Tour>,
}

/// A rescue by hand that is running.
pub struct ByHand {
    /// How far it has come.
    pub rescue: Box<dyn Rescue>,
    /// The file of its recording, by which it will be judged.
    pub recording: PathBuf,
}

/// What a key does at the second time only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Warned {
    /// It gives up a rescue that can still succeed.
    GivesUp,
    /// It shows the limits that the learner is to find.
    ShowsLimits,
}

impl App {
    /// Opens the list, or judges the current rescue. A rescue that can still succeed goes
    /// on, unless this is asked for twice in a row.
    pub(super) fn open_exercises(&mut self) {
        let Some(course) = self.setup.course.clone() else {
            return self.notify("there are no exercises for this system");
        };
        let over = self.ended() || self.stage().is_none_or(|stage| stage.is_over);
        if !over && self.warns(Warned::GivesUp) {
            return self.notify("not yet, the try goes on: e again gives it up");
        }
        let (rescue, learner) = (self.rescue(), self.course.learner);
        self.course.panel = Some(match rescue {
            Some(recorded) => course.judge(recorded.as_deref().map_err(String::as_str), learner),
            None => course.exercises(learner),
        });
    }

    /// Returns how far the rescue by hand has come.
    fn stage(&self) -> Option<RescueAdvice> {
        let rescue = &self.course.by_hand.as_ref()?.rescue;
        let summary = self.shown.run.summary();
        let lost = summary
            .map(|summary| &summary.verdict)
            .filter(|verdict| verdict.is_lost())
            .cloned();
        Some(rescue.stage(&self.shown.events, lost))
    }

    /// Adds the control steps in `rows` to the rescue by hand, and its next step to
    /// `frame`.
    pub(super) fn follow_rescue(&mut self, rows: &[WatchedRows], frame: &mut FrameData) {
        let Some(ByHand { rescue, .. }) = &mut self.course.by_hand else {
            return;
        };
        let states = self.shown.run.system().states_topic();
        rows.iter()
            .filter(|(topic, _)| Some(&**topic) == states)
            .for_each(|(_, rows)| rescue.add(rows));
        let advice = self.stage().map(|stage| stage.text);
        frame.verdict.why.splice(0..0, advice);
    }

    /// Covers in `frame` what names the cause, while an exercise asks for it.
    pub(super) fn cover_cause(&self, frame: &mut FrameData) {
        if !self.course.covered {
            return;
        }
        let verdict = &mut frame.verdict;
        if matches!(verdict.standing, Standing::Warned | Standing::Lost) {
            verdict.why = vec![COVERED.to_owned()];
        }
        frame.push = frame.push.is_some().then(|| PushData {
            sentence: covered_parts(),
            reaction: None,
            mean: Default::default(),
        });
        for node in &mut frame.nodes {
            node.health = Health::Works;
        }
    }

    /// Returns the `timeline`, without words about the cause while an exercise asks for it.
    pub(super) fn cover_timeline(&self, timeline: Option<Timeline>) -> Option<Timeline> {
        let mut timeline = timeline?;
        if self.course.covered {
            timeline.sentence = covered_parts();
        }
        Some(timeline)
    }

    /// Returns whether the screen may show `event`: not the fault of a run whose cause is covered.
    pub(super) fn may_show(&self, event: &Event) -> bool {
        let of_scene = |timed: TimedKnob| {
            self.shown
                .run
                .config()
                .knobs
                .iter()
                .any(|other| other.knob == timed.knob)
        };
        !(self.course.covered && event.knob().is_some_and(of_scene))
    }

    /// Returns whether the last key did not yet warn `of` this: now this one does.
    fn warns(&mut self, of: Warned) -> bool {
        self.course.warned.replace(of) != Some(of)
    }

    /// Shows the limits of the push age, at the second time, or hides them.
    pub(super) fn toggle_limits(&mut self) {
        if self.setup.hides_limits && self.warns(Warned::ShowsLimits) {
            let warning = "exercises 6 and 7 ask for these limits. a: show them";
            return self.notify(warning);
        }
        self.setup.hides_limits ^= true;
        self.notify(if self.setup.hides_limits {
            "the limits of the push age are hidden: a, twice, shows them"
        } else {
            "the limits of the push age are shown: a hides them"
        });
    }

    /// Ends the rescue by hand; returns its recording, or why that ended early. `None` without a
    /// rescue.
    fn rescue(&mut self) -> Option<Result<PathBuf, String>> {
        let ByHand { recording, .. } = self.course.by_hand.take()?;
        self.end_recording();
        self.finish_recordings();
        self.notice = None;
        let error = self.recordings.unrecorded.as_ref();
        let error = error.filter(|error| error.path == recording);
        Some(error.map_or(Ok(recording), |error| Err(error.to_string())))
    }

    /// Sends a key to the exercises; returns whether they are open.
    pub(super) fn is_for_the_panel(&mut self, key: &KeyEvent) -> bool {
        let Some(panel) = &mut self.course.panel else {
            return false;
        };
        let action = panel.key(key);
        self.setup.hides_limits &= !panel.has_found_limits();
        self.follow_panel(action);
        true
    }

    /// Does what the exercises ask for.
    pub(crate) fn follow_panel(&mut self, action: PanelAction) {
        if !matches!(action, PanelAction::Stay | PanelAction::Answered) {
            self.course.panel = None;
        }
        match action {
            PanelAction::Stay | PanelAction::Leave => {}
            PanelAction::Answered => self.course.covered = false,
            PanelAction::ByHand => {
                self.course.covered = false;
                self.try_by_hand();
            }
            PanelAction::Watch(scene) => {
                self.course.covered = true;
                self.restart(Config {
                    speed: self.config.speed,
                    end: self.config.end,
                    ..*scene
                });
                self.notify("whose fault is it? i explains the pane in focus; e, then your answer");
            }
        }
    }

    /// Starts the usual session in slow motion, with a recording.
    pub(crate) fn try_by_hand(&mut self) {
        let config = Config {
            speed: Speed::times(BY_HAND).unwrap_or(Speed::REAL_TIME),
            end: self.config.end,
            ..Config::default()
        };
        self.start(config, true);
    }

    /// Offers the tour, or begins it.
    pub fn guide(&mut self, guide: Guide) {
        match guide {
            Guide::Nobody => {}
            Guide::Offer => self.notify(OFFER),
            Guide::Tour => self.course.tour = Some(Tour::default()),
        }
    }

    /// Begins the tour, or ends it.
    pub(super) fn toggle_tour(&mut self) {
        self.course.tour = self.course.tour.is_none().then(Tour::default);
    }

    /// Shows `key` to the tour, unless the map lies over it; returns whether it was for the tour
    /// alone.
    pub(super) fn is_for_the_tour(&mut self, key: &KeyEvent) -> bool {
        self.visible_map().is_none() && Tour::take(&mut self.course.tour, key)
    }

    /// Returns the step of the tour, about the run in `frame`.
    pub(super) fn tour_page(&self, frame: &FrameData) -> Option<Page> {
        let run = || Seen::from_frame(frame, &self.wanted(), self.ended());
        let tour = self.course.tour.filter(|_| self.is_live());
        tour.map(|tour| tour.page(&run()))
    }
}

/// In place of a sentence about the parts of an age.
fn covered_parts() -> PushSentence {
    PushSentence(vec![COVERED_PARTS.to_owned()])
}
