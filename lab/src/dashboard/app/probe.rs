//! What tests see and do beside keys and screens.

use std::path::Path;

use ratelab::{
    experiment::{Config, Knob},
    runtime::telemetry::Event,
};

use super::App;
use crate::{
    dashboard::{frame::FrameData, session::Session},
    recording::Destination,
};

impl App {
    /// The session under way.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// The settings that the person wants.
    pub fn wanted(&self) -> &Config {
        &self.config
    }

    /// Turns a knob as a key would.
    pub fn turn_to(&mut self, knob: Knob) {
        self.turn(knob);
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
