//! What was seen, for looking back.

use std::{collections::VecDeque, sync::Arc};

use super::picture::Picture;

/// Pictures kept: five minutes at 30 a second, some tens of megabytes.
const KEPT: usize = 9_000;

/// The pictures of a run so far, and which of them is looked at.
#[derive(Default)]
pub struct History {
    pictures: VecDeque<Arc<Picture>>,
    /// Index of the picture looked at; `None` for the newest as it changes.
    back: Option<usize>,
}

impl History {
    /// Keeps `picture` if it differs from the newest; says whether it does.
    pub fn add(&mut self, picture: Picture) -> bool {
        if let Some(newest) = self.pictures.back_mut() {
            if **newest == picture {
                return false;
            }
            // Wall time that passes over a graph at rest is nothing to look
            // back at.
            if newest.differs_in_wall_time_only(&picture) {
                *newest = Arc::new(picture);
                return true;
            }
        }
        if self.pictures.len() == KEPT {
            self.pictures.pop_front();
            self.back = self.back.map(|index| index.saturating_sub(1));
        }
        self.pictures.push_back(Arc::new(picture));
        true
    }

    /// The picture looked at; `None` before the first.
    pub fn shown(&self) -> Option<Arc<Picture>> {
        let index = self.back.or_else(|| self.pictures.len().checked_sub(1))?;
        self.pictures.get(index).cloned()
    }

    /// Which picture of how many is looked at, counted from one; `None` live.
    pub fn position(&self) -> Option<(usize, usize)> {
        self.back.map(|index| (index + 1, self.pictures.len()))
    }

    /// Looks one picture back; false at the oldest.
    pub fn back(&mut self) -> bool {
        let current = self.back.unwrap_or(self.pictures.len().saturating_sub(1));
        let Some(before) = current.checked_sub(1) else {
            return false;
        };
        self.back = Some(before);
        true
    }

    /// Looks one picture forward; live again at the newest.
    pub fn forward(&mut self) {
        self.back = self
            .back
            .map(|index| index + 1)
            .filter(|index| index + 1 < self.pictures.len());
    }

    /// Looks at the oldest picture.
    pub fn oldest(&mut self) {
        self.back = (self.pictures.len() > 1).then_some(0);
    }

    /// Looks at the newest picture as it changes.
    pub fn live(&mut self) {
        self.back = None;
    }
}
