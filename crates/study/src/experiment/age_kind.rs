//! The kinds of the parts of an age.

use ratelab_account::AgeStage;

/// What a part of an age is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AgeKind {
    /// Waiting for the next tick of a node.
    Wait,
    /// In the ticks of a node.
    Cost,
    /// On the link of a topic.
    Link,
    /// In the queue of a topic.
    Queue,
    /// Waiting for a match on a topic.
    Match,
    /// Waiting for the executor of a node.
    Executor,
    /// Until something newer came on a topic.
    Hold,
    /// Before what is known.
    Before,
}

impl AgeKind {
    /// That of `stage`.
    pub fn of(stage: AgeStage) -> Self {
        match stage {
            AgeStage::Wait { .. } | AgeStage::Kept { .. } => Self::Wait,
            AgeStage::Cost { .. } => Self::Cost,
            AgeStage::Link { .. } => Self::Link,
            AgeStage::Queue { .. } => Self::Queue,
            AgeStage::Match { .. } => Self::Match,
            AgeStage::Executor { .. } => Self::Executor,
            AgeStage::Reuse { .. } | AgeStage::Held { .. } => Self::Hold,
            AgeStage::Before => Self::Before,
        }
    }

    /// Its name in JSON and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Wait => "wait",
            Self::Cost => "cost",
            Self::Link => "link",
            Self::Queue => "queue",
            Self::Match => "match",
            Self::Executor => "executor",
            Self::Hold => "hold",
            Self::Before => "before",
        }
    }
}
