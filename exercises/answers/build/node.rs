//! The answer to exercise 11, for teachers: work tied to a rate.

use crate::Rate;

/// Work tied to a rate.
pub struct Node<'w> {
    name: String,
    rate: Rate,
    priority: u32,
    work: Box<dyn FnMut(u64) -> bool + 'w>,
}

impl<'w> Node<'w> {
    /// Returns a node that does `work` `hz` times a second.
    pub fn new(name: &str, hz: u64, priority: u32, work: impl FnMut(u64) -> bool + 'w) -> Self {
        Self {
            name: name.to_owned(),
            rate: Rate::new(hz),
            priority,
            work: Box::new(work),
        }
    }

    /// Returns the name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns when it ticks next (ns), and its priority.
    pub fn turn(&self) -> (u64, u32) {
        (self.rate.due(), self.priority)
    }

    /// Does one tick and moves on to the next.
    pub fn tick(&mut self) -> bool {
        let goes_on = (self.work)(self.rate.due());
        self.rate.advance();
        goes_on
    }
}
