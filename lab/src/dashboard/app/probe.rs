//! What tests see and do beside keys and screens.

use std::path::Path;

use ratelab::runtime::{Knob, telemetry::Event};

use super::App;
use crate::{
    dashboard::{frame::FrameData, knob_focus::KnobFocus, session::Session},
    recording::Destination,
};

impl App {
    /// The session under way.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Turns knobs as a key would.
    pub fn turn_to(&mut self, knobs: Vec<Knob>) {
        self.turn(knobs);
    }

    /// Has the graph turn a knob, unchecked.
    pub fn press_unchecked(&mut self, knob: Knob) {
        self.session.send(knob.clone().into());
        self.knobs.press(knob);
    }

    /// What is typed, if something is.
    pub fn typed(&self) -> Option<&str> {
        self.typing.then(|| self.prompt.typed())
    }

    /// What the prompt prints of its last entry.
    pub fn refusal(&self) -> Option<&str> {
        self.prompt.refusal()
    }

    /// The node and the topics whose knobs keys turn.
    pub fn knob_focus(&self) -> &KnobFocus {
        &self.knob_focus
    }

    /// Follows an event that the graph may tell.
    pub fn on_event(&mut self, event: &Event) {
        self.follow(event);
    }

    /// A frame of the session.
    pub fn picture_now(&mut self) -> FrameData {
        self.sampler.frame_data(&mut self.session)
    }

    /// Has recordings go to `folder`.
    pub fn record_to(&mut self, folder: &Path) {
        self.destination = Destination::new(Some(folder.to_owned()));
    }
}
