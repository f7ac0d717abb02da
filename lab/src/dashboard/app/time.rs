//! The speed of run time, and the visible moment.

use ratelab::{ClockKind, Command, Speed};

use super::App;
use crate::dashboard::{
    presets::{self, Direction},
    sampler::RunSource,
};

impl App {
    pub(super) fn pause(&mut self) {
        if self.alive() {
            self.pause = !self.pause;
            let command = if self.pause {
                Command::Pause
            } else {
                Command::Resume
            };
            self.desk.run.send(command);
        }
    }

    pub(super) fn step(&mut self) {
        if self.looking_back().is_some() {
            self.history.forward();
        } else if self.alive() {
            match self.clock() {
                ClockKind::Virtual => {
                    self.pause = true;
                    self.desk.run.send(Command::Step);
                }
                ClockKind::Real => self
                    .desk
                    .notify("the real clock cannot step on: , goes back, c changes it"),
            }
        }
    }

    /// The clock wanted by the user; the graph may follow later.
    pub(super) fn clock(&self) -> ClockKind {
        self.config.clock
    }

    pub(super) fn other_clock(&mut self) {
        if self.alive() {
            let other = self.clock().other();
            self.desk.run.send(Command::HandOver(other));
            self.config.clock = other;
        }
    }

    /// The graph stays under its clock, whatever was wanted.
    pub(super) fn stays_on_clock(&mut self, reason: String) {
        self.config.clock = self.desk.run.observer().status().clock;
        self.desk.notify(reason);
    }

    pub(super) fn change_speed(&mut self, direction: Direction) {
        let current = match self.config.speed {
            Speed::Times(pace) => pace.get(),
            Speed::Unlimited => f64::INFINITY,
        };
        match presets::next(&presets::SPEEDS, current, direction) {
            Some(factor) => self.set_speed(factor),
            None if self.has_speed() => {
                self.desk
                    .notify(presets::at_end("speed", direction, self.config.speed))
            }
            None => {}
        }
    }

    pub(super) fn set_speed(&mut self, factor: f64) {
        if let Ok(speed) = Speed::times(factor)
            && self.has_speed()
        {
            self.config.speed = speed;
            if self.ended() {
                self.desk
                    .notify(format!("the run is over; r starts one at {speed}"));
            } else {
                self.desk.run.send(Command::Speed(speed));
            }
        }
    }

    /// Whether the clock has an adjustable speed; prints a notice if not.
    fn has_speed(&mut self) -> bool {
        let real = self.clock() == ClockKind::Real;
        if real {
            self.desk
                .notify("the real clock has no speed to set; c changes it");
        }
        !real
    }
}
