//! A course for tests: a panel that is answered by Enter, and the rescue of the cart-pole.

use std::{
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use crossterm::event::{KeyCode, KeyEvent};
use exercises::rescue::session::{RescueTry, judge_file};
use ratelab::Event;
use ratelab_metrics::Rows;
use ratelab_system::Verdict;

use crate::{
    course::{Course, CoursePanel, PanelAction, Rescue, RescueAdvice},
    panes::Page,
};

/// The course; nothing is predicted in the beginning.
#[derive(Default)]
pub struct TestCourse {
    /// Whether all is predicted.
    predicted: Arc<AtomicBool>,
}

struct TestPanel {
    text: String,
    predicted: Arc<AtomicBool>,
}

impl TestCourse {
    fn panel(&self, text: String) -> Box<dyn CoursePanel> {
        Box::new(TestPanel {
            text,
            predicted: self.predicted.clone(),
        })
    }
}

impl Course for TestCourse {
    fn exercises(&self, _: u64) -> Box<dyn CoursePanel> {
        self.panel("the exercises".to_owned())
    }

    fn judge(&self, rescue: Result<&Path, &str>, _: u64) -> Box<dyn CoursePanel> {
        let recorded = rescue.unwrap_or_else(|why| panic!("{why}"));
        let (accepted, text) = judge_file(recorded).expect("a recording");
        self.panel(format!("accepted: {accepted}, {text}"))
    }

    fn rescue(&self) -> Box<dyn Rescue> {
        Box::new(RescueTry::default())
    }

    fn has_found_cliff(&self) -> bool {
        self.predicted.load(Ordering::Relaxed)
    }
}

impl CoursePanel for TestPanel {
    fn key(&mut self, key: &KeyEvent) -> PanelAction {
        match key.code {
            KeyCode::Esc => return PanelAction::Leave,
            KeyCode::Enter => self.predicted.store(true, Ordering::Relaxed),
            _ => {}
        }
        PanelAction::Stay
    }

    fn paste(&mut self, _: &str) {}

    fn poll(&mut self) -> bool {
        false
    }

    fn page(&self) -> Page {
        Page::text("course", self.text.clone(), "Esc back")
    }

    fn has_found_limits(&self) -> bool {
        self.predicted.load(Ordering::Relaxed)
    }
}

impl Rescue for RescueTry {
    fn safe(&self) -> [f64; 2] {
        Self::SAFE_DEG
    }

    fn add(&mut self, rows: &Rows) {
        RescueTry::add(self, rows);
    }

    fn stage(&self, events: &[Event], lost: Option<Verdict>) -> RescueAdvice {
        let stage = RescueTry::stage(self, events, lost);
        RescueAdvice {
            text: stage.advice(),
            is_over: stage.is_over(),
        }
    }
}
