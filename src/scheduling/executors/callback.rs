//! A node as an executor knows it.

use std::time::Duration;

/// A node given to an executor: its timer, or a subscription for each topic that triggers
/// it.
///
/// ```
/// use std::time::Duration;
/// use ratelab::Callback;
///
/// let camera = Callback::new("camera").in_group("sensors");
/// let control = Callback::new("control").with_deadline(Duration::from_millis(5));
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Callback {
    pub(crate) node: String,
    /// The name of its mutually exclusive group, if it is in one.
    group: Option<String>,
    pub(crate) deadline: Option<Duration>,
}

impl Callback {
    /// Creates the node called `node`, in a group of its own.
    pub fn new(node: impl Into<String>) -> Self {
        Self {
            node: node.into(),
            group: None,
            deadline: None,
        }
    }

    /// In the mutually exclusive group called `group`: of its nodes one ticks at a time.
    #[must_use]
    pub fn in_group(self, group: impl Into<String>) -> Self {
        let group = Some(group.into());
        Self { group, ..self }
    }

    /// Returns the name of its mutually exclusive group, if it is in one.
    pub fn group_name(&self) -> Option<&str> {
        self.group.as_deref()
    }

    /// In a reentrant group: its nodes tick beside each other. A node ticks once at a
    /// time all the same, because its state is its own: so each is as in a group of its own.
    #[must_use]
    pub fn in_reentrant_group(self) -> Self {
        let group = None;
        Self { group, ..self }
    }

    /// Returns its deadline relative to the release, if one is given.
    pub fn deadline(&self) -> Option<Duration> {
        self.deadline
    }

    /// With a deadline relative to its release; the period of a node at a rate if none is
    /// given.
    #[must_use]
    pub fn with_deadline(self, deadline: Duration) -> Self {
        let deadline = Some(deadline);
        Self { deadline, ..self }
    }
}
