//! Access for tests, besides keys and screens.

use std::path::Path;

use ratelab::{Event, Knob};

use super::App;
use crate::{
    dashboard::{frame::FrameData, knob_focus::KnobFocus, sampler::RunSource, session::Session},
    recording::Destination,
    rescue::RescueTry,
};

impl App {
    /// The current session.
    pub fn session(&self) -> &Session {
        &self.desk.run
    }

    /// Turns knobs, like a key.
    pub fn turn_to(&mut self, knobs: Vec<Knob>) {
        self.turn(knobs);
    }

    /// Turns a knob of the graph, unchecked.
    pub fn press_unchecked(&mut self, knob: Knob) {
        self.desk.run.send(knob.clone().into());
        self.knobs.press(knob);
    }

    /// The typed text, if the prompt is open.
    pub fn typed(&self) -> Option<&str> {
        self.desk.prompt.is_open().then(|| self.desk.prompt.typed())
    }

    /// The prompt's reply to its last entry.
    pub fn refusal(&self) -> Option<&str> {
        self.desk.prompt.refusal()
    }

    /// The node and the topics of the knob keys.
    pub fn knob_focus(&self) -> &KnobFocus {
        &self.desk.knob_focus
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
