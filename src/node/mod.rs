//! Work tied to a rate.

mod job;
mod last_tick;
mod slot;

use std::{error::Error, ops::ControlFlow};

use thiserror::Error;

pub(crate) use self::{
    job::WorkTimes,
    slot::{Ends, Fixed, NodeSlot, Rebuild},
};
pub use self::{
    job::{Job, JobKind},
    last_tick::LastTick,
};

use crate::time::Time;

/// The result of one tick: go on, end the run, or fail.
///
/// Ending is a result (a pole fell, a goal was reached); failing is an error,
/// reported as a [`Fault`] that names the node. Most ticks return [`GO_ON`].
pub type Tick = Result<ControlFlow<()>, Box<dyn Error + Send + Sync>>;

/// The [`Tick`] after which the run goes on.
pub const GO_ON: Tick = Ok(ControlFlow::Continue(()));

/// The [`Tick`] that ends the run.
pub const END: Tick = Ok(ControlFlow::Break(()));

/// A unit of computation on the graph.
///
/// A clock calls [`tick`](Node::tick) at the node's rate. A node communicates with the
/// rest of the graph only through the ends of topics it received when it was built, so it
/// is independent of the nodes on the other side.
///
/// ```
/// use ratelab::{Depth, GO_ON, Node, Publisher, Subscription, Tick, Time, Topic};
///
/// /// Publishes the square of the newest number.
/// struct Square {
///     input: Subscription<f64>,
///     output: Publisher<f64>,
/// }
///
/// impl Node for Square {
///     fn tick(&mut self, now: Time) -> Tick {
///         if let Some(number) = self.input.latest(now) {
///             self.output.publish(number.data.powi(2), now, Some(number.sensed()));
///         }
///         GO_ON
///     }
/// }
///
/// let (numbers, squares) = (Topic::new("/n", Depth::ONE), Topic::new("/n²", Depth::ONE));
/// let mut square = Square { input: numbers.subscribe(), output: squares.publisher() };
/// let mut result = squares.subscribe();
/// numbers.publisher().publish(3.0, Time::ZERO, None);
/// square.tick(Time::ZERO)?;
/// assert_eq!(result.latest(Time::ZERO).map(|square| square.data), Some(9.0));
/// # Ok::<(), Box<dyn std::error::Error + Send + Sync>>(())
/// ```
///
/// A closure that takes the run time and returns a [`Tick`] is a node as well.
pub trait Node: Send {
    /// Does one period's work at run time `now`.
    ///
    /// # Errors
    /// Any failure of the node. The run ends with a [`Fault`]; after a [`NodeCrash`] it goes on
    /// without the node.
    fn tick(&mut self, now: Time) -> Tick;

    /// Applies the decision of a tick to the world outside of the graph, at run time
    /// `now`, when the tick is over. Most nodes only publish, and their messages wait for
    /// the end of the tick automatically; see [`Knob::Takes`](crate::Knob::Takes).
    ///
    /// # Errors
    /// Any failure of the node. The run ends with a [`Fault`].
    fn apply(&mut self, now: Time) -> Tick {
        let _ = now;
        GO_ON
    }

    /// Resets the node to its state when it was built, as a restart of a program does.
    /// Called only for a node that is no [restartable one](crate::Graph::restartable_node).
    ///
    /// # Errors
    /// The reason if the node cannot restart. The default refuses, because the initial
    /// state is unknown.
    fn restart(&mut self) -> Result<(), String> {
        Err(
            "this node cannot be started again: it is built once, and does not implement \
             Node::restart"
                .to_owned(),
        )
    }

    /// Handles a text sent to the node, between two calls of it, and returns the value before,
    /// for the log. Answer and effect must depend only on `text` and the node itself, so
    /// that a run can be repeated exactly.
    ///
    /// # Errors
    /// The reason and a remedy; the node is then unchanged. The default refuses every
    /// text.
    fn on_message(&mut self, text: &str) -> Result<String, String> {
        let _ = text;
        Err("this node takes no orders".to_owned())
    }

    /// Sets a parameter of the node at run time `now`, between two calls of it, and returns
    /// the value before, for the log. As for [`on_message`](Node::on_message), a run can be
    /// repeated exactly only if the effect depends on nothing else.
    ///
    /// # Errors
    /// The reason and a remedy; the node is then unchanged. The default knows no parameter.
    fn set_parameter(&mut self, name: &str, value: &str, now: Time) -> Result<String, String> {
        let _ = (value, now);
        Err(format!("this node has no parameter {name:?}"))
    }
}

impl<F: FnMut(Time) -> Tick + Send> Node for F {
    fn tick(&mut self, now: Time) -> Tick {
        self(now)
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
    pub cause: Box<dyn Error + Send + Sync>,
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
