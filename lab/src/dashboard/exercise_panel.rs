//! The exercises over the dashboard: choose one, predict, measure.

use std::path::{Path, PathBuf};

use crossterm::event::{KeyCode, KeyEvent};
use exercises::{
    framework::{Answers, Exercise, Failure, Findings, Prediction},
    parts, questions,
};
use ratelab_study::experiment::Config;

use super::{
    asked::Asked,
    panes::{JUMP, scrolled},
    view::Page,
};
use crate::{
    predictions::{answers_file, predicted},
    rescue::{RESCUE, judge_file},
};

/// The keys of the panel, for the bottom line.
const HINTS: &[(&str, &str)] = &[
    ("Enter", "go on"),
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
    page: PanelPage,
    /// Lines of the text above the first shown.
    scroll: usize,
}

enum PanelPage {
    /// The list, with this one marked.
    List(usize),
    /// The question, with the prediction typed so far.
    Question {
        exercise: &'static dyn Exercise,
        typed: String,
        refused: Option<String>,
    },
    /// Waiting for the measurement.
    Measuring {
        exercise: &'static dyn Exercise,
        prediction: Prediction,
        findings: Asked<(), Result<Findings, Failure>>,
    },
    /// The result.
    Text {
        title: String,
        text: String,
        by_hand: bool,
        /// The exercise to mark in the list after it.
        next: usize,
    },
}

/// The request of a key to the dashboard.
#[derive(Clone, Debug, PartialEq)]
pub enum PanelAction {
    /// Keep the panel open.
    Stay,
    /// The same; the question that covers the cause is answered.
    Answered,
    /// Show the graph again.
    Leave,
    /// Begin a rescue by hand.
    ByHand,
    /// Show this run, for the prediction.
    Watch(Box<Config>),
}

impl ExercisePanel {
    /// Opens the list of exercises, for the learner's number `seed`.
    pub fn new(seed: u64) -> Self {
        Self::with_answers(answers_file(None), seed)
    }

    /// The same, for the predictions in `file`.
    fn with_answers(file: PathBuf, seed: u64) -> Self {
        let (answers, page) = match Answers::load(&file) {
            Ok(answers) => {
                let open = first_open(&answers, 0);
                (answers, PanelPage::List(open))
            }
            Err(error) => (
                Answers::default(),
                text_page("exercises", error.to_string(), 0),
            ),
        };
        Self {
            file,
            answers,
            seed,
            page,
            scroll: 0,
        }
    }

    /// Opens the verdict on the rescue recorded in `file`.
    pub fn judging(file: &Path, seed: u64) -> Self {
        let text = match judge_file(file) {
            Ok((true, text)) => format!("✓ {text}"),
            Ok((false, text)) => format!("✖ {text}"),
            Err(error) => error.to_string(),
        };
        Self {
            page: PanelPage::Text {
                title: "5 Rescue it".to_owned(),
                text: format!("{text}\n\nEnter begins another try."),
                by_hand: true,
                next: 0,
            },
            ..Self::new(seed)
        }
    }

    /// Shows a measurement that is complete; returns whether there was one.
    pub fn poll(&mut self) -> bool {
        let PanelPage::Measuring {
            exercise,
            prediction,
            findings,
        } = &mut self.page
        else {
            return false;
        };
        let found = findings.answer(false);
        if findings.is_coming() {
            return false;
        }
        let next = first_open(&self.answers, index(*exercise));
        self.page = reveal(*exercise, prediction, found, next);
        self.scroll = 0;
        true
    }

    /// Handles a key.
    pub fn key(&mut self, key: &KeyEvent) -> PanelAction {
        match key.code {
            KeyCode::Esc => return self.back(),
            KeyCode::Enter => return self.enter(),
            code => self.go(code),
        }
        PanelAction::Stay
    }

    fn back(&mut self) -> PanelAction {
        self.scroll = 0;
        let marked = match &self.page {
            PanelPage::List(_) => return PanelAction::Leave,
            PanelPage::Question { exercise, .. } | PanelPage::Measuring { exercise, .. } => {
                index(*exercise)
            }
            PanelPage::Text { next, .. } => *next,
        };
        self.page = PanelPage::List(marked);
        PanelAction::Stay
    }

    /// Moves the mark of the list, or the text, or edits what is typed.
    fn go(&mut self, key: KeyCode) {
        let (row, last) = match &mut self.page {
            PanelPage::List(marked) => (marked, questions().count() - 1),
            _ => (&mut self.scroll, usize::MAX),
        };
        match scrolled(*row, key) {
            Some(to) => *row = to.min(last),
            None => self.edit(key),
        }
    }

    fn enter(&mut self) -> PanelAction {
        self.scroll = 0;
        match &mut self.page {
            PanelPage::List(marked) => {
                if let Some(exercise) = questions().nth(*marked) {
                    self.open(exercise);
                }
            }
            PanelPage::Question {
                exercise, typed, ..
            } if typed.trim().is_empty()
                && let Ok(Some(scene)) = exercise.scene(self.seed) =>
            {
                return PanelAction::Watch(Box::new(scene));
            }
            PanelPage::Question {
                exercise,
                typed,
                refused,
            } => match Prediction::read(typed, exercise.brief()) {
                Ok(prediction) => {
                    let exercise = *exercise;
                    return self.predict(exercise, prediction);
                }
                Err(error) => *refused = Some(error.to_string()),
            },
            PanelPage::Text { by_hand: true, .. } => return PanelAction::ByHand,
            PanelPage::Text { next, .. } => self.page = PanelPage::List(*next),
            PanelPage::Measuring { .. } => {}
        }
        PanelAction::Stay
    }

    /// Shows the result of an answered question, or asks it.
    fn open(&mut self, exercise: &'static dyn Exercise) {
        let brief = exercise.brief();
        let known = |of: &dyn Exercise| self.answers.get(of.brief());
        let mut parts = exercises::find(brief.number).into_iter().flat_map(parts);
        let first = parts.find(|part| known(*part).is_none());
        let earlier = first.filter(|first| first.brief().part < brief.part);
        self.page = match (known(exercise), earlier) {
            (Some(known), _) => measure(exercise, known.clone()),
            (None, Some(earlier)) => {
                let label = earlier.brief().label();
                text_page(
                    brief.title,
                    format!(
                        "Begin with {label}: the figures of one question are there for the next."
                    ),
                    index(earlier),
                )
            }
            (None, None) => PanelPage::Question {
                exercise,
                typed: String::new(),
                refused: None,
            },
        };
    }

    fn predict(&mut self, exercise: &'static dyn Exercise, prediction: Prediction) -> PanelAction {
        let prediction = match self.seed {
            seed if seed > 0 && exercise.draws() => prediction.about(seed),
            _ => prediction,
        };
        // The file may have changed, or must not be overwritten.
        let saved = Answers::load(&self.file).and_then(|mut answers| {
            answers.set(exercise.brief(), prediction.clone());
            answers.save(&self.file).map(|()| answers)
        });
        match saved {
            Ok(answers) => {
                self.answers = answers;
                self.page = measure(exercise, prediction);
                match exercise.scene(self.seed) {
                    Ok(Some(_)) => PanelAction::Answered,
                    _ => PanelAction::Stay,
                }
            }
            Err(error) => {
                let marked = index(exercise);
                self.page = text_page(exercise.brief().title, error.to_string(), marked);
                PanelAction::Stay
            }
        }
    }

    /// Takes pasted text where something is typed.
    pub fn paste(&mut self, text: &str) {
        if let PanelPage::Question { typed, .. } = &mut self.page {
            typed.push_str(text);
        }
    }

    fn edit(&mut self, code: KeyCode) {
        match (&mut self.page, code) {
            (PanelPage::List(marked), KeyCode::Char(digit)) => {
                let number = digit.to_digit(10);
                let mut numbers = questions().map(|exercise| exercise.brief().number);
                let index = numbers.position(|of| Some(of) == number);
                *marked = index.unwrap_or(*marked);
            }
            (PanelPage::Question { typed, .. }, KeyCode::Char(letter)) => typed.push(letter),
            (PanelPage::Question { typed, .. }, KeyCode::Backspace) => drop(typed.pop()),
            _ => {}
        }
    }

    /// The page on the screen.
    pub fn page(&self) -> Page {
        let page = match &self.page {
            PanelPage::List(marked) => {
                let keys = "↑ ↓ choose  Enter open  Esc back to the graph";
                let list = Page::text("exercises", self.list(*marked), keys);
                // The marked line stays in view.
                let scroll = marked.saturating_sub(JUMP);
                Page { scroll, ..list }
            }
            PanelPage::Question {
                exercise,
                typed,
                refused,
            } => self.question(*exercise, typed, refused.as_deref()),
            PanelPage::Measuring { exercise, .. } => {
                let title = exercise.brief().title;
                Page::text(title, "measuring …".to_owned(), "Esc back")
            }
            PanelPage::Text { title, text, .. } => {
                Page::text(&**title, text.clone(), "↑ ↓ read on  Enter go on  Esc back")
            }
        };
        Page {
            keys: HINTS,
            scroll: page.scroll + self.scroll,
            ..page
        }
    }

    fn question(&self, exercise: &dyn Exercise, typed: &str, refused: Option<&str>) -> Page {
        let brief = exercise.brief();
        let (asked, objective) = (brief.asked(), brief.objective);
        // After an answer that is none, the error and the question come first, so that a
        // small screen shows them.
        let text = match refused {
            Some(why) => format!("{why}\n\n{asked}\n\n{objective}"),
            None => format!("{objective}\n\n{asked}"),
        };
        let scene = exercise.scene(self.seed).is_ok_and(|scene| scene.is_some());
        let hint = match (scene, brief.choices) {
            (true, _) => "Enter shows the graph; an answer and why, Enter  Esc back",
            (false, []) => "a number and why, then Enter  Esc back",
            (false, _) => "an answer and why, then Enter  Esc back",
        };
        Page {
            typed: Some(typed.to_owned()),
            ..Page::text(format!("{} {}", brief.label(), brief.title), text, hint)
        }
    }

    fn list(&self, marked: usize) -> String {
        let lines = questions().enumerate().map(|(index, exercise)| {
            let brief = exercise.brief();
            let mark = if index == marked { "▶" } else { " " };
            let done = predicted(&self.answers, brief).unwrap_or_default();
            let (number, title) = (brief.label(), brief.title);
            let line = format!("{mark} {number} {title} ({})  {done}", brief.kind);
            line.trim_end().to_owned()
        });
        lines.collect::<Vec<_>>().join("\n")
    }
}

fn index(exercise: &dyn Exercise) -> usize {
    let name = exercise.brief().name;
    let index = questions().position(|other| other.brief().name == name);
    index.unwrap_or_default()
}

/// The first question without an answer, from number `from` on; that number if all have one.
fn first_open(answers: &Answers, from: usize) -> usize {
    let mut rest = questions().skip(from);
    let open = rest.position(|exercise| answers.get(exercise.brief()).is_none());
    from + open.unwrap_or_default()
}

fn text_page(title: &str, text: String, next: usize) -> PanelPage {
    PanelPage::Text {
        title: title.to_owned(),
        text,
        by_hand: false,
        next,
    }
}

/// Measures on a thread of its own: the dashboard goes on.
fn measure(exercise: &'static dyn Exercise, prediction: Prediction) -> PanelPage {
    let (seed, mut findings) = (prediction.seed(), Asked::default());
    findings.ask((), move || exercise.measure(seed));
    PanelPage::Measuring {
        exercise,
        prediction,
        findings,
    }
}

fn reveal(
    exercise: &'static dyn Exercise,
    prediction: &Prediction,
    found: Option<Result<Findings, Failure>>,
    next: usize,
) -> PanelPage {
    let brief = exercise.brief();
    let by_hand = brief.number == RESCUE;
    let hand = "\n\nEnter begins a recorded run at a fifth of the wall's speed: slow the policy \
                with b, bring it back with ], then press e.";
    let text = match found {
        Some(Ok(findings)) => {
            let hand = if by_hand { hand } else { "" };
            // First, so that a small screen shows it.
            let outcome = findings.outcome(brief, prediction);
            format!(
                "{outcome}\n\n{}\n{}{hand}",
                findings.table, findings.meaning
            )
        }
        Some(Err(failure)) => failure.to_string(),
        None => "the measurement panicked, which is a defect: please report it".to_owned(),
    };
    PanelPage::Text {
        title: format!("{} {}", brief.label(), brief.title),
        text,
        by_hand,
        next,
    }
}

#[cfg(test)]
mod tests {
    use crossterm::event::KeyModifiers;

    use super::*;

    fn press(panel: &mut ExercisePanel, code: KeyCode) -> PanelAction {
        panel.key(&KeyEvent::new(code, KeyModifiers::NONE))
    }

    fn answer(panel: &mut ExercisePanel, text: &str) -> PanelAction {
        panel.paste(text);
        press(panel, KeyCode::Enter)
    }

    /// The marked line of the list.
    fn marked(panel: &ExercisePanel) -> String {
        let text = panel.page().text;
        let mut lines = text.lines();
        let line = lines.find_map(|line| line.strip_prefix("▶ "));
        line.expect("a mark").to_owned()
    }

    fn until_measured(panel: &mut ExercisePanel) {
        while !panel.poll() {
            std::thread::yield_now();
        }
    }

    #[test]
    fn the_list_begins_at_the_first_open_question_and_goes_on_to_the_next() {
        let folder = tempfile::tempdir().expect("folder");
        let panel = || ExercisePanel::with_answers(folder.path().join("answers.toml"), 0);
        let mut first = panel();
        assert!(marked(&first).starts_with("1 "));
        press(&mut first, KeyCode::Enter);
        let reply = answer(&mut first, "30 because fewer decisions come too late");
        assert_eq!(reply, PanelAction::Stay);
        until_measured(&mut first);
        let text = first.page().text;
        assert!(text.starts_with("You predicted 30 Hz"), "{text}");
        press(&mut first, KeyCode::Enter);
        assert!(marked(&first).starts_with("2 "));
        assert!(marked(&panel()).starts_with("2 "));
    }

    #[test]
    fn the_question_stays_at_the_top_after_an_answer_that_is_none() {
        let folder = tempfile::tempdir().expect("folder");
        let file = folder.path().join("answers.toml");
        let mut panel = ExercisePanel::with_answers(file, 0);
        let first = exercises::ALL.into_iter();
        for exercise in first.filter(|exercise| !exercise.draws()) {
            panel.open(exercise);
            press(&mut panel, KeyCode::Enter);
            let text = panel.page().text;
            let mut paragraphs = text.split("\n\n");
            let error = paragraphs.next().expect("an error");
            assert!(error.starts_with("no prediction yet"), "{text}");
            assert_eq!(paragraphs.next(), Some(&*exercise.brief().asked()));
        }
    }

    #[test]
    fn page_keys_move_through_the_list() {
        let folder = tempfile::tempdir().expect("folder");
        let file = folder.path().join("answers.toml");
        let mut panel = ExercisePanel::with_answers(file, 0);
        press(&mut panel, KeyCode::PageDown);
        assert!(marked(&panel).starts_with("7b "));
        press(&mut panel, KeyCode::PageDown);
        assert!(marked(&panel).starts_with("12 "));
        press(&mut panel, KeyCode::PageUp);
        press(&mut panel, KeyCode::PageUp);
        assert!(marked(&panel).starts_with("1 "));
    }

    #[test]
    fn an_answer_uncovers_the_cause_of_the_run_that_was_shown_for_it() {
        let folder = tempfile::tempdir().expect("folder");
        let file = folder.path().join("answers.toml");
        let mut panel = ExercisePanel::with_answers(file, 0);
        panel.page = PanelPage::List(index(exercises::find(10).expect("an exercise")));
        press(&mut panel, KeyCode::Enter);
        let shown = press(&mut panel, KeyCode::Enter);
        assert!(matches!(shown, PanelAction::Watch(_)), "{shown:?}");
        assert_eq!(answer(&mut panel, "sensor"), PanelAction::Stay);
        panel.key(&KeyEvent::new(KeyCode::Esc, KeyModifiers::NONE));
        press(&mut panel, KeyCode::Enter);
        let reply = answer(&mut panel, "sensor slow because it looks so");
        assert_eq!(reply, PanelAction::Answered);
    }
}
