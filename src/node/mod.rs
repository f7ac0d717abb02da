//! Work tied to a rate.

mod job;
mod slot;
mod tick;

use std::error::Error;

use thiserror::Error;

pub(crate) use self::{
    job::{Job, WorkTimes},
    slot::{Ends, Fixed, NodeSlot, Rebuild},
};
pub use self::{
    job::{JobKind, LastTick},
    tick::Tick,
};

use crate::time::Time;

/// Whether the run goes on after a tick.
///
/// Ending is a result: a pole fell, a goal was reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flow {
    /// It goes on.
    Continue,
    /// It ends.
    End,
}

impl Flow {
    /// Ends the run if either of two does.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        match self {
            Self::Continue => other,
            Self::End => Self::End,
        }
    }
}

/// The error of a node, of any type.
pub type NodeError = Box<dyn Error + Send + Sync>;

/// The result of a tick: how the run goes on, or the failure of the node, reported as a [`Fault`]
/// that names it.
pub type TickResult = Result<Flow, NodeError>;

/// What a closure that is a node may return: nothing, a [`Flow`], or a [`TickResult`].
#[diagnostic::on_unimplemented(
    message = "a node returns nothing, a `Flow` or a `TickResult`",
    note = "end a tick that uses `?` with `Ok(Flow::Continue)`"
)]
pub trait IntoTickResult {
    /// Returns the result of the tick.
    ///
    /// # Errors
    /// The failure of the node.
    fn into_result(self) -> TickResult;
}

impl IntoTickResult for () {
    #[inline]
    fn into_result(self) -> TickResult {
        Ok(Flow::Continue)
    }
}

impl IntoTickResult for Flow {
    #[inline]
    fn into_result(self) -> TickResult {
        Ok(self)
    }
}

impl IntoTickResult for TickResult {
    #[inline]
    fn into_result(self) -> TickResult {
        self
    }
}

/// A unit of computation on the graph.
///
/// A clock calls [`tick`](Node::tick) at the node's rate. A node communicates with the
/// rest of the graph only through the ends of topics it received when it was built, so it
/// is independent of the nodes on the other side.
///
/// ```
/// use ratelab::{Depth, Flow, Node, Publisher, Subscription, Tick, TickResult, Time, Topic};
///
/// /// Publishes the square of the newest number.
/// struct Square {
///     input: Subscription<f64>,
///     output: Publisher<f64>,
/// }
///
/// impl Node for Square {
///     fn tick(&mut self, tick: &mut Tick) -> TickResult {
///         if let Some(number) = tick.read(&mut self.input) {
///             tick.publish(&self.output, number.data.powi(2));
///         }
///         Ok(Flow::Continue)
///     }
/// }
///
/// let (numbers, squares) = (Topic::new("/n", Depth::ONE), Topic::new("/n²", Depth::ONE));
/// let mut square = Square { input: numbers.subscribe(), output: squares.publisher() };
/// let mut result = squares.subscribe();
/// let mut tick = Tick::at(Time::ZERO);
/// tick.publish(&numbers.publisher(), 3.0);
/// square.tick(&mut tick)?;
/// assert_eq!(tick.read(&mut result).map(|square| square.data), Some(9.0));
/// # Ok::<(), Box<dyn std::error::Error + Send + Sync>>(())
/// ```
///
/// A closure that takes `tick: &mut Tick` is a node as well; it may return nothing, a [`Flow`] or a
/// [`TickResult`].
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a node",
    note = "a node implements `Node`, or is a closure `move |tick: &mut Tick| ...` with that type"
)]
pub trait Node: Send {
    /// Does one period's work.
    ///
    /// # Errors
    /// Any failure of the node. The run ends with a [`Fault`]; after a [`NodeCrash`] it goes on
    /// without the node. What the tick has published at once is published; what waits for its end, and
    /// its action, is not.
    fn tick(&mut self, tick: &mut Tick) -> TickResult;

    /// Applies the decision of a tick to the world outside of the graph, when the tick is over. Most
    /// nodes only publish, and their messages wait for the end of the tick automatically; see
    /// [`Knob::Takes`](crate::Knob::Takes).
    ///
    /// # Errors
    /// Any failure of the node. The run ends with a [`Fault`].
    fn apply(&mut self, tick: &mut Tick) -> TickResult {
        let _ = tick;
        Ok(Flow::Continue)
    }

    /// Resets the node to its state when it was built, as a restart of a program does.
    /// Called only for a node that is not a [restartable one](crate::Graph::restartable_node).
    ///
    /// # Errors
    /// The reason if the node cannot restart. The default refuses, because the initial
    /// state is unknown.
    fn restart(&mut self) -> Result<(), NodeError> {
        Err(
            "this node cannot be started again: it is built once, and does not implement \
             Node::restart"
                .into(),
        )
    }

    /// Handles a text sent to the node, between two calls of it, and returns the value before,
    /// for the log. Answer and effect must depend only on `text` and the node itself, so
    /// that a run can be repeated exactly.
    ///
    /// # Errors
    /// The reason and a remedy; the node is then unchanged. The default refuses every
    /// text.
    fn on_order(&mut self, text: &str) -> Result<String, NodeError> {
        let _ = text;
        Err("this node takes no orders".into())
    }

    /// Sets a parameter of the node at run time `now`, between two calls of it, and returns
    /// the value before, for the log. As for [`on_order`](Node::on_order), a run can be
    /// repeated exactly only if the effect depends on nothing else.
    ///
    /// # Errors
    /// The reason and a remedy; the node is then unchanged. The default knows no parameter.
    fn set_parameter(&mut self, name: &str, value: &str, now: Time) -> Result<String, NodeError> {
        let _ = (value, now);
        Err(format!("this node has no parameter {name:?}").into())
    }
}

impl<F, R> Node for F
where
    F: FnMut(&mut Tick) -> R + Send,
    R: IntoTickResult,
{
    fn tick(&mut self, tick: &mut Tick) -> TickResult {
        self(tick).into_result()
    }
}

/// A failure of a node that ends the run.
#[derive(Debug, Error)]
#[error("node {node:?} failed at {at}: {cause}")]
pub struct Fault {
    /// The node's name.
    pub node: String,
    /// Run time of the tick that failed.
    pub at: Time,
    /// What went wrong.
    #[source]
    pub cause: NodeError,
}

/// An error of a tick after which the node counts as crashed, and the run goes on: what the
/// node stands for has died, such as a process of its own. Says why, and what to do.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct NodeCrash(pub String);

/// The cause of a [`Fault`] when a node panicked.
#[derive(Debug, Error)]
#[error("it panicked: {0}")]
pub struct Panicked(pub String);
