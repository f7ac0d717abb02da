//! The exercises over the dashboard: choose one, predict, measure.

use std::{
    path::{Path, PathBuf},
    thread,
};

use crossbeam_channel::{Receiver, TryRecvError, bounded};
use crossterm::event::{KeyCode, KeyEvent};
use exercises::{
    framework::{Answers, Exercise, Failure, Findings, Prediction},
    questions,
    rescue::session::{RESCUE, judge_file},
};
use ratelab_screen::{CoursePanel, JUMP, Page, PanelAction, scrolled};

/// The keys of the panel, for the bottom line.
const HINTS: &[(&str, &str)] = &[
    ("Enter", "go on"),
    ("Tab", "hint"),
    ("↑ ↓ PgUp PgDn", "move"),
    ("Esc", "back"),
    ("Ctrl-C", "quit"),
];

/// The panel of the exercises.
pub struct ExercisePanel {
    file: PathBuf,
    answers: Answers,
    /// The learner's number, for questions that draw what they measure.
    seed: u64,
    /// The number of the question that is asked, or marked in the list.
    at: usize,
    page: PanelPage,
    /// Lines of the text above the first shown.
    scroll: usize,
}

enum PanelPage {
    /// The list.
    List,
    /// The question, with the prediction typed so far.
    Question {
        typed: String,
        refused: Option<String>,
        /// Whether the hint is shown.
        hinted: bool,
    },
    /// Waiting for the measurement.
    Measuring {
        prediction: Prediction,
        findings: Receiver<Result<Findings, Failure>>,
    },
    /// The result; Enter begins a rescue if it is about one by hand.
    Text { page: Page, by_hand: bool },
}

impl ExercisePanel {
    /// Opens the list of exercises, for the predictions in `file` and the learner's number
    /// `seed`.
    pub fn new(file: PathBuf, seed: u64) -> Self {
        let (answers, page) = match Answers::load(&file) {
            Ok(answers) => (answers, PanelPage::List),
            Err(error) => {
                let page = text_page("exercises", error.to_string(), false);
                (Answers::default(), page)
            }
        };
        Self {
            at: exercises::next(&answers).map_or(0, index),
            file,
            answers,
            seed,
            page,
            scroll: 0,
        }
    }

    /// Opens the verdict on the rescue in the recording at `rescue`, or why that ended early.
    pub fn judging(rescue: Result<&Path, &str>, file: PathBuf, seed: u64) -> Self {
        let text = match rescue.map(judge_file) {
            Ok(Ok((true, text))) => format!("✓ {text}"),
            Ok(Ok((false, text))) => format!("✖ {text}"),
            Ok(Err(error)) => error.to_string(),
            Err(why) => why.to_owned(),
        };
        let text = format!(
            "{text}\n\nEnter begins another try. Esc goes back to the graph: that run is no try any \
             more."
        );
        Self {
            at: 0,
            page: text_page("5 Rescue it", text, true),
            ..Self::new(file, seed)
        }
    }

    /// Returns the question that is asked, or marked in the list.
    fn exercise(&self) -> &'static Exercise {
        let all: Vec<&Exercise> = questions().collect();
        all[self.at]
    }

    /// Returns the place of the question after `exercise`: the next one of its own, or the next of
    /// all.
    fn after(&self, exercise: &Exercise) -> usize {
        let mut parts = exercises::parts(exercise.brief().number);
        let open = parts.find(|part| self.answers.get(part.brief()).is_none());
        open.or(exercises::next(&self.answers))
            .map_or(self.at, index)
    }

    /// Moves the mark of the list, or the text, or edits what is typed.
    fn go(&mut self, key: KeyCode) {
        let (row, last) = match &self.page {
            PanelPage::List => (&mut self.at, questions().len() - 1),
            _ => (&mut self.scroll, usize::MAX),
        };
        if let Some(to) = scrolled(*row, key) {
            *row = to.min(last);
            return;
        }
        match (&mut self.page, key) {
            (PanelPage::List, KeyCode::Char(digit)) => {
                let number = digit.to_digit(10);
                let index = questions()
                    .map(|exercise| exercise.brief().number)
                    .position(|of| Some(of) == number);
                self.at = index.unwrap_or(self.at);
            }
            (PanelPage::Question { hinted, .. }, KeyCode::Tab) => *hinted = true,
            (PanelPage::Question { typed, .. }, KeyCode::Char(letter)) => typed.push(letter),
            (PanelPage::Question { typed, .. }, KeyCode::Backspace) => drop(typed.pop()),
            _ => {}
        }
    }

    fn enter(&mut self) -> PanelAction {
        let exercise = self.exercise();
        match &mut self.page {
            PanelPage::List => self.open(),
            PanelPage::Question { typed, .. }
                if typed.trim().is_empty()
                    && let Ok(Some(scene)) = exercise.scene(self.seed) =>
            {
                return PanelAction::Watch(Box::new(scene));
            }
            PanelPage::Question { typed, refused, .. } => {
                match Prediction::read(typed, exercise.brief()) {
                    Ok(prediction) => return self.predict(prediction),
                    Err(error) => *refused = Some(error.to_string()),
                }
            }
            PanelPage::Text { by_hand: true, .. } => return PanelAction::ByHand,
            PanelPage::Text { .. } => self.page = PanelPage::List,
            PanelPage::Measuring { .. } => {}
        }
        PanelAction::Stay
    }

    /// Shows the result of an answered question, or asks it.
    fn open(&mut self) {
        let exercise = self.exercise();
        let brief = exercise.brief();
        let known = |of: &Exercise| self.answers.get(of.brief());
        let first = exercises::parts(brief.number).find(|part| known(part).is_none());
        let earlier = first.filter(|first| first.brief().part < brief.part);
        self.page = match (known(exercise), earlier) {
            (Some(known), _) => measure(exercise, known.clone()),
            (None, Some(earlier)) => {
                self.at = index(earlier);
                let label = earlier.brief().label();
                let text = format!(
                    "Begin with {label}: the figures of one question are there for the next."
                );
                text_page(&*brief.title, text, false)
            }
            (None, None) => PanelPage::Question {
                typed: String::new(),
                refused: None,
                hinted: false,
            },
        };
    }

    fn predict(&mut self, prediction: Prediction) -> PanelAction {
        let exercise = self.exercise();
        let prediction = match self.seed {
            seed if seed > 0 && exercise.draws() => prediction.about(seed),
            _ => prediction,
        };
        // The file may have changed, or must not be overwritten.
        let saved = Answers::change(&self.file, |answers| {
            answers.set(exercise.brief(), prediction.clone());
        });
        match saved {
            Ok(answers) => self.answers = answers,
            Err(error) => {
                self.page = text_page(&*exercise.brief().title, error.to_string(), false);
                return PanelAction::Stay;
            }
        }
        self.page = measure(exercise, prediction);
        match exercise.scene(self.seed) {
            Ok(Some(_)) => PanelAction::Answered,
            _ => PanelAction::Stay,
        }
    }

    /// Returns the question, below what is `said` of the last key.
    fn question(&self, typed: &str, said: Option<String>) -> Page {
        let exercise = self.exercise();
        let brief = exercise.brief();
        let (asked, objective) = (brief.asked(), &brief.objective);
        // After an answer that is none, or a request for the hint, that and the question come
        // first, so that a small screen shows them.
        let text = match said {
            Some(said) => format!("{said}\n\n{asked}\n\n{objective}"),
            None => format!("{objective}\n\n{asked}"),
        };
        let scene = exercise.scene(self.seed).is_ok_and(|scene| scene.is_some());
        let hint = match (scene, &brief.choices[..]) {
            (true, _) => "Enter shows the graph; an answer and why, Enter  Tab hint  Esc back",
            (false, []) => "a number and why, then Enter  Tab hint  Esc back",
            (false, _) => "an answer and why, then Enter  Tab hint  Esc back",
        };
        Page {
            typed: Some(typed.to_owned()),
            ..Page::text(format!("{} {}", brief.label(), brief.title), text, hint)
        }
    }

    fn list(&self) -> String {
        let next = exercises::next(&self.answers).map(index);
        let lines = questions().enumerate().map(|(index, exercise)| {
            let brief = exercise.brief();
            let mark = if index == self.at { "▶" } else { " " };
            let path = if brief.path { "●" } else { " " };
            let open = if Some(index) == next { "next" } else { "" };
            let predicted = self.answers.predicted(brief);
            let done = predicted.as_deref().unwrap_or(open);
            let (number, title) = (brief.label(), &brief.title);
            let line = format!("{mark} {number:<3} {path} {title:<36}  {done}");
            line.trim_end().to_owned()
        });
        lines.collect::<Vec<_>>().join("\n")
    }
}

impl CoursePanel for ExercisePanel {
    fn key(&mut self, key: &KeyEvent) -> PanelAction {
        match (key.code, &self.page) {
            (KeyCode::Esc, PanelPage::List) => return PanelAction::Leave,
            (KeyCode::Esc, _) => (self.page, self.scroll) = (PanelPage::List, 0),
            (KeyCode::Enter, _) => {
                self.scroll = 0;
                return self.enter();
            }
            (code, _) => self.go(code),
        }
        PanelAction::Stay
    }

    fn paste(&mut self, text: &str) {
        if let PanelPage::Question { typed, .. } = &mut self.page {
            typed.push_str(text);
        }
    }

    fn poll(&mut self) -> bool {
        let exercise = self.exercise();
        let PanelPage::Measuring {
            prediction,
            findings,
        } = &self.page
        else {
            return false;
        };
        let found = match findings.try_recv() {
            Err(TryRecvError::Empty) => return false,
            found => found.ok(),
        };
        let (page, seed) = (
            reveal(exercise, prediction, found.as_ref()),
            prediction.seed(),
        );
        if let Some(Ok(findings)) = found {
            // A failure is ignored: the prediction itself is in the file.
            let _ = self
                .answers
                .judge(&self.file, exercise.brief(), &findings, seed);
        }
        self.page = page;
        self.at = self.after(exercise);
        self.scroll = 0;
        true
    }

    fn page(&self) -> Page {
        let page = match &self.page {
            PanelPage::List => Page {
                // The marked line stays in view.
                scroll: self.at.saturating_sub(JUMP),
                ..Page::text(
                    "exercises",
                    self.list(),
                    "● path of an hour  ↑ ↓ choose  Enter open  Esc the graph",
                )
            },
            PanelPage::Question {
                typed,
                refused,
                hinted,
            } => {
                let hint = hinted.then(|| format!("Hint: {}", self.exercise().brief().hint));
                self.question(typed, refused.clone().or(hint))
            }
            PanelPage::Measuring { .. } => {
                let title = &*self.exercise().brief().title;
                Page::text(title, "measuring …".to_owned(), "Esc back")
            }
            PanelPage::Text { page, .. } => page.clone(),
        };
        Page {
            keys: HINTS,
            scroll: page.scroll + self.scroll,
            ..page
        }
    }

    fn has_found_limits(&self) -> bool {
        exercises::has_found_limits(&self.answers)
    }
}

/// Returns the number of the question that is `exercise`.
fn index(exercise: &Exercise) -> usize {
    let name = &exercise.brief().name;
    let index = questions().position(|other| other.brief().name == *name);
    index.unwrap_or_default()
}

fn text_page(title: impl Into<String>, text: String, by_hand: bool) -> PanelPage {
    let page = Page::text(title, text, "↑ ↓ read on  Enter go on  Esc back");
    PanelPage::Text { page, by_hand }
}

/// Measures on a thread of its own: the dashboard goes on.
fn measure(exercise: &'static Exercise, prediction: Prediction) -> PanelPage {
    let (seed, (sender, findings)) = (prediction.seed(), bounded(1));
    thread::spawn(move || {
        // The panel may be gone.
        let _ = sender.send(exercise.measure(seed));
    });
    PanelPage::Measuring {
        prediction,
        findings,
    }
}

fn reveal(
    exercise: &'static Exercise,
    prediction: &Prediction,
    found: Option<&Result<Findings, Failure>>,
) -> PanelPage {
    let brief = exercise.brief();
    let by_hand = brief.number == RESCUE;
    let hand = if by_hand {
        "\n\nEnter begins a recorded run at a fifth of the wall's speed: slow the policy \
             with b, bring it back with ], then press e."
    } else {
        ""
    };
    let text = match found {
        Some(Ok(findings)) => {
            // First, so that a small screen shows it.
            let outcome = findings.outcome(brief, prediction);
            let (table, meaning) = (findings.drawn(brief, prediction), &findings.meaning);
            format!("{outcome}\n\n{table}\n{meaning}{hand}")
        }
        Some(Err(failure)) => failure.to_string(),
        None => "the measurement panicked, which is a defect: please report it".to_owned(),
    };
    text_page(format!("{} {}", brief.label(), brief.title), text, by_hand)
}

#[cfg(test)]
mod tests;
