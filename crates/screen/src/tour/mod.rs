//! The guided tour: steps over a running session. A step waits for a state of the run,
//! however it comes about, and then says what to look at.

mod steps;

use crossterm::event::{KeyCode, KeyEvent};

use super::page::Page;
use steps::STEPS;
pub use steps::Seen;

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

/// A position in the tour: the number of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tour(usize);

impl Tour {
    /// Shows `key` to the `tour`; returns whether it was for the tour alone. Enter always goes
    /// on, Esc ends the tour; all others go to the lab.
    pub fn take(tour: &mut Option<Self>, key: &KeyEvent) -> bool {
        let Some(Self(step)) = *tour else {
            return false;
        };
        *tour = match key.code {
            KeyCode::Enter => Some(Self(step + 1)).filter(|next| next.0 < STEPS.len()),
            KeyCode::Esc => None,
            _ => return false,
        };
        true
    }

    /// Returns the step on the screen, about the `run` as it is.
    pub fn page(self, run: &Seen) -> Page {
        let step = &STEPS[self.0];
        let is_last = self.0 + 1 == STEPS.len();
        let (text, hint) = if !(step.reached)(run) {
            ((step.ask)(run), "Enter skips this  Esc leaves")
        } else if is_last {
            ((step.look)(run), "Enter ends the tour  Esc leaves")
        } else {
            ((step.look)(run), "Enter goes on  Esc leaves")
        };
        let title = format!("tour {} of {}: {}", self.0 + 1, STEPS.len(), step.title);
        Page {
            aside: true,
            ..Page::text(title, text, hint)
        }
    }
}

#[cfg(test)]
mod tests {
    use crossterm::event::KeyModifiers;

    use super::*;
    use crate::view::{render_page, testing::*};

    fn key(code: KeyCode) -> KeyEvent {
        KeyEvent::new(code, KeyModifiers::NONE)
    }

    #[test]
    fn enter_goes_on_through_every_step_and_other_keys_are_for_the_lab() {
        let after = |mut tour, code| (Tour::take(&mut tour, &key(code)), tour);
        for number in 0..STEPS.len() {
            let tour = Some(Tour(number));
            let next = Some(Tour(number + 1)).filter(|_| number + 1 < STEPS.len());
            assert_eq!(after(tour, KeyCode::Char('b')), (false, tour));
            assert_eq!(after(tour, KeyCode::Esc), (true, None));
            assert_eq!(after(tour, KeyCode::Enter), (true, next));
        }
        assert_eq!(after(None, KeyCode::Enter), (false, None));
    }

    /// The place for a step on a screen of 80x24.
    const PLACE: (u16, u16) = (50, 10);

    /// Runs in all combinations of what the steps distinguish.
    fn runs() -> impl Iterator<Item = Seen> {
        (0..256).map(|bits: u32| {
            let is = |bit: u32| bits & 1 << bit != 0;
            Seen {
                hz: if is(0) { 12.5 } else { 50.0 },
                next_hz: if is(1) { 5.0 } else { 50.0 },
                common_hz: is(2).then_some(50.0),
                dropped: is(2),
                fell: is(3),
                over: is(3) || is(4),
                explained: is(5),
                same: is(6),
                real: is(7),
                now_s: 3.0,
            }
        })
    }

    #[test]
    fn every_text_fits_on_a_screen_of_80_by_24() {
        for (number, run) in (0..STEPS.len()).flat_map(|n| runs().map(move |run| (n, run))) {
            let page = Tour(number).page(&run);
            let drawn = drawn(PLACE, &RICH, |sheet| render_page(&page, sheet));
            let last = page.text.split_whitespace().next_back().expect("a word");
            assert!(drawn.contains(last), "{last:?} is cut off:\n{drawn}");
            assert!(drawn.contains("Esc leaves"), "{drawn}");
        }
    }
}
