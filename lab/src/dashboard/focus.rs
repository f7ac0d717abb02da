//! The parts of the screen, one of which has the focus.

/// A part of the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pane {
    /// The node graph.
    Graph,
    /// The plant: the cart-pole.
    Plant,
    /// The pole's angle over time.
    Angle,
    /// Topics, latency, nodes.
    Figures,
    /// Verdict and events.
    Events,
}

impl Pane {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; 5] = [
        Self::Graph,
        Self::Plant,
        Self::Angle,
        Self::Figures,
        Self::Events,
    ];

    /// The one after it.
    pub fn next(self) -> Self {
        let index = Self::ALL.iter().position(|pane| *pane == self);
        Self::ALL[(index.unwrap_or(0) + 1) % Self::ALL.len()]
    }
}
