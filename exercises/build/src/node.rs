//! Work tied to a rate. Yours to write.

/// Work tied to a rate. It knows nobody: what it needs is in its closure, the ends of topics
/// for instance.
pub struct Node<'w> {
    // Replace this: a name, a rate, a priority and the work.
    nothing: std::marker::PhantomData<&'w ()>,
}

impl<'w> Node<'w> {
    /// Returns a node that does `work` `hz` times a second. The work receives the time of the tick
    /// (ns), and returns whether the run goes on. Of nodes that are due at the same instant the one
    /// with the lowest `priority` ticks first.
    pub fn new(_name: &str, _hz: u64, _priority: u32, _work: impl FnMut(u64) -> bool + 'w) -> Self {
        Self {
            nothing: std::marker::PhantomData,
        }
    }

    /// Returns the name.
    pub fn name(&self) -> &str {
        todo!("return the name")
    }

    /// Returns when it ticks next (ns), and its priority: the node with the least of these is the
    /// next one to tick.
    pub fn turn(&self) -> (u64, u32) {
        let _ = self.nothing;
        todo!("return when the next tick is due, and the priority")
    }

    /// Does one tick, at the time at which it is due, and moves on to the next. Returns
    /// whether the run goes on.
    pub fn tick(&mut self) -> bool {
        todo!("do the work, and move on")
    }
}
