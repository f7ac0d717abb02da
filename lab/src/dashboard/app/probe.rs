//! Access for tests, besides keys and screens.

use std::path::Path;

use ratelab::{Event, Knob};

use super::App;
use crate::{
    dashboard::{frame::FrameData, sampler::RunSource},
    recording::Destination,
    rescue::RescueTry,
};

impl App {
    /// Turns knobs, like a key.
    pub fn turn_to(&mut self, knobs: Vec<Knob>) {
        self.turn(knobs);
    }

    /// Turns a knob of the graph, unchecked.
    pub fn press_unchecked(&mut self, knob: Knob) {
        self.desk.run.send(knob.clone().into());
        self.knobs.press(knob);
    }

    /// Processes an event of the graph.
    pub fn on_event(&mut self, event: &Event) {
        self.follow(event);
    }

    /// A frame of the session.
    pub fn picture_now(&mut self) -> FrameData {
        let rows = self.desk.run.new_rows();
        self.desk.sampler.frame_data(&mut self.desk.run, &rows)
    }

    /// Begins a rescue by hand.
    pub fn rescue_by_hand(&mut self) {
        self.try_by_hand().expect("a session");
    }

    /// The rescue by hand, if the session is one.
    pub fn by_hand(&self) -> Option<&RescueTry> {
        self.by_hand.as_ref()
    }

    /// Sends recordings to `folder`.
    pub fn record_to(&mut self, folder: &Path) {
        self.destination = Destination::new(Some(folder.to_owned()));
    }
}
