//! Executors: which of the nodes that are due ticks next, and where.

mod agenda;
mod callback;
mod dispatcher;
mod events;
mod groups;
mod kind;
mod preemptive;
mod queue;
mod windows;

pub(crate) use agenda::{AgendaItem, Phase, Place};
pub use callback::Callback;
pub(crate) use dispatcher::Dispatcher;
pub(crate) use events::EventOrder;
pub use kind::Executor;
pub(crate) use queue::{Call, CallbackQueue, Nodes};
pub(crate) use windows::WindowOrder;
