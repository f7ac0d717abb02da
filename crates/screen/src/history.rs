//! The frames of a run, for looking back.

use std::collections::VecDeque;

use super::frame::FrameData;

/// Frames kept: five minutes at 30 a second, some tens of megabytes.
const KEPT: usize = 9_000;

/// The frames of a run so far, and which of them is looked at.
pub struct FrameHistory {
    frames: VecDeque<FrameData>,
    /// The most that are kept.
    most: usize,
    /// Index of the frame looked at; `None` for the newest as it changes.
    back: Option<usize>,
}

impl FrameHistory {
    /// Creates an empty history; it keeps the newest frame only, unless `back` is set.
    pub fn new(back: bool) -> Self {
        Self {
            frames: VecDeque::new(),
            most: if back { KEPT } else { 1 },
            back: None,
        }
    }

    /// Keeps `frame` if it differs from the newest; returns whether it does.
    pub fn add(&mut self, frame: FrameData) -> bool {
        if let Some(newest) = self.frames.back_mut() {
            // A graph at rest adds no frames while wall time passes.
            let before = std::mem::replace(&mut newest.wall_s, frame.wall_s);
            if *newest == frame {
                return before != frame.wall_s;
            }
            newest.wall_s = before;
        }
        if self.frames.len() == self.most {
            self.frames.pop_front();
            self.back = self.back.map(|index| index.saturating_sub(1));
        }
        self.frames.push_back(frame);
        true
    }

    /// Returns the frame looked at; `None` before the first.
    pub fn shown(&self) -> Option<&FrameData> {
        match self.back {
            Some(index) => self.frames.get(index),
            None => self.frames.back(),
        }
    }

    /// Returns the number of the frame in sight, from one, and the number of frames; `None` live.
    pub fn position(&self) -> Option<(usize, usize)> {
        self.back.map(|index| (index + 1, self.frames.len()))
    }

    /// Looks one frame back; false at the oldest.
    pub fn back(&mut self) -> bool {
        let newest = self.frames.len().saturating_sub(1);
        let before = self.back.unwrap_or(newest).checked_sub(1);
        self.back = before.or(self.back);
        before.is_some()
    }

    /// Looks one frame forward; live again at the newest.
    pub fn forward(&mut self) {
        let newest = self.frames.len().saturating_sub(1);
        self.back = self.back.map(|at| at + 1).filter(|at| *at < newest);
    }

    /// Looks at the oldest frame.
    pub fn oldest(&mut self) {
        self.back = (self.frames.len() > 1).then_some(0);
    }

    /// Looks at the newest frame as it changes.
    pub fn live(&mut self) {
        self.back = None;
    }
}
