//! Turning knobs: by the rung, by an exact value, and as the timed ones do.

use crossterm::event::{KeyCode, KeyEvent};
use ratelab::{
    experiment::{BROKEN_HZ, Knob, TimedKnob},
    runtime::{
        Command, Depth, Hz,
        telemetry::{Event, Happening},
    },
};

use super::App;
use crate::dashboard::{
    ladder::{self, Way},
    sampler::Watched,
};

impl App {
    pub(super) fn turn_control_rate(&mut self, way: Way) {
        let current = self.config.control_hz.get();
        match ladder::next(&ladder::RATES, current, way) {
            Some(hz) => self.turn_to_hz(hz, Knob::ControlHz),
            None => self.at_end("control rate", way, self.config.control_hz),
        }
    }

    pub(super) fn turn_sensor_rate(&mut self, way: Way) {
        let current = self.config.sensor_hz.get();
        match ladder::next(&ladder::RATES, current, way) {
            Some(hz) => self.turn_to_hz(hz, Knob::SensorHz),
            None => self.at_end("sensor rate", way, self.config.sensor_hz),
        }
    }

    pub(super) fn turn_depth(&mut self, way: Way) {
        let current = self.config.queue_depth.get() as f64;
        match ladder::next(&ladder::DEPTHS, current, way).map(|depth| Depth::new(depth as usize)) {
            Some(Ok(depth)) => self.turn(Knob::QueueDepth(depth)),
            _ => self.at_end("queue depth", way, self.config.queue_depth),
        }
    }

    pub(super) fn break_it(&mut self) {
        if self.config.control_hz.get() == BROKEN_HZ {
            self.say(format!(
                "it is broken already: the policy decides {BROKEN_HZ} times a second"
            ));
        } else {
            self.turn_to_hz(BROKEN_HZ, Knob::ControlHz);
        }
    }

    pub(super) fn at_end(&mut self, what: &str, way: Way, value: impl std::fmt::Display) {
        let end = if way == Way::Up { "highest" } else { "lowest" };
        self.say(format!("{what} is at its {end}, {value}"));
    }

    fn turn_to_hz(&mut self, hz: f64, knob: fn(Hz) -> Knob) {
        if let Ok(hz) = Hz::new(hz) {
            self.turn(knob(hz));
        }
    }

    /// Turns a knob of the running graph; the next session starts with it.
    pub(super) fn turn(&mut self, knob: Knob) {
        self.set(knob.clone());
        if self.ended() {
            self.say(format!(
                "the run is over: {knob} counts from the next one, r starts it"
            ));
            return;
        }
        self.turning += 1;
        for command in knob.commands() {
            self.session.send(command);
        }
    }

    fn set(&mut self, knob: Knob) {
        match knob {
            Knob::ControlHz(hz) => self.config.control_hz = hz,
            Knob::SensorHz(hz) => self.config.sensor_hz = hz,
            Knob::QueueDepth(depth) => self.config.queue_depth = depth,
            Knob::Policy(brain) => self.config.policy = brain,
        }
    }

    /// Keeps up with what happened. Knobs may have been given their times up
    /// front: the ladders go on from where those lead.
    pub(super) fn follow_events(&mut self) {
        for event in self.session.observer().events(self.events.len()) {
            match TimedKnob::of(&event) {
                Some(_) if self.turning > 0 => self.turning -= 1,
                Some(timed) => self.set(timed.knob),
                None => self.follow_refusal(&event),
            }
            self.events.push(event);
        }
    }

    /// A brain that was there when a key asked for it may be gone by now.
    fn follow_refusal(&mut self, event: &Event) {
        if let Happening::Refused { command, reason } = &event.what
            && matches!(command, Command::Tell { .. })
        {
            self.turning = self.turning.saturating_sub(1);
            self.say(reason.clone());
        }
    }

    /// Types into the prompt; Enter turns the knob that was typed.
    pub(super) fn edit(&mut self, key: &KeyEvent) {
        let Some(prompt) = &mut self.prompt else {
            return;
        };
        match key.code {
            KeyCode::Esc => self.prompt = None,
            KeyCode::Backspace => drop(prompt.pop()),
            KeyCode::Char(character) => prompt.push(character),
            KeyCode::Enter => {
                let typed = self.prompt.take().unwrap_or_default();
                match parse_knob(&typed) {
                    Ok(knob) => self.turn(knob),
                    Err(reason) => self.say(reason),
                }
            }
            _ => {}
        }
    }
}

/// A knob as it is typed: a name and a value.
fn parse_knob(typed: &str) -> Result<Knob, String> {
    let words: Vec<&str> = typed.split_whitespace().collect();
    match words[..] {
        [name, value] => Knob::parse(name, value)
            .map_err(|error| error.to_string())
            .and_then(|knob| knob.pinned().map_err(|error| error.to_string())),
        _ => Err("expected a knob and a value, such as control-hz 7.5 or queue-depth 3".to_owned()),
    }
}
