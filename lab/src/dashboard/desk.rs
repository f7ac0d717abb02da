//! The exercises over the dashboard: choose one, predict, see what is measured.

use std::{path::PathBuf, thread::JoinHandle};

use crossterm::event::{KeyCode, KeyEvent};
use exercises::{
    ALL,
    practice::{Answers, Exercise, Failure, Findings, Prediction},
};

use super::view::Page;
use crate::exercise::{RESCUE, answers_file, judge_file, predicted};

/// Lines that PgUp and PgDn move by.
const JUMP: usize = 10;

/// Where a learner is.
pub struct Desk {
    file: PathBuf,
    answers: Answers,
    place: Place,
    /// Lines of the text that are above the first shown.
    scroll: usize,
}

enum Place {
    /// Before the list, with this one marked.
    List(usize),
    /// Asked for a prediction, of which so much is typed.
    Asked {
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
    Told {
        title: String,
        text: String,
        by_hand: bool,
    },
}

/// What a learner wants of the dashboard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wish {
    /// To go on here.
    Stay,
    /// To see the graph again.
    Leave,
    /// To do by hand what was rehearsed.
    ByHand,
}

impl Desk {
    /// Before the list of exercises.
    pub fn new() -> Self {
        let file = answers_file(None);
        let (answers, place) = match Answers::load(&file) {
            Ok(answers) => (answers, Place::List(0)),
            Err(error) => (Answers::default(), told("exercises", error.to_string())),
        };
        Self {
            file,
            answers,
            place,
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
            place: Place::Told {
                title: "5 Rescue it".to_owned(),
                text: format!("{text}\n\nEnter begins another try."),
                by_hand: true,
            },
            ..Self::new()
        }
    }

    /// Sees whether the measurement has come; says whether it has.
    pub fn poll(&mut self) -> bool {
        let done = matches!(&self.place, Place::Measuring { thread, .. } if thread.is_finished());
        if !done {
            return false;
        }
        let place = std::mem::replace(&mut self.place, Place::List(0));
        if let Place::Measuring {
            exercise,
            prediction,
            thread,
        } = place
        {
            self.scroll = 0;
            self.place = reveal(exercise, &prediction, thread);
        }
        true
    }

    /// Does what a key asks for.
    pub fn key(&mut self, key: &KeyEvent) -> Wish {
        match key.code {
            KeyCode::PageDown => self.scroll = self.scroll.saturating_add(JUMP),
            KeyCode::PageUp => self.scroll = self.scroll.saturating_sub(JUMP),
            KeyCode::Esc => return self.back(),
            KeyCode::Enter => return self.enter(),
            code => self.edit(code),
        }
        Wish::Stay
    }

    fn back(&mut self) -> Wish {
        self.scroll = 0;
        match std::mem::replace(&mut self.place, Place::List(0)) {
            Place::List(_) => Wish::Leave,
            Place::Asked { exercise, .. } | Place::Measuring { exercise, .. } => {
                self.place = Place::List(index(exercise));
                Wish::Stay
            }
            Place::Told { .. } => Wish::Stay,
        }
    }

    fn enter(&mut self) -> Wish {
        self.scroll = 0;
        match &mut self.place {
            Place::List(marked) => {
                let exercise = ALL[*marked];
                self.place = match self.answers.get(exercise.brief()) {
                    Some(known) => measure(exercise, known.clone()),
                    None => Place::Asked {
                        exercise,
                        typed: String::new(),
                        refused: None,
                    },
                };
            }
            Place::Asked {
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
            Place::Told { by_hand: true, .. } => return Wish::ByHand,
            Place::Told { .. } => self.place = Place::List(0),
            Place::Measuring { .. } => {}
        }
        Wish::Stay
    }

    fn predict(&mut self, exercise: &'static dyn Exercise, prediction: Prediction) {
        // The file may have changed since, or be one that must not be overwritten.
        let saved = Answers::load(&self.file).and_then(|mut answers| {
            answers.set(exercise.brief(), prediction.clone());
            answers.save(&self.file).map(|()| answers)
        });
        self.place = match saved {
            Ok(answers) => {
                self.answers = answers;
                measure(exercise, prediction)
            }
            Err(error) => told(exercise.brief().title, error.to_string()),
        };
    }

    /// Takes pasted text where something is typed.
    pub fn paste(&mut self, text: &str) {
        if let Place::Asked { typed, .. } = &mut self.place {
            typed.push_str(text);
        }
    }

    fn edit(&mut self, code: KeyCode) {
        match (&mut self.place, code) {
            (Place::List(marked), KeyCode::Down) => *marked = (*marked + 1).min(ALL.len() - 1),
            (Place::List(marked), KeyCode::Up) => *marked = marked.saturating_sub(1),
            (Place::List(marked), KeyCode::Char(digit)) => {
                let number = digit.to_digit(10).map(|digit| digit as usize);
                let index = number.and_then(|number| number.checked_sub(1));
                *marked = index.filter(|index| *index < ALL.len()).unwrap_or(*marked);
            }
            (Place::Asked { typed, .. }, KeyCode::Char(letter)) => typed.push(letter),
            (Place::Asked { typed, .. }, KeyCode::Backspace) => drop(typed.pop()),
            (_, KeyCode::Down) => self.scroll = self.scroll.saturating_add(1),
            (_, KeyCode::Up) => self.scroll = self.scroll.saturating_sub(1),
            _ => {}
        }
    }

    /// What is on the screen.
    pub fn page(&self) -> Page {
        let scroll = self.scroll;
        match &self.place {
            Place::List(marked) => Page {
                title: "exercises".to_owned(),
                text: self.list(*marked),
                typed: None,
                hint: "↑ ↓ choose  Enter open  Esc back to the graph",
                scroll,
            },
            Place::Asked {
                exercise,
                typed,
                refused,
            } => {
                let brief = exercise.brief();
                let refused = refused
                    .as_ref()
                    .map_or(String::new(), |why| format!("\n\n{why}"));
                Page {
                    title: format!("{} {}", brief.number, brief.title),
                    text: format!("{}\n\n{}{refused}", brief.objective, brief.question),
                    typed: Some(typed.clone()),
                    hint: "a number and why, then Enter  Esc back",
                    scroll,
                }
            }
            Place::Measuring { exercise, .. } => Page {
                title: exercise.brief().title.to_owned(),
                text: "measuring …".to_owned(),
                typed: None,
                hint: "Esc back",
                scroll,
            },
            Place::Told { title, text, .. } => Page {
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

fn told(title: &str, text: String) -> Place {
    Place::Told {
        title: title.to_owned(),
        text,
        by_hand: false,
    }
}

/// Measures on a thread of its own: the dashboard goes on.
fn measure(exercise: &'static dyn Exercise, prediction: Prediction) -> Place {
    Place::Measuring {
        exercise,
        prediction,
        thread: std::thread::spawn(move || exercise.run()),
    }
}

fn reveal(
    exercise: &'static dyn Exercise,
    prediction: &Prediction,
    thread: JoinHandle<Result<Findings, Failure>>,
) -> Place {
    let brief = exercise.brief();
    let by_hand = brief.number == RESCUE;
    let hand = "\n\nEnter begins a recorded run at a fifth of the wall's speed: slow the policy \
                with b, bring it back with ], then press e.";
    let text = match thread.join() {
        Ok(Ok(findings)) => {
            let told = findings.reconcile(brief, prediction);
            let hand = if by_hand { hand } else { "" };
            format!("{}\n{told}{hand}", findings.table)
        }
        Ok(Err(failure)) => failure.to_string(),
        Err(_) => "the measurement panicked, which is a defect: please report it".to_owned(),
    };
    Place::Told {
        title: format!("{} {}", brief.number, brief.title),
        text,
        by_hand,
    }
}
