//! The exercises over the dashboard: choose one, predict, see what is measured.

use std::{path::PathBuf, thread::JoinHandle};

use crossterm::event::{KeyCode, KeyEvent};
use exercises::{
    ALL,
    framework::{Answers, Exercise, Failure, Findings, Prediction},
};

use super::view::TextPage;
use crate::{
    predictions::{answers_file, predicted},
    rescue::{RESCUE, judge_file},
};

/// The keys of the panel, for the bottom line.
pub const HINTS: &[(&str, &str)] = &[
    ("Enter", "go on"),
    ("↑ ↓ PgUp PgDn", "move"),
    ("Esc", "back"),
    ("Ctrl-C", "quit"),
];

/// Lines that PgUp and PgDn move by.
const JUMP: usize = 10;

/// The panel of the exercises.
pub struct ExercisePanel {
    file: PathBuf,
    answers: Answers,
    page: PanelPage,
    /// Lines of the text that are above the first shown.
    scroll: usize,
}

enum PanelPage {
    /// Before the list, with this one marked.
    List(usize),
    /// Asked for a prediction, of which so much is typed.
    Question {
        exercise: &'static dyn Exercise,
        typed: String,
        refused: Option<String>,
    },
    /// Waiting for the measurement.
    Measuring {
        exercise: &'static dyn Exercise,
        prediction: Prediction,
        thread: JoinHandle<Result<Findings, Failure>>,
    },
    /// Before the result.
    Text {
        title: String,
        text: String,
        by_hand: bool,
    },
}

/// What a learner wants of the dashboard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PanelAction {
    /// To go on here.
    Stay,
    /// To see the graph again.
    Leave,
    /// To do by hand what was rehearsed.
    ByHand,
}

impl ExercisePanel {
    /// Before the list of exercises.
    pub fn new() -> Self {
        let file = answers_file(None);
        let (answers, page) = match Answers::load(&file) {
            Ok(answers) => (answers, PanelPage::List(0)),
            Err(error) => (
                Answers::default(),
                text_page("exercises", error.to_string()),
            ),
        };
        Self {
            file,
            answers,
            page,
            scroll: 0,
        }
    }

    /// Before what became of the rescue that is recorded in `file`.
    pub fn judging(file: &std::path::Path) -> Self {
        let text = match judge_file(file) {
            Ok((true, text)) => format!("✓ {text}"),
            Ok((false, text)) => format!("✖ not a rescue yet: {text}"),
            Err(error) => error.to_string(),
        };
        Self {
            page: PanelPage::Text {
                title: "5 Rescue it".to_owned(),
                text: format!("{text}\n\nEnter begins another try."),
                by_hand: true,
            },
            ..Self::new()
        }
    }

    /// Sees whether the measurement has come; says whether it has.
    pub fn poll(&mut self) -> bool {
        let done =
            matches!(&self.page, PanelPage::Measuring { thread, .. } if thread.is_finished());
        if !done {
            return false;
        }
        let page = std::mem::replace(&mut self.page, PanelPage::List(0));
        if let PanelPage::Measuring {
            exercise,
            prediction,
            thread,
        } = page
        {
            self.scroll = 0;
            self.page = reveal(exercise, &prediction, thread);
        }
        true
    }

    /// Does what a key asks for.
    pub fn key(&mut self, key: &KeyEvent) -> PanelAction {
        match key.code {
            KeyCode::PageDown => self.scroll = self.scroll.saturating_add(JUMP),
            KeyCode::PageUp => self.scroll = self.scroll.saturating_sub(JUMP),
            KeyCode::Esc => return self.back(),
            KeyCode::Enter => return self.enter(),
            code => self.edit(code),
        }
        PanelAction::Stay
    }

    fn back(&mut self) -> PanelAction {
        self.scroll = 0;
        match std::mem::replace(&mut self.page, PanelPage::List(0)) {
            PanelPage::List(_) => PanelAction::Leave,
            PanelPage::Question { exercise, .. } | PanelPage::Measuring { exercise, .. } => {
                self.page = PanelPage::List(index(exercise));
                PanelAction::Stay
            }
            PanelPage::Text { .. } => PanelAction::Stay,
        }
    }

    fn enter(&mut self) -> PanelAction {
        self.scroll = 0;
        match &mut self.page {
            PanelPage::List(marked) => {
                let exercise = ALL[*marked];
                self.page = match self.answers.get(exercise.brief()) {
                    Some(known) => measure(exercise, known.clone()),
                    None => PanelPage::Question {
                        exercise,
                        typed: String::new(),
                        refused: None,
                    },
                };
            }
            PanelPage::Question {
                exercise,
                typed,
                refused,
            } => match Prediction::read(typed, exercise.brief()) {
                Ok(prediction) => {
                    let exercise = *exercise;
                    self.predict(exercise, prediction);
                }
                Err(error) => *refused = Some(error.to_string()),
            },
            PanelPage::Text { by_hand: true, .. } => return PanelAction::ByHand,
            PanelPage::Text { .. } => self.page = PanelPage::List(0),
            PanelPage::Measuring { .. } => {}
        }
        PanelAction::Stay
    }

    fn predict(&mut self, exercise: &'static dyn Exercise, prediction: Prediction) {
        // The file may have changed since, or be one that must not be overwritten.
        let saved = Answers::load(&self.file).and_then(|mut answers| {
            answers.set(exercise.brief(), prediction.clone());
            answers.save(&self.file).map(|()| answers)
        });
        self.page = match saved {
            Ok(answers) => {
                self.answers = answers;
                measure(exercise, prediction)
            }
            Err(error) => text_page(exercise.brief().title, error.to_string()),
        };
    }

    /// Takes pasted text where something is typed.
    pub fn paste(&mut self, text: &str) {
        if let PanelPage::Question { typed, .. } = &mut self.page {
            typed.push_str(text);
        }
    }

    fn edit(&mut self, code: KeyCode) {
        match (&mut self.page, code) {
            (PanelPage::List(marked), KeyCode::Down) => *marked = (*marked + 1).min(ALL.len() - 1),
            (PanelPage::List(marked), KeyCode::Up) => *marked = marked.saturating_sub(1),
            (PanelPage::List(marked), KeyCode::Char(digit)) => {
                let number = digit.to_digit(10).map(|digit| digit as usize);
                let index = number.and_then(|number| number.checked_sub(1));
                *marked = index.filter(|index| *index < ALL.len()).unwrap_or(*marked);
            }
            (PanelPage::Question { typed, .. }, KeyCode::Char(letter)) => typed.push(letter),
            (PanelPage::Question { typed, .. }, KeyCode::Backspace) => drop(typed.pop()),
            (_, KeyCode::Down) => self.scroll = self.scroll.saturating_add(1),
            (_, KeyCode::Up) => self.scroll = self.scroll.saturating_sub(1),
            _ => {}
        }
    }

    /// What is on the screen.
    pub fn page(&self) -> TextPage {
        let scroll = self.scroll;
        match &self.page {
            PanelPage::List(marked) => TextPage {
                title: "exercises".to_owned(),
                text: self.list(*marked),
                typed: None,
                hint: "↑ ↓ choose  Enter open  Esc back to the graph",
                scroll,
            },
            PanelPage::Question {
                exercise,
                typed,
                refused,
            } => {
                let brief = exercise.brief();
                let refused = refused
                    .as_ref()
                    .map_or(String::new(), |why| format!("\n\n{why}"));
                TextPage {
                    title: format!("{} {}", brief.number, brief.title),
                    text: format!("{}\n\n{}{refused}", brief.objective, brief.question),
                    typed: Some(typed.clone()),
                    hint: "a number and why, then Enter  Esc back",
                    scroll,
                }
            }
            PanelPage::Measuring { exercise, .. } => TextPage {
                title: exercise.brief().title.to_owned(),
                text: "measuring …".to_owned(),
                typed: None,
                hint: "Esc back",
                scroll,
            },
            PanelPage::Text { title, text, .. } => TextPage {
                title: title.clone(),
                text: text.clone(),
                typed: None,
                hint: "↑ ↓ read on  Enter go on  Esc back",
                scroll,
            },
        }
    }

    fn list(&self, marked: usize) -> String {
        let lines = ALL.iter().enumerate().map(|(index, exercise)| {
            let brief = exercise.brief();
            let mark = if index == marked { "▶" } else { " " };
            let done = predicted(&self.answers, brief).unwrap_or_default();
            let (number, title) = (brief.number, brief.title);
            let line = format!("{mark} {number} {title} ({})  {done}", brief.kind);
            line.trim_end().to_owned()
        });
        lines.collect::<Vec<_>>().join("\n")
    }
}

fn index(exercise: &dyn Exercise) -> usize {
    let number = exercise.brief().number as usize;
    number.saturating_sub(1)
}

fn text_page(title: &str, text: String) -> PanelPage {
    PanelPage::Text {
        title: title.to_owned(),
        text,
        by_hand: false,
    }
}

/// Measures on a thread of its own: the dashboard goes on.
fn measure(exercise: &'static dyn Exercise, prediction: Prediction) -> PanelPage {
    PanelPage::Measuring {
        exercise,
        prediction,
        thread: std::thread::spawn(move || exercise.run()),
    }
}

fn reveal(
    exercise: &'static dyn Exercise,
    prediction: &Prediction,
    thread: JoinHandle<Result<Findings, Failure>>,
) -> PanelPage {
    let brief = exercise.brief();
    let by_hand = brief.number == RESCUE;
    let hand = "\n\nEnter begins a recorded run at a fifth of the wall's speed: slow the policy \
                with b, bring it back with ], then press e.";
    let text = match thread.join() {
        Ok(Ok(findings)) => {
            let comparison = findings.reconcile(brief, prediction);
            let hand = if by_hand { hand } else { "" };
            format!("{}\n{comparison}{hand}", findings.table)
        }
        Ok(Err(failure)) => failure.to_string(),
        Err(_) => "the measurement panicked, which is a defect: please report it".to_owned(),
    };
    PanelPage::Text {
        title: format!("{} {}", brief.number, brief.title),
        text,
        by_hand,
    }
}
