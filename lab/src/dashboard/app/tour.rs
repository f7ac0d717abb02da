//! The guided tour over a running session.

use crossterm::event::KeyEvent;

use super::App;
use crate::dashboard::{
    frame::FrameData,
    tour::{Guide, OFFER, Seen, Tour, Walk},
    view::Page,
};

impl App {
    /// Offers the tour, or begins it.
    pub fn guide(&mut self, guide: Guide) {
        match guide {
            Guide::Nobody => {}
            Guide::Offer => self.desk.notify(OFFER),
            Guide::Tour => self.tour = Some(Tour::default()),
        }
    }

    /// Begins the tour, or ends it.
    pub(super) fn toggle_tour(&mut self) {
        self.tour = match self.tour {
            None => Some(Tour::default()),
            Some(_) => None,
        };
    }

    /// Shows `key` to the tour; returns whether it was for the tour alone.
    pub(super) fn is_for_the_tour(&mut self, key: &KeyEvent) -> bool {
        let Some(tour) = self.tour.filter(|_| !self.mapping) else {
            return false;
        };
        let walk = tour.take(key);
        match walk {
            Walk::Lab => {}
            Walk::On(tour) => self.tour = Some(tour),
            Walk::Over => self.tour = None,
        }
        walk != Walk::Lab
    }

    /// The step of the tour, about the run in `frame`.
    pub(super) fn tour_page(&self, frame: &FrameData) -> Option<Page> {
        let run = || Seen::of(frame, &self.wanted(), self.ended());
        self.tour.map(|tour| tour.page(&run()))
    }
}
