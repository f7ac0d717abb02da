//! Turning knobs: by the preset, by an exact value, and as the timed ones do.

use std::mem::discriminant;

use crossterm::event::{KeyCode, KeyEvent};
use ratelab::{
    experiment::{BROKEN_HZ, Config, Knob},
    policy::PolicyCache,
    runtime::{
        Depth, Hz,
        telemetry::{Event, EventKind},
    },
};

use super::App;
use crate::dashboard::{
    presets::{self, Direction},
    sampler::RunSource,
};

impl App {
    pub(super) fn turn_control_rate(&mut self, direction: Direction) {
        let current = self.config.control_hz.get();
        match presets::next(&presets::RATES, current, direction) {
            Some(hz) => self.turn_to_hz(hz, Knob::ControlHz),
            None => self.at_end("control rate", direction, self.config.control_hz),
        }
    }

    pub(super) fn turn_sensor_rate(&mut self, direction: Direction) {
        let current = self.config.sensor_hz.get();
        match presets::next(&presets::RATES, current, direction) {
            Some(hz) => self.turn_to_hz(hz, Knob::SensorHz),
            None => self.at_end("sensor rate", direction, self.config.sensor_hz),
        }
    }

    pub(super) fn turn_depth(&mut self, direction: Direction) {
        let current = self.config.queue_depth.get() as f64;
        match presets::next(&presets::DEPTHS, current, direction)
            .map(|depth| Depth::new(depth as usize))
        {
            Some(Ok(depth)) => self.turn(Knob::QueueDepth(depth)),
            _ => self.at_end("queue depth", direction, self.config.queue_depth),
        }
    }

    pub(super) fn break_it(&mut self) {
        if self.config.control_hz.get() == BROKEN_HZ {
            self.notify(format!(
                "it is broken already: the policy decides {BROKEN_HZ} times a second"
            ));
        } else {
            self.turn_to_hz(BROKEN_HZ, Knob::ControlHz);
        }
    }

    pub(super) fn at_end(
        &mut self,
        what: &str,
        direction: Direction,
        value: impl std::fmt::Display,
    ) {
        let end = if direction == Direction::Up {
            "highest"
        } else {
            "lowest"
        };
        self.notify(format!("{what} is at its {end}, {value}"));
    }

    fn turn_to_hz(&mut self, hz: f64, knob: fn(Hz) -> Knob) {
        if let Ok(hz) = Hz::new(hz) {
            self.turn(knob(hz));
        }
    }

    /// Turns a knob of the running graph; the next session starts with it.
    pub(super) fn turn(&mut self, knob: Knob) {
        if self.ended() {
            self.notify(format!(
                "the run is over: {knob} counts from the next one, r starts it"
            ));
        } else {
            for command in knob.commands() {
                self.session.send(command);
            }
        }
        self.pressed.push_back(knob);
        self.settle();
    }

    /// Keeps up with what happened.
    pub(super) fn follow_events(&mut self) {
        for event in self.session.observer().events(self.events.len()) {
            self.follow(&event);
            self.events.push(event);
        }
    }

    /// Follows what the graph did with a knob, be it one that a key turned or one
    /// that was given its time up front.
    pub(super) fn follow(&mut self, event: &Event) {
        let (command, refused) = match &event.what {
            EventKind::Applied { command, .. } => (command, None),
            EventKind::Refused { command, reason } => (command, Some(reason)),
            _ => return,
        };
        let Some(knob) = Knob::of(command) else {
            return;
        };
        let pressed = self.answered(&knob);
        match refused {
            None => set(&mut self.running, knob),
            // A policy that was there when a key asked for it may be gone by now.
            Some(reason) if pressed => self.notify(reason.clone()),
            Some(_) => {}
        }
        self.settle();
    }

    /// Takes `knob` from those that wait for an answer, if it is the first of its
    /// kind there. A timed knob of the same value may be taken for it: the one that
    /// a key turned then comes later, and sets that value all the same.
    fn answered(&mut self, knob: &Knob) -> bool {
        let mut pressed = self.pressed.iter();
        let first = pressed.position(|other| discriminant(other) == discriminant(knob));
        let first = first.filter(|index| self.pressed[*index] == *knob);
        first.and_then(|index| self.pressed.remove(index)).is_some()
    }

    /// What the person wants is what runs, and what is on its way to it.
    fn settle(&mut self) {
        let running = self.running.clone();
        self.config = Config {
            control_hz: running.control_hz,
            sensor_hz: running.sensor_hz,
            queue_depth: running.queue_depth,
            policy: running.policy,
            ..self.config.clone()
        };
        for knob in &self.pressed {
            set(&mut self.config, knob.clone());
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
                match parse_knob(&typed, &self.setup.policies) {
                    Ok(knob) => self.turn(knob),
                    Err(reason) => self.notify(reason),
                }
            }
            _ => {}
        }
    }
}

fn set(config: &mut Config, knob: Knob) {
    match knob {
        Knob::ControlHz(hz) => config.control_hz = hz,
        Knob::SensorHz(hz) => config.sensor_hz = hz,
        Knob::QueueDepth(depth) => config.queue_depth = depth,
        Knob::Policy(policy) => config.policy = policy,
    }
}

/// A knob as it is typed: a name and a value.
fn parse_knob(typed: &str, cache: &PolicyCache) -> Result<Knob, String> {
    let words: Vec<&str> = typed.split_whitespace().collect();
    match words[..] {
        [name, value] => match Knob::parse(name, value) {
            Ok(Knob::Policy(policy)) => {
                let pinned = cache.pin(&policy).map_err(|error| error.to_string())?;
                Ok(Knob::Policy(pinned))
            }
            parsed => parsed.map_err(|error| error.to_string()),
        },
        _ => Err("expected a knob and a value, such as control-hz 7.5 or queue-depth 3".to_owned()),
    }
}
