//! The parts of the screen, one of which has the focus.

/// A part of the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pane {
    /// The node graph.
    Graph,
    /// The plant, where the system has a picture of it.
    Plant,
    /// A signal over time, where the system has one.
    Signal,
    /// Topics, latency, nodes.
    Figures,
    /// Verdict and events.
    Events,
    /// Ticks and messages over a short stretch.
    Timeline,
}

impl Pane {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; 6] = [
        Self::Graph,
        Self::Plant,
        Self::Signal,
        Self::Figures,
        Self::Events,
        Self::Timeline,
    ];

    /// The one after it among those that `exist`.
    pub fn next(self, exist: impl Fn(Self) -> bool) -> Self {
        let index = Self::ALL.iter().position(|pane| *pane == self);
        let after = Self::ALL.iter().cycle().skip(index.unwrap_or(0) + 1);
        let mut after = after.take(Self::ALL.len()).copied();
        after.find(|pane| exist(*pane)).unwrap_or(self)
    }
}
