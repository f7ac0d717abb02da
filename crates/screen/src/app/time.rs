//! The passing of run time and its speed, here and in a recording, and the visible moment.

use std::{
    thread,
    time::{Duration, Instant},
};

use ratelab::{ClockKind, Command, Speed, Time};

use super::{App, restart::PATIENCE, shown::ShownRun};
use crate::{
    knobs::{self, Direction},
    panes::Pane,
    playback::Playback,
    sampler::Sampler,
};

/// The step of PgUp and PgDn.
const SECOND: Duration = Duration::from_secs(1);

impl App {
    /// Pauses, or goes on.
    pub(super) fn pause(&mut self) {
        if self.alive() {
            self.pause = !self.pause;
            self.shown.run.send(if self.pause {
                Command::Pause
            } else {
                Command::Resume
            });
        }
    }

    /// Runs one tick; looking back, goes one picture forward.
    pub(super) fn step_forward(&mut self) {
        if self.shown.frames.position().is_some() {
            self.shown.frames.forward();
        } else if self.alive() {
            match self.config.clock {
                ClockKind::Virtual => {
                    self.pause = true;
                    self.shown.run.send(Command::Step);
                }
                ClockKind::Real => {
                    self.notify("the real clock cannot step on: , goes back, c changes it");
                }
            }
        }
    }

    /// Hands the graph to the other clock; it may follow later.
    pub(super) fn other_clock(&mut self) {
        if self.alive() {
            self.config.clock = self.config.clock.other();
            self.shown.run.send(Command::HandOver(self.config.clock));
        }
    }

    /// The graph stays under its clock, whatever was wanted.
    pub(super) fn stays_on_clock(&mut self, reason: &str) {
        self.config.clock = self.shown.run.observer().status().clock;
        self.notify(reason);
    }

    pub(super) fn change_speed(&mut self, direction: Direction) {
        let next = |speed| knobs::next(&knobs::SPEEDS, speed, direction);
        if let ShownRun::Recorded(playback) = &mut self.shown.run {
            let speed = playback.speed;
            match next(speed) {
                Some(faster) => playback.speed = faster,
                None => self.notify(format!("{speed}× is the end of the speeds")),
            }
            return;
        }
        let current = match self.config.speed {
            Speed::Times(pace) => pace.get(),
            Speed::Unlimited => f64::INFINITY,
        };
        match next(current) {
            Some(factor) => self.set_speed(factor),
            None if self.has_speed() => {
                self.notify(knobs::at_end("speed", direction, self.config.speed));
            }
            None => {}
        }
    }

    pub(super) fn set_speed(&mut self, factor: f64) {
        if let ShownRun::Recorded(playback) = &mut self.shown.run {
            playback.speed = factor;
            return;
        }
        let Ok(speed) = Speed::times(factor) else {
            return;
        };
        if self.has_speed() {
            self.config.speed = speed;
            if self.ended() {
                self.notify(format!("the run is over; r starts one at {speed}"))
            } else {
                self.shown.run.send(Command::Speed(speed))
            }
        }
    }

    /// Returns whether the clock has an adjustable speed; gives notice if not.
    fn has_speed(&mut self) -> bool {
        let real = self.config.clock == ClockKind::Real;
        if real {
            self.notify("the real clock has no speed to set; c changes it");
        }
        !real
    }

    /// Rests before the program is suspended: under either clock run time would otherwise
    /// jump ahead afterwards, and every period in between would count as an overrun.
    pub fn rest(&mut self) {
        if !self.is_live() || self.pause || self.resting || self.ended() {
            return;
        }
        self.resting = true;
        self.shown.run.send(Command::Pause);
        let asked = Instant::now();
        // The program is suspended even with a busy graph.
        while !self.shown.run.observer().status().paused && asked.elapsed() < PATIENCE {
            thread::sleep(Duration::from_millis(1));
        }
    }

    /// Goes on from the same moment after the program was suspended.
    pub fn go_on(&mut self) {
        if let ShownRun::Recorded(playback) = &mut self.shown.run {
            playback.go_on();
        }
        if std::mem::take(&mut self.resting) {
            self.shown.run.send(Command::Resume);
        }
    }
}

/// A recording that is played.
impl App {
    /// Returns the position in it, outside of ticks that overlap, and the sampler of what is shown.
    pub(super) fn playback(&mut self) -> Option<(&mut Playback, &mut Sampler)> {
        let ShownRun::Recorded(playback) = &mut self.shown.run else {
            return None;
        };
        let sampler = &mut self.shown.sampler;
        playback.leave_overlap(sampler);
        Some((playback, sampler))
    }

    /// Says which key plays the recording, at a speed at which it can be watched.
    pub fn suggest_playing(&mut self) {
        if let ShownRun::Recorded(playback) = &mut self.shown.run {
            playback.slow_down_if_short();
            let speed = playback.speed;
            let offer = format!("Space plays it at {speed}×, . goes to the next message");
            self.notice.get_or_insert(offer);
        }
    }

    /// Is drawn frame by frame from now on, as if the recording played at `speed`.
    pub fn film(&mut self, speed: f64) {
        if let ShownRun::Recorded(playback) = &mut self.shown.run {
            playback.film(speed);
        }
    }

    /// Plays, or stands still.
    pub fn play(&mut self) {
        if let Some((playback, sampler)) = self.playback() {
            if playback.is_playing() {
                playback.rest()
            } else {
                playback.play(sampler)
            }
        }
    }

    /// Steps to the moment of the neighbouring messages.
    pub(super) fn step(&mut self, direction: Direction) {
        if let Some((playback, sampler)) = self.playback() {
            self.notice = playback.step(direction, sampler);
        }
    }

    /// Jumps to `at`; playback goes on from there.
    pub fn jump(&mut self, at: Time) {
        if let Some((playback, sampler)) = self.playback() {
            playback.go(at, sampler);
            playback.go_on();
        }
    }

    /// Jumps by a second.
    pub(super) fn skip(&mut self, direction: Direction) {
        if let Some((playback, _)) = self.playback() {
            let at = playback.at();
            self.jump(match direction {
                Direction::Up => at + SECOND,
                Direction::Down => at - SECOND,
            });
        }
    }

    /// Jumps to the neighbouring event.
    pub(super) fn seek_event(&mut self, direction: Direction) {
        let playback = self.playback();
        let event = playback.and_then(|(playback, _)| playback.event(direction));
        match (event, direction) {
            (Some(at), _) => self.jump(at),
            (None, Direction::Up) => self.notify("no event comes after this"),
            (None, Direction::Down) => self.notify("no event came before this"),
        }
    }

    /// Goes to the neighbouring operation of ticks that overlap.
    pub(super) fn operate(&mut self, direction: Direction) {
        let ShownRun::Recorded(playback) = &mut self.shown.run else {
            return;
        };
        match playback.operate(direction, &mut self.shown.sampler) {
            Ok(true) => self.shown.panes.focus = Pane::Timeline,
            Ok(false) => {}
            Err(_) if self.executing.is_some() => self.notify("the run is still executed again"),
            Err(notice) => self.notify(notice.to_string()),
        }
    }

    /// Follows the recording as it plays; returns whether there is something new.
    pub(super) fn follow_playback(&mut self) -> bool {
        let ShownRun::Recorded(playback) = &mut self.shown.run else {
            return false;
        };
        playback.follow(&mut self.shown.sampler);
        let held = playback.follow_held();
        let moved = playback.is_playing() || held.is_some();
        self.notice = held.or(self.notice.take());
        moved
    }
}
