//! The guided tour: steps over a running session. A step names its keys, waits for them,
//! and then says what to look at.

mod steps;

use crossterm::event::{KeyCode, KeyEvent};

use super::view::TextPage;
use steps::{STEPS, Step};

/// The offer at the first start.
pub const OFFER: &str = "new here? g: a tour of five minutes";

/// The start of the lab.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Guide {
    /// The lab alone.
    Nobody,
    /// The lab, with an offer of the tour.
    Offer,
    /// The tour from its beginning.
    Tour,
}

/// A position in the tour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tour {
    step: usize,
    /// How many keys of the step were pressed.
    pressed: usize,
}

/// The use of a key for the tour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Walk {
    /// The key belongs to the lab; this is the position after it.
    Lab(Tour),
    /// The key led to this position.
    On(Tour),
    /// The tour is over.
    Over,
}

impl Tour {
    /// Takes a key. Enter goes on once the keys of the step were pressed, Esc ends the
    /// tour; all others go to the lab.
    pub fn take(self, key: &KeyEvent) -> Walk {
        match key.code {
            KeyCode::Esc => Walk::Over,
            KeyCode::Enter => match self.awaited() {
                Some(_) => Walk::On(self),
                None => self.next(),
            },
            KeyCode::Char(typed) if self.awaited() == Some(typed) => Walk::Lab(Self {
                pressed: self.pressed + 1,
                ..self
            }),
            _ => Walk::Lab(self),
        }
    }

    fn next(self) -> Walk {
        let step = self.step + 1;
        match step < STEPS.len() {
            true => Walk::On(Self { step, pressed: 0 }),
            false => Walk::Over,
        }
    }

    fn shown(self) -> &'static Step {
        &STEPS[self.step.min(STEPS.len() - 1)]
    }

    /// The key that the step waits for; `None` after its last.
    fn awaited(self) -> Option<char> {
        self.shown().keys.chars().nth(self.pressed)
    }

    /// The step on the screen.
    pub fn page(self) -> TextPage {
        let step = self.shown();
        let left: Vec<String> = step
            .keys
            .chars()
            .skip(self.pressed)
            .map(String::from)
            .collect();
        let (text, hint) = match left.is_empty() {
            true => (step.look.to_owned(), "Enter goes on  Esc leaves"),
            false => (
                format!("{}\nKeys: {}", step.ask, left.join(" ")),
                "waits for the key  Esc leaves",
            ),
        };
        TextPage {
            title: format!("tour {} of {}: {}", self.step + 1, STEPS.len(), step.title),
            text,
            typed: None,
            hint,
            scroll: 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use crossterm::event::KeyModifiers;

    use super::*;
    use crate::dashboard::view::testing::{RICH, screen, text};

    fn key(code: KeyCode) -> KeyEvent {
        KeyEvent::new(code, KeyModifiers::NONE)
    }

    #[test]
    fn every_step_waits_for_its_keys_and_then_for_enter() {
        let mut tour = Tour::default();
        for (number, step) in STEPS.iter().enumerate() {
            for typed in step.keys.chars() {
                assert_eq!(tour.take(&key(KeyCode::Enter)), Walk::On(tour));
                assert_eq!(tour.take(&key(KeyCode::Char('q'))), Walk::Lab(tour));
                let Walk::Lab(after) = tour.take(&key(KeyCode::Char(typed))) else {
                    panic!("{typed} must reach the lab in step {number}");
                };
                assert_ne!(after, tour);
                tour = after;
            }
            assert_eq!(tour.awaited(), None);
            match tour.take(&key(KeyCode::Enter)) {
                Walk::On(next) => tour = next,
                end => assert_eq!((end, number), (Walk::Over, STEPS.len() - 1)),
            }
        }
        assert_eq!(Tour::default().take(&key(KeyCode::Esc)), Walk::Over);
    }

    /// The place for a step on a screen of 80x24.
    const PLACE: (u16, u16) = (50, 10);

    #[test]
    fn every_text_fits_on_a_screen_of_80_by_24() {
        for (number, step) in STEPS.iter().enumerate() {
            for pressed in [0, step.keys.len()] {
                let page = Tour {
                    step: number,
                    pressed,
                }
                .page();
                let drawn = screen(PLACE.0, PLACE.1, |area, buf| {
                    crate::dashboard::view::aside(&page, &RICH, area, buf);
                });
                let last = page.text.split_whitespace().next_back().expect("a word");
                let drawn = text(&drawn);
                assert!(drawn.contains(last), "{last:?} is cut off:\n{drawn}");
                assert!(drawn.contains("Esc leaves"), "{drawn}");
            }
        }
    }
}
